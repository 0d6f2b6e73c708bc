"""A road that sinks beside its kerb leaves no hole below the kerb's face."""

import numpy as np
import pytest

from tasks.conventions import SemanticClass
from tasks.render.kerb_face import extend_kerbs
from tasks.render.rasterise.rasteriser import prepare_gaussians, rasterise_view
from tasks.render.road_edit import apply_road_profile
from tasks.render.weather.scene_light import append_gaussians
from tasks.scene.gaussians import Gaussians
from tasks.surface.road_profile import RoadHazard
from tests.render.test_road_edit import relief_of
from tests.render.weather.conftest import shutter
from tests.render.weather.scenes import road, surfels

FACE_Y, HIGH = 2.0, 0.12


def street_with_kerb() -> Gaussians:
    """A road up to a kerb on the left, whose face has two rows and whose top is as wide as a pavement."""
    x, z = (v.ravel() for v in np.meshgrid(np.arange(1.0, 17.0, 0.06), np.arange(0.03, HIGH, 0.06)))
    face = surfels(
        np.column_stack((x, np.full(x.size, FACE_Y), z)), (0, -1, 0), 0.04, 0.3, SemanticClass.KERB
    )
    x, y = (v.ravel() for v in np.meshgrid(np.arange(1.0, 17.0, 0.06), np.arange(FACE_Y, 6.0, 0.06)))
    top = surfels(np.column_stack((x, y, np.full(x.size, HIGH))), (0, 0, 1), 0.04, 0.4, SemanticClass.KERB)
    return append_gaussians(append_gaussians(road(half_width=FACE_Y, spacing=0.05), face), top)


def shape_road(height_m: float) -> tuple[Gaussians, Gaussians]:
    """The street with a road feature, before and after its kerbs follow it."""
    relief = relief_of(RoadHazard(center_m=6.0, length_m=3.0, height_m=height_m))
    shaped = apply_road_profile(street_with_kerb(), relief, FACE_Y, -FACE_Y)[0]
    return shaped, extend_kerbs(shaped, relief)


def count_holes(gaussians: Gaussians) -> int:
    """Pixels between nearest road and horizon in which nothing stands, seen from the car."""
    view = shutter(width=240, height=160, focal=200.0)
    drawn = rasterise_view(prepare_gaussians(gaussians), np.linalg.inv(view.T_world_camera), view.K, 240, 160)
    return int((drawn.alpha[105:150, 40:120] < 0.5).sum())


@pytest.mark.parametrize("depth_m", [0.15, 0.2, 0.4])
def test_nobody_sees_under_the_pavement_where_the_road_sinks(depth_m):
    before, after = shape_road(-depth_m)
    assert count_holes(before) > 10
    assert count_holes(after) == 0


def test_the_face_alone_is_continued_and_down_to_the_road():
    before, after = shape_road(-0.2)
    for name in ("means", "normals", "sh", "class_id"):
        np.testing.assert_array_equal(getattr(after, name)[: len(before)], getattr(before, name))
    copies = after.means[len(before) :]
    assert np.allclose(copies[:, 1], FACE_Y) and np.all(np.abs(copies[:, 0] - 6) < 1.6)
    assert copies[:, 2].min() == pytest.approx(0.03 - 0.2, abs=0.002)
    assert np.diff(np.unique(copies[np.abs(copies[:, 0] - 6) < 0.03, 2].round(3))).max() < 0.1


@pytest.mark.parametrize("height_m", [0.1, 0.0])
def test_a_hump_and_a_flat_road_leave_the_kerb_as_it_is(height_m):
    before, after = shape_road(height_m)
    assert after is before
