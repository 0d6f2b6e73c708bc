"""From synthetic bus drives through the importer to the protocol's JSON, as a user would."""

import csv
import json
from itertools import pairwise
from pathlib import Path

import pytest

from flows.measured.importing import import_measurements
from studies.measured_drives.brake_protocol import brake_protocol
from studies.measured_drives.synthetic_drives import synthetic_drives


@pytest.fixture(scope="module")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("drives")
    synthetic_drives(str(folder / "bus"), events=8, seed=5)
    import_measurements(str(folder / "bus"), map="a2d2", out=str(folder / "campaign"))
    return folder / "campaign"


def test_the_drives_are_in_the_buses_units_and_steps(tmp_path: Path) -> None:
    synthetic_drives(str(tmp_path / "bus"), drives=1, events=2)
    bus = json.loads((tmp_path / "bus" / "drive-1.json").read_text())
    assert bus["brake_pressure"]["unit"] == "Unit_Bar"
    times, values = zip(*bus["brake_pressure"]["values"], strict=True)
    assert max(values) > 1.2, "bar, not MPa"
    assert all(abs(value * 10 - round(value * 10)) < 1e-6 for value in values)
    assert {b - a for a, b in pairwise(times)} == {20_000}
    starts = {signal["values"][0][0] for signal in bus.values()}
    assert len(starts) == len(bus), "no two signals share their sampling instants"


def test_the_same_seed_gives_the_same_drives(tmp_path: Path) -> None:
    for name, seed in (("a", 1), ("b", 1), ("c", 2)):
        synthetic_drives(str(tmp_path / name), drives=1, events=2, seed=seed)
    a, b, c = ((tmp_path / name / "drive-1.json").read_bytes() for name in "abc")
    assert a == b != c


def test_the_whole_protocol_on_three_drives(campaign: Path, tmp_path: Path) -> None:
    result = brake_protocol(str(campaign), out=str(tmp_path))
    assert result == json.loads((tmp_path / "brake_protocol.json").read_text())
    assert (result["drives"], result["episodes"], result["unassessed"]) == (3, 24, [])
    assert 3 <= result["retained"] < result["candidates"]
    page = (tmp_path / "brake_protocol.html").read_text()
    assert (tmp_path / "dives.svg").is_file() and 'class="plot"' in page
    assert f"{result['macro'][0]['pitch_rmse']:.4g}" in page
    table = list(csv.DictReader((tmp_path / "attrition.csv").read_text().splitlines()))
    assert len(table) == 12 and int(table[-1]["left"]) == result["retained"]
    joint = next(row for row in result["macro"] if row["variant"] == "joint")
    assert joint["pitch_rmse"] < 0.1 * joint["no_dive_rmse"]
    for fold in result["folds"]:
        assert fold["brake_gain_n_m_per_mpa"] == pytest.approx(1600, rel=0.03)
