"""The replay audit: a seed that reaches the motion, or a picture that ignores it, is named."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from catalogs.entries import entry_names, load
from flows.making.driving import simulate_drive
from flows.making.pictures import render_frames
from studies.paper import replay
from tasks.errors import InputError
from tasks.render.sensor import Sensor
from tests.toy_street import write_toy_grid


@pytest.fixture(scope="module")
def grid(tmp_path_factory) -> str:
    return write_toy_grid(tmp_path_factory.mktemp("replay"), frames=4)


def test_seeds_move_the_snow_and_nothing_in_the_motion(grid, tmp_path):
    result = replay.replay_audit(grid, seeds=2, out=str(tmp_path))
    assert result["verified"] and result["problems"] == []
    assert result["runs"] == 8
    assert set(result["largest_difference"].values()) == {0.0}
    assert {"speed", "pitch", "surface_friction", "T_world_rig"} <= set(result["largest_difference"])
    assert (tmp_path / "replay.json").is_file()


def test_a_seed_that_reaches_the_motion_is_named_by_channel(grid, monkeypatch):
    calls = []

    def leaking(*args):
        state, ride = simulate_drive(*args)
        calls.append(1)
        columns = ride.columns | {"heave": ride.columns["heave"] + 1e-9 * len(calls)}
        return state, replace(ride, columns=columns)

    monkeypatch.setattr(replay, "simulate_drive", leaking)
    result = replay.replay_audit(grid, seeds=2)
    assert not result["verified"]
    assert any(problem.startswith("heave differs by up to") for problem in result["problems"])


def test_snow_that_ignores_the_seed_is_named(grid, monkeypatch):
    monkeypatch.setattr(replay, "render_frames", lambda *args: render_frames(*args[:5], 7, *args[6:]))
    result = replay.replay_audit(grid, seeds=2)
    assert "snow-3/flat: 2 seeds gave 1 different pictures" in result["problems"]


def test_one_seed_is_no_audit(grid):
    with pytest.raises(InputError, match="seeds and frames must be at least 2"):
        replay.replay_audit(grid, seeds=1)


@pytest.mark.parametrize("name", entry_names("grid"))
@pytest.mark.parametrize("daylight", [None, ((1.0, 1.0, 1.0),) * 3])
def test_each_scenario_is_held_against_itself_and_a_dry_street_that_knows_its_light_changes_with_the_seed(
    name, daylight, monkeypatch
):
    def run(clip, plan, catalogue, frames):
        """Motion by the scenario, pictures by what falls and the seed: no other light on a dry street."""
        asked = [float(value) for value in clip.scenario.as_row().values() if isinstance(value, float)]
        seen = (clip.label, clip.scenario.weather != "dry" and clip.seed)
        return replay.Replay(
            label=clip.label,
            seed=plan.settings.seed,
            columns={"asked": np.array(asked)},
            frames_sha256=str(seen),
        )

    monkeypatch.setattr(replay, "_run_clip", run)
    camera = SimpleNamespace(sensor=Sensor(), varies=False)
    made = SimpleNamespace(camera=camera, scene=SimpleNamespace(daylight=daylight))
    monkeypatch.setattr(replay, "Catalogue", lambda *given: made)
    scenarios = load("grid", name).scenarios
    dry = [label for label, scenario in scenarios if scenario.weather == "dry" and daylight is not None]
    result = replay.replay_audit(name, seeds=3)
    assert result["problems"] == [f"{label}: 3 seeds gave 1 different pictures" for label in dry]
    assert result["runs"] == 3 * len(scenarios)
