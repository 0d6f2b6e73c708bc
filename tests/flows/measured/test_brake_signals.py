"""Cars without a pressure sensor: another brake signal stands for the pressure, and none is told."""

from pathlib import Path

import pandas as pd
import pytest
import yaml

from catalogs.campaigns import read_campaign
from flows.measured.importing import import_measurements
from tasks.errors import InputError
from tests.campaign.recorded import MAP, braking_columns, log_signal


def test_a_brake_command_stands_for_the_pressure(tmp_path: Path) -> None:
    columns = log_signal(braking_columns(seconds=8.0))
    columns["command"] = columns.pop("p_bar") / 40.0  # 2 MPa are half of the brake
    for part in ("train", "held_out"):
        pd.DataFrame(columns).to_csv(tmp_path / f"{part}.csv", index=False)
    content = yaml.safe_load(MAP)
    del content["channels"]["brake_pressure"]
    content["channels"]["brake_command"] = {"source": "command", "unit": "1"}
    parts = ("train", "held_out") * 3
    content |= {
        "not_measured": ["brake_pressure"],
        "runs": [
            {"name": f"r{i}", "file": f"{part}.csv", "from_s": 0.2 * i, "to_s": 0.2 * i + 3.0, "part": part}
            for i, part in enumerate(parts)
        ],
    }
    (tmp_path / "map.yaml").write_text(yaml.safe_dump(content))
    import_measurements(str(tmp_path), map=str(tmp_path / "map.yaml"), out=str(tmp_path / "campaign"))
    campaign = read_campaign(tmp_path / "campaign")
    assert campaign.brake_signal == "brake_command" and campaign.runs[0].pressure.max() == pytest.approx(
        5.0, abs=0.1
    )


def test_a_campaign_without_any_brake_signal_is_told_which_would_do(tmp_path: Path) -> None:
    content = yaml.safe_load(MAP)
    del content["channels"]["brake_pressure"]
    pd.DataFrame(log_signal(braking_columns())).to_csv(tmp_path / "log.csv", index=False)
    (tmp_path / "map.yaml").write_text(yaml.safe_dump(content | {"not_measured": ["brake_pressure"]}))
    import_measurements(
        str(tmp_path / "log.csv"), map=str(tmp_path / "map.yaml"), out=str(tmp_path / "campaign")
    )
    with pytest.raises(
        InputError, match="brake_pressure, brake_command, brake_torque, pedal_force is enough"
    ):
        read_campaign(tmp_path / "campaign")
