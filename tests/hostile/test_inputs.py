"""Inputs and plans from a stranger: YAML makes no objects, and scenes, vehicles and plans lead to no other files."""

import json
import shutil
from collections.abc import Callable
from typing import Any

import pytest

from tests.flows.reseal import reseal
from tests.hostile.stage import Stage, endure, refused, unrefused

READS_INPUTS = ("verify", "explain", "audit-physics", "generate")


def write_input(name: str, text: str) -> Callable[[Stage], object]:
    return lambda stage: (stage.dataset.inputs / name).write_text(text.format(victim=stage.victim))


def replace_in(name: str, old: str, new: str) -> Callable[[Stage], None]:
    def change(stage: Stage) -> None:
        path = stage.dataset.inputs / name
        text = path.read_text()
        assert old in text
        path.write_text(text.replace(old, new))

    return change


def edit_plan(change: Callable[[Any], object]) -> Callable[[Stage], None]:
    def edit(stage: Stage) -> None:
        plan = json.loads(stage.dataset.plan.read_text())
        change(plan)
        stage.dataset.plan.write_text(json.dumps(plan))

    return edit


def both(change: Callable[[Any], object]) -> Callable[[Stage], None]:
    """Plan and manifest, so that they agree."""

    def edit(stage: Stage) -> None:
        edit_plan(change)(stage)
        reseal(stage.dataset, change)

    return edit


INPUTS: dict[str, Callable[[Stage], object]] = {
    "a command in the vehicle": write_input(
        "vehicle.yaml", "!!python/object/apply:os.mkdir ['{victim}/PWNED']"
    ),
    "a hundred thousand brackets": write_input("camera.yaml", "[" * 100_000),
    "a number": write_input("surface.yaml", "7"),
    "the same key twice": replace_in(
        "camera.yaml", "width:", "height: {value: 1, unit: px, source: x}\nwidth:"
    ),
    "a picture of a million by a million": replace_in("camera.yaml", "value: 96", "value: 1000000"),
    "an infinite focal length": replace_in("camera.yaml", "value: 80", "value: .inf"),
    "a grid with a scene elsewhere": write_input("grid.json", '{{"scene": "/etc"}}'),
    "a plan that is another dataset's": edit_plan(lambda p: p.update(run_id="f" * 16)),
    "a plan with other clips": edit_plan(
        lambda p: p["clips"][0].update(clip_id="0123456789abcdef", label="x")
    ),
    "a plan with a hundred thousand frames": edit_plan(lambda p: p["grid"].update(frames=100_000)),
    "a plan with paths as inputs": edit_plan(
        lambda p: p["inputs"].update({"../../../victim/vehicle.yaml": "0" * 64})
    ),
    "a scene elsewhere": both(lambda r: r["grid"].update(scene="/etc")),
    "a scene's name elsewhere": both(lambda r: r["scene"].update(name="../../victim")),
}


@pytest.mark.parametrize("attack", INPUTS)
def test_a_dataset_whose_inputs_hold(stage, attack):
    evil = stage.dataset.root.parent / "evil"
    evil.mkdir()
    (evil / "scene.yaml").write_text("!!python/object/apply:os.mkdir ['PWNED']")
    INPUTS[attack](stage)
    outcomes = endure(stage, *READS_INPUTS)
    if stage.manifest() == json.loads(
        stage.original.manifest.read_text()
    ):  # else it agrees with what it records
        assert refused(outcomes["verify"])
        reseal(stage.dataset)
        stage.dataset.frame_shard("rgb", 0).unlink()  # repair has to make a clip with these inputs
        endure(stage, "repair")


def test_an_input_that_is_missing_is_not_taken_from_elsewhere(stage):
    """Of an input that the manifest names as a path, repair writes no file."""
    reseal(stage.dataset, lambda m: m["inputs"].update({"../../../victim/vehicle.yaml": "0" * 64}))
    shutil.rmtree(stage.dataset.inputs / "weather")
    outcomes = endure(stage, "repair", "audit", "sign")
    assert unrefused(outcomes) == []
