"""What is no fault of a recording, and yet told by its import."""

from pathlib import Path

import numpy as np
import yaml

from flows.measured.importing import import_measurements
from tests.campaign.recorded import MAP, braking_columns, log_signal
from tests.flows.measured.recordings import write_csv, write_map


def test_a_brake_in_a_turn_is_told(tmp_path: Path) -> None:
    log = log_signal(braking_columns())
    log["ay"] = 8.0 * np.clip((log["t_ms"] - 3000.0) / 100.0, 0.0, 1.0)
    channels = yaml.safe_load(MAP)["channels"] | {"lateral_acceleration": {"source": "ay", "unit": "m/s^2"}}
    source = write_csv(tmp_path / "log.csv", log)
    report = import_measurements(
        source, map=write_map(tmp_path, channels=channels), out=str(tmp_path / "campaign")
    )
    assert any("log (up to 8" in warning for warning in report["warnings"])
