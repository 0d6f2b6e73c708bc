"""The bump study on the recording it ships for, where that is at hand."""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml

from flows.measured.importing import import_measurements
from studies.measured_drives.bump_study import bump_study
from tasks.errors import InputError


def test_the_recordings_bumps_and_slopes(outside_data: Path, tmp_path: Path) -> None:
    source = outside_data / "measured" / "comma2k19" / "comma2k19_example1_100hz.parquet"
    if not source.is_file():
        pytest.skip(f"no comma2k19 recording at {source}")
    import_measurements(str(source), map="comma2k19", out=str(tmp_path / "campaign"))
    result = bump_study(str(tmp_path / "campaign"), out=str(tmp_path / "out"))
    assert result == json.loads((tmp_path / "out" / "bump_study.json").read_text())
    # what docs/evidence/measured-drives.md prints
    assert result["sensors"]["gravity_on_slope"] == pytest.approx(10.0, abs=0.1)
    assert result["sensors"]["rate_of_pitch_gain"] == pytest.approx(0.98, abs=0.02)
    first, second, rough = result["windows"]
    assert first["calibrated"]["rate_correlation"] == pytest.approx(0.968, abs=0.01)
    assert second["calibrated"]["rate_rmse"] < second["uncalibrated"]["rate_rmse"]
    assert rough["calibrated"]["rate_correlation"] < 0.5
    assert result["pitch_mode"]["calibrated"]["frequency_hz"] == pytest.approx(1.81, abs=0.05)


def small_campaign(folder: Path) -> str:
    t = np.arange(1200) / 100
    wave = np.radians(2.0 * np.sin(t))
    log = {
        "t": t, "v_can_mps": 15.0 + 0.3 * np.sin(t), "imu_ax_fwd": 0.3 * np.cos(t),
        "imu_az_down": -9.66 + 0.1 * np.sin(9 * t),
        "gyro_y_pitch": 2.0 * np.cos(t) * np.pi / 180, "gyro_z": 0.01 * np.sin(t), "gyro_x": 0.01 * np.cos(t),
        "pose_pitch_deg": np.degrees(wave), "steer_deg": np.sin(t),
    }  # fmt: skip
    pd.DataFrame(log).to_csv(folder / "log.csv", index=False)
    import_measurements(str(folder / "log.csv"), map="comma2k19", out=str(folder / "campaign"))
    return str(folder / "campaign")


def test_a_study_of_another_run_or_beyond_its_end_is_refused(tmp_path: Path) -> None:
    campaign = small_campaign(tmp_path)
    with pytest.raises(InputError, match="the study needs the run comma2k19_example1_100hz; there are: log"):
        bump_study(campaign)
    plan = {"run": "log", "windows": [{"name": "late", "from_s": 10.0, "to_s": 14.0}]}
    (tmp_path / "study.yaml").write_text(yaml.safe_dump(plan))
    with pytest.raises(InputError, match="window late must lie within 0 to 11"):
        bump_study(campaign, study=str(tmp_path / "study.yaml"))
    (tmp_path / "study.yaml").write_text(
        yaml.safe_dump(plan | {"windows": [{"name": "w", "from_s": 2.0, "to_s": 2.5}]})
    )
    with pytest.raises(InputError, match="window w must last 1 s or more"):
        bump_study(campaign, study=str(tmp_path / "study.yaml"))
