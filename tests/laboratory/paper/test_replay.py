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
def test_each_scenario_of_a_grid_that_ships_is_held_against_itself_whatever_seeds_the_grid_has(
    name, monkeypatch
):
    def run(clip, plan, catalogue, frames):
        """Motion by the scenario, pictures by what falls and the seed."""
        asked = [float(value) for value in clip.scenario.as_row().values() if isinstance(value, float)]
        seen = (clip.label, clip.scenario.weather != "dry" and clip.seed)
        return replay.Replay(
            label=clip.label,
            seed=plan.settings.seed,
            columns={"asked": np.array(asked)},
            frames_sha256=str(seen),
        )

    monkeypatch.setattr(replay, "_run_clip", run)
    camera = SimpleNamespace(camera=SimpleNamespace(sensor=Sensor()))
    monkeypatch.setattr(replay, "Catalogue", lambda *given: camera)
    result = replay.replay_audit(name, seeds=3)
    assert result["problems"] == [] and result["runs"] == 3 * len(load("grid", name).scenarios)
