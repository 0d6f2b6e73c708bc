"""An import warns of what may be a fault of a recording, and imports it."""

from pathlib import Path

import numpy as np
import pytest

from catalogs.campaigns import read_campaign
from flows.measured.importing import import_measurements
from tests.campaign.recorded import braking_columns, log_signal
from tests.flows.measured.recordings import write_csv, write_map


def test_a_unit_that_nobody_knows_is_told_and_that_of_the_map_is_taken(tmp_path: Path) -> None:
    log = log_signal(braking_columns())
    source = Path(write_csv(tmp_path / "log.csv", log))
    names, *rows = source.read_text().splitlines()
    units = ",".join("furlong/h" if name == "v_kmh" else "" for name in log)
    source.write_text("\n".join([names, units, *rows]))
    report = import_measurements(
        str(source), map=write_map(tmp_path, csv={"units_row": True}), out=str(tmp_path / "campaign")
    )
    (told,) = [warning for warning in report["warnings"] if "furlong/h" in warning]
    assert told.startswith("signal v_kmh is in furlong/h by its file") and "taken to be in km/h" in told


@pytest.mark.parametrize(("computed", "told"), [(False, True), (True, False)])
def test_slopes_that_no_map_names_are_told_where_an_accelerometer_feels_them(
    tmp_path: Path, computed: bool, told: bool
) -> None:
    for n, slope in enumerate((-0.4, 0.0, 0.3)):
        log = log_signal(braking_columns(4.0 + n))
        speed = log["v_kmh"] / 3.6
        log["ax_g"] = np.gradient(speed, 0.01) / 9.80665 if computed else log["ax_g"] + slope / 9.80665
        write_csv(tmp_path / f"run-{n}.csv", log)
    (tmp_path / "map").mkdir()
    parts = ("train", "train", "held_out")
    runs = [{"name": f"run-{n}", "file": f"run-{n}.csv", "part": part} for n, part in enumerate(parts)]
    channel_map = write_map(tmp_path / "map", runs=runs)
    report = import_measurements(str(tmp_path), map=channel_map, out=str(tmp_path / "campaign"))
    warnings = report.get("warnings", [])
    assert any("map road_slope" in warning for warning in warnings) == told
    felt = [run.felt_slope for run in read_campaign(tmp_path / "campaign").runs]
    assert felt == pytest.approx([told * slope / 9.80665 for slope in (-0.4, 0.0, 0.3)], abs=0.0015)
