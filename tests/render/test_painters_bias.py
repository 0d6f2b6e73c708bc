"""The painter's bias: how far the order of blending moves a surface's picture, and that it is taken back."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from numpy.typing import NDArray

from tasks.render.rasterise.painters_bias import LARGEST_SHIFT, MOST_OVERLAP, interpolate_shift, shift_terms
from tasks.render.rasterise.painters_bias_torch import move_nearer
from tasks.render.rasterise.projection import (
    ANTIALIASED_LOW_PASS,
    COLUMN_FALLOFF,
    ROW_FALLOFF,
    SLOPE,
    X,
    Y,
    project_gaussians,
)
from tasks.render.rasterise.rasteriser import prepare_gaussians, rasterise_view
from tasks.render.rasterise.reference_rasteriser import rasterise_reference
from tasks.render.rasterise.view import View, view_of
from tasks.scene.gaussians import Gaussians
from tasks.scene.surroundings import add_surroundings
from tests.render.clouds import HEIGHT, WIDTH, K, camera_at, make_cloud, random_cloud, rotation_matrix
from tests.render.striped_road import crossing_row, striped_road, true_row

AHEAD = np.eye(4)


def surround_cloud(gaussians: Gaussians, seed: int = 3) -> Gaussians:
    """With surroundings of every kind."""
    rng = np.random.default_rng(seed)
    n = len(gaussians)
    about = np.column_stack((rng.uniform(0, 8, n), np.exp(rng.normal(0, 0.7, n))))
    return replace(gaussians, surroundings=about.astype(np.float32), antialiased=True)


def drawn_lead(overlap: float, ratio: float, count: int = 4000) -> float:
    """Lead of one disc of size `ratio` among random neighbours of size 1, painted one after the other [1].

    The neighbours are faint, so that many make up the overlap, and lie on a line along which they come nearer.
    """
    rng = np.random.default_rng(7)
    t = np.linspace(-7, 7, 701) * ratio
    picture = np.zeros_like(t)
    for _ in range(40):
        place = rng.uniform(-12, 12, count)
        opacity = overlap * 24 / count / np.sqrt(2 * np.pi)
        nearer = place[place > 0]
        passed = (1 - opacity * np.exp(-((t[:, None] - nearer) ** 2) / 2)).prod(axis=1)
        picture += np.exp(-((t / ratio) ** 2) / 2) * passed
    return float(-(picture * t).sum() / picture.sum() / ratio)


@pytest.mark.parametrize(("overlap", "ratio"), [(0.5, 1.0), (3.5, 1.0), (6.0, 1.0), (3.5, 0.3), (3.5, 2.0)])
def test_the_lead_is_what_painting_random_discs_nearest_first_takes_away(overlap, ratio):
    assert shift_terms(overlap, ratio)[0] == pytest.approx(drawn_lead(overlap, ratio), abs=0.012)


def test_a_disc_without_neighbours_has_no_lead_but_for_perspective():
    assert shift_terms(0.0, 1.0) == pytest.approx((0.0, 1.0), abs=1e-9)


@pytest.mark.parametrize("overlap", [0.0, 0.3, 2.0, 4.4, 11.0, MOST_OVERLAP, 1e6])
@pytest.mark.parametrize("ratio", [0.05, 0.4, 1.0, 1.7, 20.0])
def test_the_table_holds_the_integrals_to_a_hundredth_of_a_standard_deviation(overlap, ratio):
    first, second = shift_terms(min(overlap, MOST_OVERLAP), ratio)
    got = interpolate_shift(np.float32(overlap), np.float32(ratio), np.float32(0.05))
    assert got == pytest.approx(min(first + 0.05 * second, LARGEST_SHIFT), abs=0.02)


def on_road(road: Gaussians, advance: float) -> float:
    """How far beyond its place the crossing is drawn [m]."""
    distance = 18.5 - advance
    return (true_row(advance) - crossing_row(road, advance)) * distance**2 / (400 * 1.4)


def test_a_level_road_of_discs_stays_while_the_camera_comes_closer():
    """From 18 m away to 8 m, lattice or scatter: within a centimetre, where the order of blending takes ten."""
    road, ways = striped_road(), (0.0, 5.0, 10.0)
    jitter = np.random.default_rng(1).uniform(-0.02, 0.02, (len(road), 3)) * (1, 1, 0)
    scattered = replace(road, means=(road.means + jitter).astype(np.float32))
    for discs in (road, scattered):
        level = [on_road(add_surroundings(discs), way) for way in ways]
        biased = [on_road(discs, way) for way in ways]
        assert np.ptp(level) < 0.01 < 0.08 < np.ptp(biased)
        assert np.abs(level).max() < 0.02


def test_the_kernel_draws_what_the_reference_integrates():
    level = surround_cloud(random_cloud(600))
    got = rasterise_view(prepare_gaussians(level), AHEAD, K, WIDTH, HEIGHT)
    wanted = rasterise_reference(level, AHEAD, K, WIDTH, HEIGHT)
    plain = rasterise_view(prepare_gaussians(replace(level, surroundings=None)), AHEAD, K, WIDTH, HEIGHT)
    assert np.abs(got.rgb - wanted.rgb).max() < 2e-3
    assert np.abs(got.rgb - plain.rgb).max() > 0.1


def move_on_gpu(level: Gaussians, view: View) -> list[NDArray[np.float64]]:
    """Centres and covariances as a GPU's rasteriser takes them."""
    arrays = (level.means, level.quats_wxyz, level.scales, level.normals, level.surroundings)
    moved = move_nearer(*(torch.from_numpy(array) for array in arrays), view, ANTIALIASED_LOW_PASS)
    return [tensor.numpy().astype(np.float64) for tensor in moved]


@pytest.mark.parametrize("turn", [0, 2])
def test_gaussians_for_a_gpu_project_to_the_kernel_s_splats(turn):
    """Zwicker et al. (2001), doi:10.1109/VISUAL.2001.964490: the covariance by the derivative of the projection."""
    level = surround_cloud(random_cloud(600))
    viewmat = camera_at((0.1, 0.2, 0.0), rotation_matrix(turn)) if turn else AHEAD
    prepared, view = prepare_gaussians(level), view_of(viewmat, K, WIDTH, HEIGHT)
    records, slots = project_gaussians(prepared, view)
    centres, covariances = (array[prepared.order[slots]] for array in move_on_gpu(level, view))
    assert len(slots) > 20
    R, focal = viewmat[:3, :3], np.diag(K)[:2]
    in_camera = centres @ R.T + viewmat[:3, 3]
    ray = in_camera[:, :2] / in_camera[:, 2:]
    assert np.abs(focal * ray + K[:2, 2] - records[:, [X, Y]]).max() < 2e-3
    limits = view.ray_limits.reshape(2, 2)
    derivative = np.zeros((len(slots), 2, 3))
    derivative[:, [0, 1], [0, 1]] = focal / in_camera[:, 2:]
    derivative[:, :, 2] = -np.clip(ray, *limits.T) * focal / in_camera[:, 2:]
    blur = ANTIALIASED_LOW_PASS * np.eye(2)
    got = derivative @ R @ covariances @ R.T @ derivative.transpose(0, 2, 1) + blur
    down = 0.5 / records[:, ROW_FALLOFF]
    skew = records[:, SLOPE] * down
    across = 0.5 / records[:, COLUMN_FALLOFF] + skew**2 / down
    wanted = np.array([[across, skew], [skew, down]]).transpose(2, 0, 1)
    assert np.abs(got - wanted).max() / wanted.max() < 1e-4
    assert np.abs(got / wanted - 1)[np.abs(wanted) > 1.0].max() < 1e-2


def test_centres_in_the_camera_s_plane_stay_on_a_gpu():
    level = surround_cloud(random_cloud(50))
    means = level.means.copy()
    means[::3, 2] = 0.0
    centres, covariances = move_on_gpu(replace(level, means=means), view_of(AHEAD, K, WIDTH, HEIGHT))
    assert np.isfinite(centres).all() and np.isfinite(covariances).all()
    assert np.array_equal(centres[::3], means[::3])


def test_a_cloud_without_surroundings_is_drawn_as_its_trainer_drew_it():
    plain = random_cloud(200)
    prepared = prepare_gaussians(plain)
    records, slots = project_gaussians(prepared, view_of(AHEAD, K, WIDTH, HEIGHT))
    x, y, z = plain.means[prepared.order[slots]].T
    assert np.abs(K[0, 0] * x / z + K[0, 2] - records[:, X]).max() < 1e-3
    assert np.abs(K[1, 1] * y / z + K[1, 2] - records[:, Y]).max() < 1e-3


def test_a_disc_that_faces_the_camera_stays():
    facing = make_cloud((0.1, 0.2, 5.0), scales=(0.3, 0.3, 1e-3), normals=(0, 0, -1))
    level = replace(facing, surroundings=np.array([[4.0, 1.0]], np.float32), antialiased=True)
    (record,), _ = project_gaussians(prepare_gaussians(level), view_of(AHEAD, K, WIDTH, HEIGHT))
    assert record[[X, Y]] == pytest.approx(K[:2, :2] @ (0.02, 0.04) + K[:2, 2], abs=1e-4)


def test_a_disc_that_its_lead_brings_into_the_picture_is_not_culled_with_its_block():
    """Balls beyond the left edge, on a surface that comes nearer to the right, one at a time."""
    drawn = 0
    for x in np.linspace(-2.2, -1.0, 25):
        ball = make_cloud((x, 0.0, 2.0), scales=0.1, opacities=0.9, normals=(0.6, 0, 0.8))
        level = replace(ball, surroundings=np.array([[20.0, 1.0]], np.float32), antialiased=True)
        got = rasterise_view(prepare_gaussians(level), AHEAD, K, WIDTH, HEIGHT).alpha
        assert np.abs(got - rasterise_reference(level, AHEAD, K, WIDTH, HEIGHT).alpha).max() < 5e-3
        drawn += bool(got.any())
    assert 5 < drawn < 25
