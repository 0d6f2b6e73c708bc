"""Campaigns of the double-track car: isolated, keyed, accepted by the reader, and each effect visible in them."""

import ast
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
import yaml

import studies.double_track as package
from catalogs.campaigns import read_campaign
from catalogs.entries import load
from studies.double_track.campaign import draw_session, make_campaign, measure_run
from studies.double_track.declared import read_declared
from studies.double_track.draws import draw_coloured, draw_smooth, keyed_generator
from studies.double_track.effects import Truth, draw_truth, list_truths
from studies.double_track.judge import CHANNEL_SETS, without_channels
from tasks.vehicle.effects.table import PARAMETERS

FOLDER = Path(package.__file__).parent
GENERATOR = (
    "make", "campaign", "effects", "drive", "motion", "car", "declared", "draws", "instruments", "tyre", "brakes",
    "suspension",
)  # fmt: skip
EFFECTS = read_declared("effects")
LEVEL = dict.fromkeys(read_declared("designs")["tolerances_1sigma"], 0.0)


def list_imports(path: Path) -> list[str]:
    """Modules that a file imports, at its top or within a function."""
    found = []
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        found += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
        found += [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
    return found


def test_no_module_of_the_package_imports_what_is_judged_and_the_generator_nothing_of_musync():
    forbidden = ("tasks.vehicle", "tasks.identification", "tasks.surface")
    for path in FOLDER.glob("*.py"):
        assert not [name for name in list_imports(path) if name.startswith(forbidden)], path.name
    for module in GENERATOR:
        for name in list_imports(FOLDER / f"{module}.py"):
            parts = name.split(".")
            assert parts[0] not in ("tasks", "catalogs", "flows", "manifests", "musync"), module
            assert parts[0] != "studies" or parts[-1] in GENERATOR, f"{module} imports {name}"


def test_draws_follow_from_their_key_alone():
    one, other = keyed_generator(1, "null-01", "run"), keyed_generator(1, "null-02", "run")
    first = one.standard_normal(4)
    assert (keyed_generator(1, "null-01", "run").standard_normal(4) == first).all()
    assert not np.isclose(other.standard_normal(4), first).any()


def test_noise_and_disturbances_have_the_declared_size_and_memory():
    noise = draw_coloured(keyed_generator("noise"), 40_000, 0.6)
    assert noise.std() == pytest.approx(1.0, abs=0.03)
    assert np.corrcoef(noise[1:], noise[:-1])[0, 1] == pytest.approx(0.6, abs=0.02)
    smooth = draw_smooth(keyed_generator("smooth"), np.arange(60_000) * 0.01, 45.0, 0.8)
    assert smooth.std() == pytest.approx(45.0, rel=0.15)
    assert np.abs(np.diff(smooth)).max() < 10.0


@pytest.mark.minutes
def test_a_run_is_the_same_whenever_it_is_driven():
    plan = {"speed": 9.0, "pressure": 1.5, "duration": 2.0}
    truth, session = Truth(name="null-01"), draw_session(1, "null-01", "rich")
    first = measure_run(plan, "run-01", truth, session, (1, "null-01", 0), True)
    measure_run(plan, "run-02", truth, session, (1, "null-01", 1), True)
    again = measure_run(plan, "run-01", truth, session, (1, "null-01", 0), True)
    other = measure_run(plan, "run-01", truth, session, (2, "null-01", 0), True)
    assert all((again.columns[name] == values).all() for name, values in first.columns.items())
    assert not (other.columns["speed"][:50] == first.columns["speed"][:50]).any()


@pytest.mark.minutes
def test_a_driver_holds_his_speed_until_he_lifts_and_then_the_car_coasts():
    resistance = {"drag_area": 0.8, "rolling_coefficient": 0.012, "engine_torque": 60.0, "pad_drag": 50.0}
    run = {"speed": 25.0, "duration": 4.0, "onset": 3.0}
    truth = Truth(name="held", values=resistance)
    held, coasting = (
        np.gradient(measure_run(plan, "run-01", truth, LEVEL, (0,), False).columns["speed"], 0.01)
        for plan in (run | {"driver": [0.0, 0.5]}, run)
    )
    assert np.abs(held[100:220]).max() < 0.01
    assert coasting[100:220].max() < -0.4
    assert held[280:295].mean() == pytest.approx(coasting[20:35].mean(), abs=0.02)  # at the same speed


def test_sizes_go_from_small_to_large_within_their_range():
    for name in (*EFFECTS["standard"], *EFFECTS["further"]):
        entry = EFFECTS["standard"].get(name) or EFFECTS["further"][name]
        key, limits = next(iter(entry["values"].items()))
        drawn = [abs(draw_truth(name, size, 5, 1).values[key]) for size in range(5)]
        low, high = sorted(abs(x) for x in limits)
        assert low <= min(drawn) and max(drawn) <= high
        assert drawn == sorted(drawn)
    assert len(list(list_truths(["null", "standard"], 5, 60, 1))) == 60 + 28 * 5


def test_effects_carry_the_librarys_names_units_and_bounds():
    library = {effect.name: effect for effect in load("library of effects")}
    for group in ("standard", "further"):
        for entry in EFFECTS[group].values():
            first, limits = next(iter(entry["values"].items()))
            assert library[entry["library"]].parameters[0].name == first
            row = PARAMETERS[first]
            assert entry["unit"] == row.unit
            assert row.lower <= min(limits) and max(limits) <= row.upper


RUNS = {
    "snow_ploughing": {"weather": "snow", "rate": 1, "speed": 12.0, "duration": 2.0},
    "wet_friction_speed": {"weather": "rain", "rate": 10, "speed": 20.0, "pressure": 2.4, "duration": 2.0},
    "wet_force": {"weather": "rain", "rate": 10, "speed": 25.0, "duration": 2.0},
    "tyre_heating": {"weather": "rain", "rate": 10, "speed": 25.0, "pressure": 2.4, "duration": 2.5},
    "load_sensitivity": {"speed": 15.0, "pressure": 3.6, "duration": 2.0},
    "retuned_friction": {"speed": 15.0, "pressure": 3.6, "duration": 2.0},
    "creep": {"speed": 4.0, "duration": 1.5},
    "damper_asymmetry": {"speed": 11.0, "duration": 2.5, "hazard": [12.0, 3.7, 0.075]},
    "strut_step": {"speed": 11.0, "duration": 2.5, "hazard": [12.0, 3.7, 0.075]},
    "bump_stop": {"speed": 9.0, "duration": 2.0, "hazard": [10.0, 2.0, -0.08]},
}


@pytest.mark.minutes
@pytest.mark.parametrize("name", [*EFFECTS["standard"], *EFFECTS["further"], *EFFECTS["forms"]])
def test_every_effect_shows_beyond_noise_in_a_run_that_excites_it(name):
    plan = RUNS.get(name, {"speed": 25.0, "pressure": 2.3, "duration": 2.0, "disc": 200.0})
    truth, plain = draw_truth(name, 4, 5, 1), Truth(name="null")
    own = measure_run(plan, "run-01", truth, LEVEL, (1,), False).columns
    null = measure_run(plan, "run-01", plain, LEVEL, (1,), False).columns
    sigma = {key: entry["sigma"] for key, entry in read_declared("designs")["noise"]["channels"].items()}
    count = min(len(own["speed"]), len(null["speed"]))
    shown = {key: np.abs(own[key][:count] - null[key][:count]).max() / sigma[key] for key in sigma}
    assert max(shown.values()) > 2.0, shown


@pytest.fixture(scope="module")
def null_campaign(tmp_path_factory):
    folder = tmp_path_factory.mktemp("campaigns") / "null-01"
    return folder, make_campaign(folder, Truth(name="null-01"), "poor", 1)


@pytest.mark.minutes
def test_a_null_campaign_is_accepted_by_the_reader(null_campaign):
    folder, label = null_campaign
    campaign = read_campaign(folder)
    assert campaign.vehicle == "paper-reference"
    assert (len(campaign.train), len(campaign.held_out)) == (8, 4)
    assert label["effect"] is None and label["values"] == {}
    assert campaign.tolerances.session == (0.02, 0.01, 0.02, 0.005, 0.04, 0.02, 0.0015)


@pytest.mark.minutes
def test_a_set_of_channels_drops_columns_and_says_so(null_campaign, tmp_path):
    folder, _ = null_campaign
    assert without_channels(folder, tmp_path / "x", ()) == folder
    copy = without_channels(folder, tmp_path / "copy", CHANNEL_SETS["speed-pressure"])
    assert pq.read_schema(copy / "runs" / "run-01.parquet").names == ["time", "brake_pressure", "speed"]
    header = yaml.safe_load((copy / "campaign.yaml").read_text(encoding="utf-8"))
    assert header["not_measured"] == list(CHANNEL_SETS["speed-pressure"])
    assert pq.read_schema(copy / "runs" / "run-01.parquet").field("speed").metadata[b"units"] == b"m/s"
