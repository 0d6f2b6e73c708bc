"""Two walls of points: the near one hides half of the far one, and the picture cuts a third."""

import numpy as np
import pytest

from tasks.conventions import SemanticClass
from tasks.render.instances import InstanceFinder
from tasks.scene.gaussians import Gaussians

K = np.array([[50.0, 0, 50], [0, 50.0, 50], [0, 0, 1]])
FAR, NEAR, CUT = 1, 2, 3


def make_wall(x: tuple[float, float], z: float) -> np.ndarray:
    """Points of a wall 2 m high that faces the camera, every 0.05 m."""
    grid = np.meshgrid(np.arange(*x, 0.05) + 0.025, np.arange(-1, 1, 0.05) + 0.025, indexing="ij")
    return np.stack([*grid, np.full(grid[0].shape, z)], axis=-1).reshape(-1, 3)


@pytest.fixture(scope="module")
def seen():
    """The finder's answer to depth and class of the three walls, as they cover each other."""
    walls = {FAR: make_wall((-2, 2), 10.0), NEAR: make_wall((-1, 0), 5.0), CUT: make_wall((3, 6), 5.0)}
    points = np.concatenate(list(walls.values()))
    owners = np.repeat([*walls], [len(wall) for wall in walls.values()]).astype(np.int32)
    n = len(points)
    cloud = Gaussians(
        means=points.astype(np.float32),
        quats_wxyz=np.tile(np.array([1, 0, 0, 0], np.float32), (n, 1)),
        scales=np.full((n, 3), 0.03, np.float32),
        opacities=np.ones(n, np.float32),
        sh=np.zeros((n, 1, 3), np.float32),
        normals=np.tile(np.array([0, 0, -1], np.float32), (n, 1)),
        class_id=np.where(owners == NEAR, SemanticClass.POLE, SemanticClass.VEHICLE).astype(np.uint8),
    )
    depth, classes = np.full((100, 100), np.nan), np.zeros((100, 100), np.uint8)
    v, u = np.mgrid[:100, :100] + 0.5
    for number in (FAR, CUT, NEAR):
        wall, z = walls[number], walls[number][0, 2]
        x, y = (u - 50) / 50 * z, (v - 50) / 50 * z
        here = (x > wall[:, 0].min()) & (x < wall[:, 0].max()) & (np.abs(y) < 1)
        depth[here] = z
        classes[here] = SemanticClass.POLE if number == NEAR else SemanticClass.VEHICLE
    return InstanceFinder(cloud, owners).find(depth, classes, K, np.eye(4))


def test_each_pixel_is_that_of_the_object_it_shows(seen) -> None:
    row = seen.pixels[50]
    assert set(row[41:50]) == {NEAR} and set(row[51:59]) == {FAR} and set(row[82:100]) == {CUT}
    assert not seen.pixels[20].any() and not row[65:78].any()


def test_visibility_is_the_share_that_nothing_else_hides(seen) -> None:
    # the near wall, 1 m at 5 m, stands before 2 m of the 4 m at 10 m; the picture ends at 5 m of the third, of 3 to 6
    assert seen.visibility[FAR] == pytest.approx(0.5, abs=0.03)
    assert seen.visibility[NEAR] == seen.visibility[CUT] == 1.0
    assert seen.truncation[CUT] == pytest.approx(1 / 3, abs=0.02)
    assert seen.truncation[FAR] == seen.truncation[NEAR] == 0.0
