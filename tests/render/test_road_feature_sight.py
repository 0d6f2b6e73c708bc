"""A depression and a hump from a low camera: depth, class and mask agree with rays over the profile."""

import numpy as np
import pytest

from tasks.conventions import ROAD_CLASSES
from tasks.render.labels import HAZARD, mark_hazard
from tasks.render.rasterise.rasteriser import prepare_gaussians, rasterise_view
from tasks.render.road_edit import apply_road_profile
from tasks.render.road_refinement import refine_road
from tasks.surface.road_profile import RoadHazard, road_elevation
from tests.render.test_road_edit import relief_of
from tests.render.weather.conftest import shutter
from tests.render.weather.scenes import road

WIDTH, HEIGHT, FOCAL = 96, 160, 400.0
EYE = 0.45


def seen_from(x: float, height: float, length: float):
    """Station by depth and by rays for the rows of the middle columns, and the frame's class and hazard mark."""
    hazard = RoadHazard(center_m=9.0, length_m=length, height_m=height)
    relief = relief_of(hazard)
    cloud, _ = apply_road_profile(refine_road(road(half_width=1.5, spacing=0.03), relief), relief, 1.5, -1.5)
    view = shutter(x=x, width=WIDTH, height=HEIGHT, focal=FOCAL)
    pose = view.T_world_camera.copy()
    pose[2, 3] = EYE
    g = rasterise_view(prepare_gaussians(cloud), np.linalg.inv(pose), view.K, WIDTH, HEIGHT)
    rows = np.arange(HEIGHT // 2 + 12, HEIGHT)
    by_depth = x + np.median(g.depth[rows, WIDTH // 2 - 3 : WIDTH // 2 + 3], axis=1)
    way = np.arange(0.5, 12, 0.002)
    drop = (rows + 0.5 - HEIGHT / 2) / FOCAL
    below = EYE - drop[:, None] * way <= road_elevation(x + way, hazard)
    by_ray = np.where(below.any(axis=1), x + way[below.argmax(axis=1)], np.inf)
    place = np.full((HEIGHT, WIDTH, 2), np.nan, np.float32)
    on_road = np.isin(g.class_id, ROAD_CLASSES) & np.isfinite(g.depth)
    place[on_road, 0] = x + g.depth[on_road]
    mark = mark_hazard(place, lambda s: road_elevation(s, hazard))
    return hazard, rows, by_depth, by_ray, g, mark


@pytest.mark.parametrize("height", [-0.15, 0.12])
@pytest.mark.parametrize("x", [3.5, 6.0, 8.5], ids=["before", "near", "at"])
def test_rows_show_the_station_that_their_ray_meets_first(x, height):
    _, _, by_depth, by_ray, _, _ = seen_from(x, height, 1.0)
    seen = by_ray < 14
    off = np.abs(by_depth - by_ray)[seen] / (by_ray - x)[seen]
    # a row at the very edge of what is hidden may show either side of it
    assert np.median(off) < 0.01
    assert np.mean(off < 0.04) > 0.93


def test_the_near_edge_of_a_depression_hides_its_near_flank():
    hazard, _, by_depth, by_ray, _, _ = seen_from(3.5, -0.15, 1.0)
    flank = (8.52, 8.85)
    assert not ((by_ray > flank[0]) & (by_ray < flank[1])).any()
    assert ((by_depth > flank[0]) & (by_depth < flank[1])).sum() <= 1
    assert ((by_depth > 9.0) & (by_depth < 9.5)).sum() >= 3
    assert road_elevation(8.7, hazard) < -0.03


@pytest.mark.parametrize("height", [-0.15, 0.12])
def test_the_hazard_mask_lies_on_the_road_and_where_rays_meet_the_feature(height):
    _, rows, _, by_ray, g, mark = seen_from(6.0, height, 1.0)
    assert np.isin(g.class_id[mark == HAZARD], ROAD_CLASSES).all()
    middle = mark[rows, WIDTH // 2] == HAZARD
    assert np.mean(middle == (np.abs(by_ray - 9.0) <= 0.5)) > 0.95
    assert middle.sum() > 5
