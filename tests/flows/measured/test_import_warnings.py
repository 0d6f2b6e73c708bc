"""An import warns of what may be a fault of a recording, and imports it."""

from pathlib import Path

import numpy as np
import pytest
import yaml

from flows.measured.importing import import_measurements
from tests.campaign.recorded import MAP, braking_columns, log_signal
from tests.flows.measured.recordings import map_beside, write_csv, write_map


def test_a_brake_in_a_turn_is_told(tmp_path: Path) -> None:
    log = log_signal(braking_columns())
    log["ay"] = 8.0 * np.clip((log["t_ms"] - 3000.0) / 100.0, 0.0, 1.0)
    channels = yaml.safe_load(MAP)["channels"] | {"lateral_acceleration": {"source": "ay", "unit": "m/s^2"}}
    source = write_csv(tmp_path / "log.csv", log)
    report = import_measurements(
        source, map=write_map(tmp_path, channels=channels), out=str(tmp_path / "campaign")
    )
    assert any("log (up to 8" in warning for warning in report["warnings"])


@pytest.mark.parametrize(("computed", "told"), [(False, True), (True, False)])
def test_slopes_that_no_map_names_are_told_where_an_accelerometer_feels_them(
    tmp_path: Path, computed: bool, told: bool
) -> None:
    for n, slope in enumerate((-0.4, 0.0, 0.3)):
        log = log_signal(braking_columns(4.0 + n))
        speed = log["v_kmh"] / 3.6
        log["ax_g"] = np.gradient(speed, 0.01) / 9.80665 if computed else log["ax_g"] + slope / 9.80665
        write_csv(tmp_path / f"run-{n}.csv", log)
    report = import_measurements(str(tmp_path), map=map_beside(tmp_path), out=str(tmp_path / "campaign"))
    warnings = report.get("warnings", [])
    assert any("map road_slope" in warning for warning in warnings) == told
