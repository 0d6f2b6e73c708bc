"""The derivative of blending against differences of pictures, and the refinement that rests on it."""

from dataclasses import replace

import numpy as np
import pytest

from tasks.conventions import SemanticClass
from tasks.reconstruction.adjoint import (
    ALONG_X,
    ALONG_Y,
    COLOUR,
    OPACITY,
    OPACITY_SQUARE,
    SQUARE_XX,
    WEIGHT,
    blend_and_derive,
)
from tasks.reconstruction.refinement import TrainingView, bit_reversed_order, refine_gaussians
from tasks.render.rasterise.preparation import prepare_gaussians
from tasks.render.rasterise.projection import LOG_ALPHA, RED, X, Y, project_gaussians
from tasks.render.rasterise.rasteriser import rasterise_view
from tasks.render.rasterise.view import view_of
from tasks.scene.gaussians import Gaussians
from tasks.scene.spherical_harmonics import C0

WIDTH, HEIGHT = 45, 37
K = np.array([[60.0, 0, 22.5], [0, 60, 18.5], [0, 0, 1]])
NAMES = ("means", "quats_wxyz", "scales", "opacities", "sh", "normals", "class_id")


def make_cloud(count: int = 120, seed: int = 1) -> Gaussians:
    """Gaussians in front of a camera at the origin that looks along +z."""
    draw = np.random.Generator(np.random.Philox(seed))
    means = draw.uniform((-1.6, -1.3, 4), (1.6, 1.3, 7), (count, 3))
    quats = draw.normal(size=(count, 4))
    return Gaussians(
        means=means.astype(np.float32),
        quats_wxyz=(quats / np.linalg.norm(quats, axis=1, keepdims=True)).astype(np.float32),
        scales=draw.uniform(0.08, 0.3, (count, 3)).astype(np.float32),
        opacities=draw.uniform(0.2, 0.7, count).astype(np.float32),
        sh=((draw.uniform(0.1, 0.9, (count, 1, 3)) - 0.5) / C0).astype(np.float32),
        normals=np.tile(np.array([0, 0, -1], np.float32), (count, 1)),
        class_id=np.full(count, SemanticClass.OTHER, np.uint8),
    )


def records_of(gaussians: Gaussians) -> np.ndarray:
    return project_gaussians(prepare_gaussians(gaussians), view_of(np.eye(4), K, WIDTH, HEIGHT))[0].copy()


def make_backdrop(seed: int) -> np.ndarray:
    draw = np.random.Generator(np.random.Philox(seed))
    return draw.uniform(0, 1, (HEIGHT, WIDTH, 3)).astype(np.float32)


ONES = np.ones((HEIGHT, WIDTH), np.float32)


def test_the_blended_picture_is_the_rasterisers() -> None:
    gaussians, sky = make_cloud(), make_backdrop(2)
    picture, _ = blend_and_derive(records_of(gaussians), sky, ONES, sky)
    gbuffer = rasterise_view(prepare_gaussians(gaussians), np.eye(4), K, WIDTH, HEIGHT)
    np.testing.assert_allclose(picture[..., 3], 1 - gbuffer.alpha, atol=2e-5)
    np.testing.assert_allclose(
        picture[..., :3], gbuffer.rgb + (1 - gbuffer.alpha)[..., None] * sky, atol=2e-5
    )


@pytest.mark.parametrize(
    ("column", "of", "step"),
    [(RED, COLOUR, 1e-2), (LOG_ALPHA, OPACITY, 3e-3), (X, ALONG_X, 3e-3), (Y, ALONG_Y, 3e-3)],
)
def test_derivatives_are_those_of_the_picture(column: int, of: int, step: float) -> None:
    """Half the squared error falls by the derivative times residual, per unit of each quantity."""
    records, sky, target, weight = (
        records_of(make_cloud()),
        make_backdrop(2),
        make_backdrop(3),
        make_backdrop(4)[..., 0].copy(),
    )

    def loss(changed: np.ndarray) -> float:
        picture, _ = blend_and_derive(changed, target, weight, sky)
        return float((weight[..., None] * (picture[..., :3].astype(np.float64) - target) ** 2).sum() / 2)

    _, sums = blend_and_derive(records, target, weight, sky)
    slopes = []
    for i in range(len(records)):
        up, down = records.copy(), records.copy()
        up[i, column] += step
        down[i, column] -= step
        slopes.append((loss(down) - loss(up)) / (2 * step))
    # a splat is cut off where it is faint; where its rim crosses a pixel's centre the difference jumps
    assert np.isclose(sums[:, of], slopes, rtol=0.02, atol=2e-3).mean() > 0.9


def test_squares_of_derivatives_are_those_of_a_single_splat() -> None:
    gaussians = make_cloud(1)
    records, sky = records_of(gaussians), np.zeros((HEIGHT, WIDTH, 3), np.float32)
    _, sums = blend_and_derive(records, sky, ONES, sky)
    for column, of in ((LOG_ALPHA, OPACITY_SQUARE), (X, SQUARE_XX)):
        up, down = records.copy(), records.copy()
        up[0, column] += 0.01
        down[0, column] -= 0.01
        slope = (blend_and_derive(up, sky, ONES, sky)[0] - blend_and_derive(down, sky, ONES, sky)[0])[
            ..., :3
        ] / 0.02
        assert sums[0, of] == pytest.approx((slope.astype(np.float64) ** 2).sum(), rel=0.02)


def test_a_pixel_at_the_ceiling_is_matched_by_anything_brighter() -> None:
    records, sky = records_of(make_cloud()), make_backdrop(2)
    picture, _ = blend_and_derive(records, sky, ONES, sky)
    _, darker = blend_and_derive(records, -np.maximum(picture[..., :3] - 0.05, 1e-4), ONES, sky)
    assert (darker[:, COLOUR : COLOUR + 3] == 0).all()
    _, brighter = blend_and_derive(records, -(picture[..., :3] + 0.05), ONES, sky)
    np.testing.assert_allclose(brighter[:, COLOUR], 0.05 * brighter[:, WEIGHT], rtol=1e-3, atol=1e-5)


def views_of(gaussians: Gaussians) -> list[TrainingView]:
    """Pictures of the cloud from three places."""
    views = []
    for shift in (-0.4, 0.0, 0.4):
        viewmat = np.eye(4)
        viewmat[0, 3] = shift
        gbuffer = rasterise_view(prepare_gaussians(gaussians), viewmat, K, WIDTH, HEIGHT)
        sky = np.full((HEIGHT, WIDTH, 3), 0.4, np.float32)
        views.append(TrainingView(
            viewmat=viewmat,
            K=K,
            radiance=gbuffer.rgb + (1 - gbuffer.alpha)[..., None] * sky,
            clipped=np.zeros((HEIGHT, WIDTH), bool),
            gain=ONES,
            sky=sky,
        ))  # fmt: skip
    return views


def error_of(gaussians: Gaussians, views: list[TrainingView]) -> float:
    total = 0.0
    for view in views:
        gbuffer = rasterise_view(prepare_gaussians(gaussians), view.viewmat, K, WIDTH, HEIGHT)
        total += float(
            ((gbuffer.rgb + (1 - gbuffer.alpha)[..., None] * view.sky - view.radiance) ** 2).mean()
        )
    return total


def disturb_cloud(gaussians: Gaussians) -> tuple[Gaussians, np.ndarray]:
    """Colours, opacities and depths that are off, and the rays along which the depths are."""
    draw = np.random.Generator(np.random.Philox(9))
    rays = gaussians.means / gaussians.means[:, 2:]
    off = draw.normal(0, 0.06, (len(gaussians), 1)) * rays
    return replace(
        gaussians,
        means=(gaussians.means + off).astype(np.float32),
        opacities=np.clip(gaussians.opacities * draw.uniform(0.6, 1.6, len(gaussians)), 0.05, 0.95).astype(
            np.float32
        ),
        sh=(gaussians.sh + draw.normal(0, 0.4, gaussians.sh.shape)).astype(np.float32),
    ), rays


def test_refinement_brings_the_pictures_back() -> None:
    true = make_cloud()
    views = views_of(true)
    start, rays = disturb_cloud(true)
    better = refine_gaussians(start, rays, lambda n: views[n], len(views), 12)
    assert error_of(better, views) < 0.05 * error_of(start, views)


def test_refinement_moves_along_the_rays_only_and_leaves_road_where_it_is() -> None:
    true = replace(
        make_cloud(),
        class_id=np.where(np.arange(120) < 60, SemanticClass.ROAD, SemanticClass.OTHER).astype(np.uint8),
    )
    views = views_of(true)
    start, rays = disturb_cloud(true)
    better = refine_gaussians(start, rays, lambda n: views[n], len(views), 3)
    assert len(better) == len(start)
    np.testing.assert_allclose(better.means[:60], start.means[:60], atol=1e-6)
    np.testing.assert_allclose(better.opacities[:60], start.opacities[:60], rtol=1e-5)
    assert not np.allclose(better.sh[:60], start.sh[:60], atol=1e-3)
    moved = better.means[60:] - start.means[60:]
    assert np.abs(moved).max() > 1e-3
    np.testing.assert_allclose(np.cross(moved, rays[60:]), 0, atol=1e-5)
    for name in ("quats_wxyz", "scales", "normals", "class_id"):
        np.testing.assert_array_equal(getattr(better, name), getattr(start, name))


def test_what_should_not_be_there_fades_away() -> None:
    """A floater of the right colour for no picture loses its opacity, and is dropped in the end."""
    true = make_cloud()
    views = views_of(true)
    floater = replace(
        make_cloud(1, seed=5),
        means=np.array([[0.1, 0.1, 2.5]], np.float32),
        opacities=np.array([0.6], np.float32),
    )
    both = Gaussians(
        **{name: np.concatenate([getattr(true, name), getattr(floater, name)]) for name in NAMES}
    )
    refined = refine_gaussians(both, both.means / both.means[:, 2:], lambda n: views[n], len(views), 10)
    assert len(refined) == len(true) or refined.opacities[-1] < 0.15


def test_the_order_of_pictures_visits_each_once_and_jumps() -> None:
    for count in (1, 2, 5, 44):
        assert sorted(bit_reversed_order(count)) == list(range(count))
    assert bit_reversed_order(8) == [0, 4, 2, 6, 1, 5, 3, 7]
