"""The brake that reads friction from the picture: its weights, what it was trained on, and that it brakes by them."""

from hashlib import sha256

import pytest

from catalogs.entries import load
from catalogs.scenario import Scenario
from studies.emergency_braking.compare import ROAD, compare_brakes
from studies.emergency_braking.seeing import GRID, WEIGHTS, Reader, load_reader
from studies.emergency_braking.table import load_table
from studies.learn_friction.network import read_network

ASPHALT = load("wet friction").apply(load("surface", "dense-asphalt"))


def test_the_weights_are_written_again_with_the_same_bytes(tmp_path):
    read_network(WEIGHTS).write(tmp_path / "again.npz")
    assert (tmp_path / "again.npz").read_bytes() == WEIGHTS.read_bytes()


def test_no_street_of_a_protocol_or_of_the_test_is_trained_on():
    grid = load("grid", GRID)
    streets: dict[str, set[str]] = {"train": set(), "test": set()}
    for (_, scenario), (split, _) in zip(grid.scenarios, grid.tags, strict=True):
        streets[split].add(str(scenario.scene))
    assert not streets["train"] & streets["test"] and ROAD not in streets["train"] | streets["test"]
    assert len(streets["train"]) == 24 and len(streets["test"]) == 2


def test_it_brakes_by_what_it_reads_and_the_table_says_both(monkeypatch, tmp_path):
    asked = {"protocol": ["ccrb"], "weather": ["snow-3"], "brake": ["friction", "picture"], "bounds": False}
    truth = compare_brakes(protocol=["ccrb"], weather=["snow-3"], brake=["friction"], bounds=False)["rows"][0]
    later = []
    for read in (0.1, truth["friction"], 0.8):
        monkeypatch.setattr(Reader, "look", lambda *_, read=read: read)
        result = compare_brakes(**asked, out=str(tmp_path / str(read)))
        later.append([row["brake_time_s"] for row in result["rows"] if row["brake"] == "picture"])
        assert [row.get("friction_seen") for row in result["rows"]] == [None, round(read, 4)] * 4
    assert later[0] < later[1] < later[2]
    assert result["sha256"] == {"picture": sha256(WEIGHTS.read_bytes()).hexdigest()}
    assert "Read from the picture" in (tmp_path / "0.8" / "aeb.html").read_text()


@pytest.mark.parametrize(("weather", "least", "most"), [("dry", 0.65, 0.95), ("snow-3", 0.15, 0.4)])
def test_on_a_street_that_it_never_saw_it_tells_snow_from_a_dry_road(weather, least, most):
    asked = Scenario(initial_speed_km_h=50, hold_speed=True, **load_table().list_weathers()[weather])
    assert least < load_reader().look(asked, load("vehicle", "bmw-320i"), ASPHALT) < most
