"""The bump study on the recording it ships for, where that is at hand."""

import json
from pathlib import Path

import pytest

from flows.measured.importing import import_measurements
from studies.measured_drives.bump_study import bump_study


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
