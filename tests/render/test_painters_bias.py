"""The painter's bias: how far the order of blending moves a surface's picture, and that it is taken back."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from tasks.render.rasterise.painters_bias import LARGEST_SHIFT, MOST_OVERLAP, interpolate_shift, shift_terms
from tasks.render.rasterise.painters_bias_torch import means_nearer
from tasks.render.rasterise.projection import ANTIALIASED_LOW_PASS, X, Y, project_gaussians
from tasks.render.rasterise.rasteriser import prepare_gaussians, rasterise_view
from tasks.render.rasterise.reference_rasteriser import rasterise_reference
from tasks.render.rasterise.view import view_of
from tasks.scene.gaussians import Gaussians
from tasks.scene.surroundings import add_surroundings
from tests.render.clouds import HEIGHT, WIDTH, K, make_cloud, random_cloud
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


def test_centres_for_a_gpu_project_where_the_kernel_puts_the_splats():
    level = surround_cloud(random_cloud(600))
    prepared, view = prepare_gaussians(level), view_of(AHEAD, K, WIDTH, HEIGHT)
    records, slots = project_gaussians(prepared, view)
    arrays = (level.means, level.quats_wxyz, level.scales, level.normals, level.surroundings)
    moved = means_nearer(*(torch.from_numpy(array) for array in arrays), view, ANTIALIASED_LOW_PASS).numpy()
    assert np.array_equal(moved[:, 2], level.means[:, 2])
    x, y, z = moved[prepared.order[slots]].T
    assert len(slots) > 20
    assert np.abs(K[0, 0] * x / z + K[0, 2] - records[:, X]).max() < 2e-3
    assert np.abs(K[1, 1] * y / z + K[1, 2] - records[:, Y]).max() < 2e-3


def test_centres_in_the_camera_s_plane_stay_on_a_gpu():
    level = surround_cloud(random_cloud(50))
    means = level.means.copy()
    means[::3, 2] = 0.0
    arrays = (means, level.quats_wxyz, level.scales, level.normals, level.surroundings)
    view = view_of(AHEAD, K, WIDTH, HEIGHT)
    moved = means_nearer(*(torch.from_numpy(array) for array in arrays), view, ANTIALIASED_LOW_PASS).numpy()
    assert np.isfinite(moved).all()
    assert np.array_equal(moved[::3], means[::3])


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
