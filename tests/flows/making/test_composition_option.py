"""The grid's choice of composition: part of what decides a clip, and refused where it has no meaning."""

from dataclasses import replace
from pathlib import Path

import pytest

from catalogs.entries import load
from flows.making import pictures
from flows.making.plan import freeze_grid
from studies.paper import replay
from tasks.errors import InputError
from tasks.render.clip import render_clip
from tests.toy_street import write_toy_grid


def planned(**settings):
    grid = load("grid", "demo")
    return freeze_grid(replace(grid, settings=grid.settings.model_copy(update=settings)), "demo", "cpu")[0]


def test_another_composition_is_another_clip():
    linear, paper = planned(), planned(composition="paper")
    assert not {clip.clip_id for clip in linear.clips} & {clip.clip_id for clip in paper.clips}
    assert [clip.seed for clip in linear.clips] == [clip.seed for clip in paper.clips]


@pytest.mark.parametrize("camera", ["dashcam-480x320-rolling", "dashcam-480x320-noisy"])
def test_8_bit_composition_is_refused_for_a_camera_that_needs_linear_light(camera):
    planned(camera=camera)
    with pytest.raises(InputError, match=f"composition: paper .* {camera} .* composition: linear"):
        planned(camera=camera, composition="paper")


@pytest.mark.parametrize(("composition", "refracts"), [("paper", True), ("linear", False)])
def test_films_refract_in_the_papers_composition_alone(tmp_path, monkeypatch, composition, refracts):
    grid = Path(write_toy_grid(tmp_path, frames=2))
    grid.write_text(grid.read_text() + f"composition: {composition}\n")
    asked = []

    def render(scene, camera, motion, conditions, *args, **options):
        asked.append(conditions.refracts)
        return render_clip(scene, camera, motion, conditions, *args, **options)

    monkeypatch.setattr(pictures, "render_clip", render)
    replay.replay_audit(str(grid), seeds=2)
    assert set(asked) == {refracts}
