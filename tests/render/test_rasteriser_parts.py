"""The stages of the rasteriser, each by itself: harmonics, exponential, order, culling, tiles, transpose."""

from dataclasses import replace

import numba
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import sph_harm_y

from tasks.errors import InputError
from tasks.render.rasterise.binning import TILE_HEIGHT, TILE_WIDTH, depth_order, tile_lists
from tasks.render.rasterise.preparation import BLOCK, SH, morton_order, prepare_gaussians
from tasks.render.rasterise.projection import (
    COLUMN_FALLOFF,
    DEPTH,
    LOG_ALPHA,
    LOG_CUT,
    ROW_FALLOFF,
    SLOPE,
    X,
    Y,
    project_gaussians,
)
from tasks.render.rasterise.rasteriser import rasterise_view, splat_back
from tasks.render.rasterise.reference_rasteriser import blend_steps
from tasks.render.rasterise.shading import shade_lanes
from tasks.render.rasterise.strips import absorb_light
from tasks.render.rasterise.view import view_of
from tasks.scene.spherical_harmonics import sh_basis
from tests.render.clouds import HEIGHT, WIDTH, K, camera_at, random_cloud, rotation_matrix


def test_sh_basis_is_scipys_real_harmonics_with_the_condon_shortley_sign() -> None:
    v = np.random.default_rng(0).standard_normal((50, 3))
    v /= np.linalg.norm(v, axis=1, keepdims=True)
    polar, azimuth = np.arccos(v[:, 2]), np.arctan2(v[:, 1], v[:, 0])
    wanted = []
    for degree in range(4):
        for order in range(-degree, degree + 1):
            y = sph_harm_y(degree, abs(order), polar, azimuth)
            part = y.imag if order < 0 else y.real
            wanted.append(part * (np.sqrt(2) if order else 1))
    np.testing.assert_allclose(sh_basis(v, 16), np.column_stack(wanted), atol=1e-12)


@pytest.mark.parametrize("count", [1, 4, 9, 16])
def test_a_block_is_shaded_by_the_harmonics_it_has_and_no_more(count: int) -> None:
    rng = np.random.default_rng(count)
    v = rng.normal(size=(BLOCK, 3))
    v /= np.linalg.norm(v, axis=1, keepdims=True)
    planes = np.full((SH + 3 * 16, BLOCK), 1e3, np.float32)  # what lies behind the block must not be read
    sh = rng.normal(size=(count, 3, BLOCK)).astype(np.float32)
    planes[SH : SH + 3 * count] = sh.reshape(-1, BLOCK)
    colours = np.empty(3 * BLOCK, np.float32)
    shade_lanes(v.T.astype(np.float32).ravel(), planes[: SH + 3 * count], colours)
    wanted = np.maximum(np.einsum("kcl,lk->cl", sh, sh_basis(v, count)) + 0.5, 0)
    np.testing.assert_allclose(colours.reshape(3, BLOCK), wanted, atol=2e-6)


def test_polynomial_exponential_keeps_its_stated_error() -> None:
    @numba.njit
    def weights(p: np.ndarray, out: np.ndarray) -> None:
        for i in range(len(p)):
            out[i] = absorb_light(p[i], np.float32(1))[0]

    p = np.linspace(LOG_CUT, np.log(0.998), 200_001).astype(np.float32)[1:]
    got = np.empty_like(p)
    weights(p, got)
    exact = np.exp(p.astype(np.float64))
    assert np.abs(got / exact - 1).max() < 4e-6
    weights(np.float32((LOG_CUT - 1e-5, -100.0, 0.0)), got)
    assert got[:3].tolist() == [0, 0, np.float32(0.999)]


@settings(max_examples=50)
@given(st.lists(st.floats(0.0625, 1e6, width=32), max_size=60))
def test_depths_sort_stably(depths: list[float]) -> None:
    keys = np.array(depths, dtype=np.float32)
    assert depth_order(keys.view(np.uint32)).tolist() == np.argsort(keys, kind="stable").tolist()


def test_morton_neighbours_are_near_and_equal_points_keep_their_order() -> None:
    points = np.random.default_rng(1).uniform(0, 10, (5000, 3))
    order = morton_order(points)
    assert sorted(order) == list(range(5000))
    step = np.linalg.norm(np.diff(points[order], axis=0), axis=1)
    assert np.median(step) < 0.15 * np.median(np.linalg.norm(np.diff(points, axis=0), axis=1))
    assert morton_order(np.ones((7, 3))).tolist() == list(range(7))


@pytest.mark.parametrize("seed", range(6))
def test_culling_blocks_never_loses_a_splat(seed: int) -> None:
    prepared = prepare_gaussians(random_cloud(4000, sh_count=1, seed=seed))
    viewmat = camera_at(np.random.default_rng(seed).uniform(-4, 4, 3), rotation_matrix(seed))
    view = view_of(viewmat, K, WIDTH, HEIGHT)
    everything = replace(prepared, radii=np.full_like(prepared.radii, 1e6))
    records, slots = project_gaussians(prepared, view)
    all_records, all_slots = project_gaussians(everything, view)
    assert 50 < len(slots) < len(prepared)
    assert np.array_equal(slots, all_slots) and np.array_equal(records, all_records)


def test_tile_lists_hold_every_splat_where_it_is_drawn_nearest_first() -> None:
    prepared = prepare_gaussians(random_cloud(600, sh_count=1))
    records, _ = project_gaussians(prepared, view_of(np.eye(4), K, WIDTH, HEIGHT))
    starts, splats = tile_lists(records, WIDTH, HEIGHT)
    y, x = np.mgrid[:HEIGHT, :WIDTH] + 0.5
    across = -(-WIDTH // TILE_WIDTH)
    listed = 0
    for tile in range(len(starts) - 1):
        mine = splats[starts[tile] : starts[tile + 1]]
        assert (np.diff(records[mine, DEPTH]) >= 0).all()
        rows = slice(tile // across * TILE_HEIGHT, (tile // across + 1) * TILE_HEIGHT)
        columns = slice(tile % across * TILE_WIDTH, (tile % across + 1) * TILE_WIDTH)
        for splat, r in enumerate(records.astype(np.float64)):
            dy = y[rows, columns] - r[Y]
            dx = x[rows, columns] - r[X] - r[SLOPE] * dy
            drawn = r[LOG_ALPHA] - r[ROW_FALLOFF] * dy**2 - r[COLUMN_FALLOFF] * dx**2 >= LOG_CUT + 1e-4
            if drawn.any():
                assert splat in mine
                listed += 1
    assert listed > 0.9 * len(splats)  # the splats' boxes alone would list a fifth too many


def test_splat_back_sums_the_weights_that_blending_gave() -> None:
    gaussians = random_cloud(2000, sh_count=1, seed=4)
    residual = np.random.default_rng(0).standard_normal((HEIGHT, WIDTH, 5))
    numerator, weight = splat_back(prepare_gaussians(gaussians), np.eye(4), K, WIDTH, HEIGHT, residual)
    wanted_numerator, wanted_weight = np.zeros((2000, 5)), np.zeros(2000)
    for step in blend_steps(gaussians, np.eye(4), K, WIDTH, HEIGHT):
        wanted_weight[step.gaussian] = step.weight.sum()
        wanted_numerator[step.gaussian] = np.einsum("hw,hwc->c", step.weight, residual[step.window])
    assert (wanted_weight > 0).sum() > 100
    np.testing.assert_allclose(weight, wanted_weight, atol=2e-3, rtol=1e-4)
    np.testing.assert_allclose(numerator, wanted_numerator, atol=2e-2, rtol=1e-4)


def test_splat_back_is_the_adjoint_of_blending() -> None:
    """For any picture r: the blended picture times r is the colours times r splatted back."""
    gaussians = random_cloud(900, sh_count=1, seed=6)
    prepared = prepare_gaussians(gaussians)
    residual = np.random.default_rng(1).uniform(0, 1, (HEIGHT, WIDTH, 3)).astype(np.float32)
    numerator, weight = splat_back(prepared, np.eye(4), K, WIDTH, HEIGHT, residual)
    got = rasterise_view(prepared, np.eye(4), K, WIDTH, HEIGHT)
    colours = np.maximum(gaussians.sh[:, 0].astype(np.float64) * sh_basis(np.eye(3)[0], 1) + 0.5, 0)
    assert (colours * numerator).sum() == pytest.approx(
        (got.rgb.astype(np.float64) * residual).sum(), rel=1e-5
    )
    assert weight.sum() == pytest.approx(got.alpha.astype(np.float64).sum(), rel=1e-5)


def test_splat_back_refuses_a_residual_of_another_size() -> None:
    with pytest.raises(InputError, match=r"residual must have shape \(52, 72, channels\); it has \(3, 4\)"):
        splat_back(prepare_gaussians(random_cloud(3)), np.eye(4), K, WIDTH, HEIGHT, np.zeros((3, 4)))
