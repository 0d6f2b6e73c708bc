"""Surroundings of a Gaussian: overlap and size of its neighbours in one surface."""

from dataclasses import replace

import numpy as np
import pytest

from tasks.errors import InputError
from tasks.scene.gaussians import Gaussians, check_gaussians
from tasks.scene.surroundings import OPAQUE, add_surroundings
from tests.render.clouds import make_cloud

SPACING, SIZE, OPACITY = 0.04, 0.03, 0.9
OVERLAP = 2 * np.pi * SIZE**2 * OPACITY / SPACING**2


def make_floor(scatter: bool = False) -> Gaussians:
    """A square of 41 x 41 level discs, on a grid or at random."""
    side = np.arange(-20, 21) * SPACING
    x, y = (axis.ravel() for axis in np.meshgrid(side, side))
    if scatter:
        x, y = np.random.default_rng(2).uniform(-20.5 * SPACING, 20.5 * SPACING, (2, len(x)))
    means = np.column_stack((x, y, 0 * x))
    discs = make_cloud(means, scales=(SIZE, SIZE, 1e-3), opacities=OPACITY, normals=(0, 0, 1))
    return replace(discs, antialiased=True)


def inside(gaussians: Gaussians) -> np.ndarray:
    return np.abs(gaussians.means[:, :2]).max(axis=1) < 12 * SPACING


@pytest.mark.parametrize("scatter", [False, True])
def test_overlap_is_opacity_times_area_per_area(scatter):
    ground = add_surroundings(make_floor(scatter))
    assert ground.surroundings[inside(ground), 0].mean() == pytest.approx(OVERLAP, rel=0.08)
    assert ground.surroundings[inside(ground), 1] == pytest.approx(1, rel=1e-6)


def test_neighbours_count_in_their_own_surface_only():
    ground = make_floor()
    wall = replace(
        ground,
        means=ground.means[:, [2, 1, 0]],
        normals=ground.normals[:, [2, 1, 0]].copy(),
        scales=ground.scales[:, [2, 1, 0]].copy(),
    )
    names = ("means", "quats_wxyz", "scales", "opacities", "sh", "normals", "class_id")
    joined = {name: np.concatenate((getattr(ground, name), getattr(wall, name))) for name in names}
    both = add_surroundings(replace(ground, **joined))
    corner = np.abs(both.means[:, [0, 2]]).max(axis=1) < 0.5 * SPACING
    away = np.flatnonzero(inside(both) & (np.abs(both.means[:, 0]) > 8 * SPACING))
    assert both.surroundings[away, 0].mean() == pytest.approx(OVERLAP, rel=0.08)
    assert both.surroundings[corner, 0].max() < 1.5 * OVERLAP


def with_twin(ground: Gaussians, **changed: np.ndarray) -> Gaussians:
    """The ground, and the same once more but for some arrays, half a cell aside."""
    twin = replace(ground, means=ground.means + np.float32([SPACING / 2, SPACING / 2, 0]))
    twin = replace(twin, **changed)
    names = ("means", "quats_wxyz", "scales", "opacities", "sh", "normals", "class_id")
    joined = {name: np.concatenate((getattr(ground, name), getattr(twin, name))) for name in names}
    return add_surroundings(replace(ground, **joined))


def test_a_surface_parallel_to_it_is_another():
    ground = make_floor()
    above = with_twin(ground, means=ground.means + np.float32([0, 0, SPACING]))
    mixed = with_twin(ground)
    here = inside(above)
    assert above.surroundings[here, 0].mean() == pytest.approx(OVERLAP, rel=0.12)
    assert mixed.surroundings[here, 0].mean() == pytest.approx(2 * OVERLAP, rel=0.12)


def test_discs_that_stand_on_a_surface_are_not_of_it():
    ground = make_floor()
    upright = with_twin(ground, normals=ground.normals[:, [2, 1, 0]].copy())
    lying = np.flatnonzero(inside(ground))
    assert upright.surroundings[lying, 0].mean() == pytest.approx(OVERLAP, rel=0.12)


def test_grit_among_larger_discs_knows_that_they_are_larger():
    ground = make_floor()
    scales = ground.scales.copy()
    grit = len(ground) // 2
    scales[grit, :2] = SIZE / 5
    ground = add_surroundings(replace(ground, scales=scales))
    assert ground.surroundings[grit, 1] == pytest.approx(5, rel=0.01)


def test_size_of_the_scene_does_not_matter():
    ground = make_floor(scatter=True)
    large = replace(ground, means=8 * ground.means, scales=8 * ground.scales)
    a, b = add_surroundings(ground), add_surroundings(large)
    assert a.surroundings == pytest.approx(b.surroundings, rel=1e-5)


def test_one_gaussian_has_no_neighbours():
    assert add_surroundings(make_cloud((0, 0, 1))).surroundings.tolist() == [[0, 1]]


def test_points_at_one_place_have_a_finite_overlap():
    heap = make_floor()
    heap = add_surroundings(replace(heap, means=np.zeros_like(heap.means)))
    assert (heap.surroundings[:, 0] == OPAQUE).all()


def test_surroundings_without_antialiasing_are_refused():
    ground = add_surroundings(make_floor())
    with pytest.raises(InputError, match="surroundings are counted for antialiased Gaussians; these are not"):
        check_gaussians(replace(ground, antialiased=False))


def test_surroundings_out_of_range_are_named():
    ground = add_surroundings(make_floor())
    with pytest.raises(InputError, match=r"surroundings must have shape \(1681, 2\)"):
        check_gaussians(replace(ground, surroundings=ground.surroundings[:5]))
    for wrong in ([-1, 1], [1, -1], [1, 0]):
        about = ground.surroundings * np.float32(wrong)
        with pytest.raises(
            InputError, match="surroundings must be an overlap of 0 or more and a positive size"
        ):
            check_gaussians(replace(ground, surroundings=about))
