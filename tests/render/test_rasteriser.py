"""The CPU rasteriser against its NumPy twin, against closed forms, and against what must not change it."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import fields, replace

import numpy as np
import pytest
from numpy.typing import NDArray

from tasks.conventions import SemanticClass
from tasks.errors import InputError
from tasks.render.rasterise.gbuffer import GBuffer
from tasks.render.rasterise.projection import project_gaussians
from tasks.render.rasterise.rasteriser import prepare_gaussians, rasterise_view
from tasks.render.rasterise.reference_rasteriser import blend_steps, rasterise_reference
from tasks.render.rasterise.view import view_of
from tasks.scene.gaussians import Gaussians
from tests.render.clouds import HEIGHT, WIDTH, K, camera_at, make_cloud, random_cloud, rotation_matrix

AHEAD = np.eye(4)


def draw_cloud(gaussians: Gaussians, viewmat: NDArray[np.float64] = AHEAD) -> GBuffer:
    return rasterise_view(prepare_gaussians(gaussians), viewmat, K, WIDTH, HEIGHT)


def all_bytes(gbuffer: GBuffer) -> list[bytes]:
    return [getattr(gbuffer, field.name).tobytes() for field in fields(gbuffer)]


def rms(a: NDArray[np.float32], b: NDArray[np.float32]) -> float:
    """Root mean square difference, in the unit of both."""
    return float(np.sqrt(np.mean((a.astype(np.float64) - b) ** 2)))


@pytest.mark.parametrize("antialiased", [False, True])
@pytest.mark.parametrize(("sh_count", "seed"), [(1, 0), (4, 1), (9, 2), (16, 3)])
def test_picture_equals_the_numpy_twin(sh_count: int, seed: int, antialiased: bool) -> None:
    gaussians = replace(random_cloud(1500, sh_count, seed), antialiased=antialiased)
    viewmat = camera_at((0.4, -0.2, 0.1), rotation_matrix(seed))
    got, wanted = draw_cloud(gaussians, viewmat), rasterise_reference(gaussians, viewmat, K, WIDTH, HEIGHT)
    covered = wanted.alpha > 0
    assert covered.mean() > 0.5 and wanted.alpha.max() > 0.95
    assert rms(got.rgb, wanted.rgb) < 1.0e-4
    assert rms(got.alpha, wanted.alpha) < 1.0e-4
    for name in ("depth", "expected_depth"):
        assert np.array_equal(np.isnan(getattr(got, name)), ~covered)
    assert rms(got.expected_depth[covered], wanted.expected_depth[covered]) < 1.0e-3
    assert rms(got.normal, wanted.normal) < 1.0e-4
    tie = np.zeros((HEIGHT, WIDTH), dtype=bool)
    for step in blend_steps(gaussians, viewmat, K, WIDTH, HEIGHT):
        for light in (step.transmittance, step.transmittance - step.weight):
            tie[step.window] |= np.abs(light - 0.5) < 1e-5
    assert np.array_equal(got.class_id[~tie], wanted.class_id[~tie])
    # a plane that is just tilted enough to count in one precision may not be in the other
    clear = covered & ~tie
    assert np.mean(np.abs(got.depth / wanted.depth - 1)[clear] < 1e-4) > 0.999
    assert tie.mean() < 0.01


def test_one_gaussian_is_the_closed_form_of_its_projection() -> None:
    """The picture covariance is that of the pinhole's derivative, taken here by differences, plus 0.3 px^2."""
    mean, scales, opacity = np.array((0.7, -0.4, 3.0)), np.array((0.30, 0.10, 0.02)), 0.8
    half_angle = 0.35
    quat = np.array((np.cos(half_angle), *(np.sin(half_angle) * np.array((0.6, 0.0, 0.8)))))
    axis, angle = np.array((0.6, 0.0, 0.8)), 2 * half_angle
    cross = np.array(((0, -axis[2], axis[1]), (axis[2], 0, -axis[0]), (-axis[1], axis[0], 0)))
    turn = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    covariance = turn @ np.diag(scales**2) @ turn.T

    def pinhole(p: NDArray[np.float64]) -> NDArray[np.float64]:
        return K[:2, :2] @ p[:2] / p[2] + K[:2, 2]

    step = 1e-5 * np.eye(3)
    J = np.column_stack([(pinhole(mean + d) - pinhole(mean - d)) / 2e-5 for d in step])
    inverse = np.linalg.inv(J @ covariance @ J.T + 0.3 * np.eye(2))
    y, x = np.mgrid[:HEIGHT, :WIDTH] + 0.5
    d = np.stack((x, y), axis=-1) - pinhole(mean)
    alpha = opacity * np.exp(-0.5 * np.einsum("hwi,ij,hwj->hw", d, inverse, d))
    clear_cut = np.abs(alpha - 1 / 255) > 1e-5
    alpha[alpha < 1 / 255] = 0

    got = draw_cloud(make_cloud(mean, scales, opacity, quat, colours=(0.2, 0.5, 0.9)))
    assert alpha.max() > 0.7 and (alpha > 0).sum() > 100
    assert np.abs(got.alpha - alpha)[clear_cut].max() < 2e-5
    np.testing.assert_allclose(got.rgb, got.alpha[..., None] * (0.2, 0.5, 0.9), atol=1e-6)
    np.testing.assert_allclose(got.depth[got.alpha > 0], 3.0, rtol=1e-6)


def test_picture_axes_are_right_and_down() -> None:
    got = draw_cloud(make_cloud([(1.0, 0, 4), (0, 1.0, 4)], colours=[(1, 0, 0), (0, 1, 0)]))
    red, green = (np.unravel_index(got.rgb[..., c].argmax(), (HEIGHT, WIDTH)) for c in (0, 1))
    assert red == (int(26.9), int(35.2 + 60 / 4))
    assert green == (int(26.9 + 58 / 4), int(35.2))


def test_opacities_multiply_as_transmittances() -> None:
    opacities = np.array((0.3, 0.05, 0.6, 0.2, 0.7))
    means = [(0, 0, 2.0 + i) for i in range(5)]
    scales = [(2.0 + i, 2.0 + i, 0.1) for i in range(5)]
    got = draw_cloud(make_cloud(means, scales, opacities))
    centre = got.alpha[26, 35]
    assert centre == pytest.approx(1 - np.prod(1 - opacities), abs=1e-4)


def test_opacity_stays_between_zero_and_one() -> None:
    got = draw_cloud(replace(random_cloud(3000, 1), opacities=np.ones(3000, dtype=np.float32)))
    assert got.alpha.min() >= 0 and got.alpha.max() <= 1
    assert got.alpha.max() > 0.9998  # closed pixels


def test_a_pixel_closes_before_the_gaussian_that_would_leave_it_no_light() -> None:
    """Behind 0.999 a second 0.999 would leave 1e-6: it is not drawn, and nothing behind it either."""
    means, wide = [(0, 0, 2.0), (0, 0, 3.0), (0, 0, 4.0)], (9.0, 9.0, 0.1)
    got = draw_cloud(make_cloud(means, wide, (1.0, 1.0, 0.5), colours=np.eye(3)))
    assert got.rgb[26, 35] == pytest.approx((0.999, 0, 0), abs=1e-6)
    thinner = draw_cloud(make_cloud(means, wide, (1.0, 0.5, 0.5), colours=np.eye(3)))
    assert thinner.rgb[26, 35] == pytest.approx((0.999, 0.0005, 0.00025), abs=2e-6)


def test_an_opaque_wall_has_its_own_depth_normal_and_class() -> None:
    x, y = np.meshgrid(np.arange(-4, 4, 0.1), np.arange(-3, 3, 0.1))
    wall = make_cloud(
        np.column_stack((x.ravel(), y.ravel(), np.full(x.size, 5.0))),
        scales=(0.1, 0.1, 1e-4),
        opacities=1.0,
        normals=(0, 0, 1),
        class_id=SemanticClass.BUILDING,
    )
    got = draw_cloud(wall)
    np.testing.assert_allclose(got.depth, 5.0, rtol=1e-6)
    assert got.alpha.min() > 0.95
    np.testing.assert_allclose(got.normal, np.broadcast_to((0, 0, -1), got.normal.shape), atol=1e-6)
    assert (got.class_id == SemanticClass.BUILDING).all()


def test_class_is_that_of_the_gaussian_at_half_transmittance() -> None:
    means, wide = [(0, 0, 2.0), (0, 0, 3.0), (0, 0, 4.0)], (9.0, 9.0, 0.1)
    labels = [SemanticClass.VEHICLE, SemanticClass.ROAD, SemanticClass.BUILDING]
    for opacities, label in (
        ((0.3, 0.2, 0.9), SemanticClass.BUILDING),
        ((0.3, 0.4, 0.9), SemanticClass.ROAD),
        ((0.6, 0.4, 0.9), SemanticClass.VEHICLE),
        ((0.2, 0.2, 0.2), SemanticClass.SKY),
    ):
        got = draw_cloud(make_cloud(means, wide, opacities, class_id=labels))
        assert got.class_id[26, 35] == label, opacities


def test_order_of_the_cloud_does_not_change_a_bit() -> None:
    gaussians = random_cloud(2000)
    shuffle = np.random.default_rng(5).permutation(len(gaussians))
    arrays = ("means", "quats_wxyz", "scales", "opacities", "sh", "normals", "class_id")
    shuffled = replace(gaussians, **{name: getattr(gaussians, name)[shuffle] for name in arrays})
    assert all_bytes(draw_cloud(shuffled)) == all_bytes(draw_cloud(gaussians))


def test_threads_do_not_change_a_bit() -> None:
    prepared = prepare_gaussians(random_cloud(2000))
    views = [camera_at((0, 0, 0), rotation_matrix(seed)) for seed in range(4)]
    alone = [all_bytes(rasterise_view(prepared, view, K, WIDTH, HEIGHT)) for view in views]
    with ThreadPoolExecutor(2) as pool:
        together = list(
            pool.map(lambda view: all_bytes(rasterise_view(prepared, view, K, WIDTH, HEIGHT)), views * 3)
        )
    assert together == alone * 3


def test_turning_world_and_camera_together_leaves_the_picture() -> None:
    gaussians = random_cloud(800, sh_count=1)
    R = rotation_matrix(9)
    w = np.sqrt(1 + np.trace(R)) / 2
    x, y, z = (R[2, 1] - R[1, 2]) / (4 * w), (R[0, 2] - R[2, 0]) / (4 * w), (R[1, 0] - R[0, 1]) / (4 * w)
    a, b, c, d = gaussians.quats_wxyz.T.astype(np.float64)
    quats = np.column_stack((
        w * a - x * b - y * c - z * d,
        w * b + x * a + y * d - z * c,
        w * c - x * d + y * a + z * b,
        w * d + x * c - y * b + z * a,
    ))  # fmt: skip
    shift = np.array((100.0, -40.0, 3.0))
    turned = replace(
        gaussians,
        means=(gaussians.means @ R.T + shift).astype(np.float32),
        quats_wxyz=quats.astype(np.float32),
        normals=(gaussians.normals @ R.T).astype(np.float32),
    )
    plain, moved = draw_cloud(gaussians), draw_cloud(turned, camera_at(shift, R.T))
    assert rms(moved.rgb, plain.rgb) < 3.1e-4
    assert rms(moved.normal @ R, plain.normal) < 1.0e-3
    assert np.mean(moved.class_id != plain.class_id) < 0.005


def test_normals_face_the_camera() -> None:
    got = draw_cloud(random_cloud(1500))
    y, x = np.mgrid[:HEIGHT, :WIDTH] + 0.5
    ray = np.stack(((x - K[0, 2]) / K[0, 0], (y - K[1, 2]) / K[1, 1], np.ones_like(x)), axis=-1)
    covered = got.alpha > 0
    np.testing.assert_allclose(np.linalg.norm(got.normal[covered], axis=-1), 1, atol=1e-6)
    assert not got.normal[~covered].any()
    away = (got.normal * ray).sum(axis=-1)[covered] / np.linalg.norm(ray, axis=-1)[covered]
    assert away.max() < 0.2  # a splat reaches over rays other than its centre's
    assert away.mean() < -0.4


def test_without_normals_every_other_buffer_keeps_its_bits() -> None:
    prepared = prepare_gaussians(random_cloud(800, 4, 5))
    with_normals, flat = (
        rasterise_view(prepared, np.eye(4), K, WIDTH, HEIGHT, normals=n) for n in (True, False)
    )
    assert not flat.normal.any() and with_normals.normal.any()
    for field in fields(GBuffer):
        if field.name != "normal":
            np.testing.assert_array_equal(getattr(flat, field.name), getattr(with_normals, field.name))


@pytest.mark.parametrize("place", ["nowhere", "behind", "beside", "too close", "too faint"])
def test_nothing_in_view_gives_an_empty_picture(place: str) -> None:
    gaussians = {
        "nowhere": replace(make_cloud(np.zeros((0, 3))), sh=np.zeros((0, 4, 3), np.float32)),
        "behind": make_cloud([(0, 0, -3.0), (1, 0, -0.2)]),
        "beside": make_cloud([(20.0, 0, 3.0), (0, -30.0, 3.0)]),
        "too close": make_cloud([(0, 0, 0.049), (60.0, 0, 3.0)]),
        "too faint": make_cloud([(0, 0, 3.0)], opacities=0.99 / 255),
    }[place]
    got = draw_cloud(gaussians)
    assert not got.rgb.any() and not got.alpha.any() and not got.normal.any() and not got.class_id.any()
    assert np.isnan(got.depth).all()


def test_needles_and_walls_through_the_eye_are_as_exact_as_the_rest() -> None:
    """The determinant of their picture covariance is a tiny difference of two huge products."""
    gaussians = make_cloud(
        [(0.01, 0.01, 0.06), (0.1, 0, 0.1), (0.2, 0.1, 0.5), (0, 0, 5.0)],
        scales=[(50, 1e-4, 1e-4), (40, 40, 40), (30, 1e-3, 1e-3), (1e3, 1e-6, 1e-6)],
        quats_wxyz=[(0.8, 0.6, 0, 0), (1, 0, 0, 0), (0.9, 0.1, 0.2, 0.4), (0.9, 0.1, 0.3, 0.3)],
    )
    for i in range(4):
        one = make_cloud(gaussians.means[i], gaussians.scales[i], quats_wxyz=gaussians.quats_wxyz[i])
        got, wanted = draw_cloud(one), rasterise_reference(one, AHEAD, K, WIDTH, HEIGHT)
        assert wanted.alpha.max() > 0.2
        assert np.abs(got.alpha - wanted.alpha).max() < 1e-5


def test_a_gaussian_beyond_single_precision_is_left_out() -> None:
    means, scales = [(0, 0, 3.0), (0, 0, 4.0)], [(1e18, 1e18, 1e18), (0.1, 0.1, 0.1)]
    records, slots = project_gaussians(
        prepare_gaussians(make_cloud(means, scales)), view_of(np.eye(4), K, WIDTH, HEIGHT)
    )
    assert len(slots) == 1 and np.isfinite(records).all()


def test_nan_is_refused_by_name_and_number() -> None:
    gaussians = random_cloud(10)
    gaussians.means[7, 1] = np.nan
    with pytest.raises(InputError, match=r"means must be finite; 1 of 10 .* number 7"):
        prepare_gaussians(gaussians)


def test_an_unusable_camera_is_refused_with_every_reason() -> None:
    broken = K.copy()
    broken[0, 0] = np.nan
    with pytest.raises(InputError) as caught:
        rasterise_view(prepare_gaussians(random_cloud(5)), np.eye(3), broken, 0, 10)
    assert [problem.split(" must")[0] for problem in caught.value.problems] == [
        "camera: viewmat", "camera: K", "camera: the picture",
    ]  # fmt: skip
    with pytest.raises(InputError, match=r"focal lengths must be positive; they are 60.0 and -58.0"):
        rasterise_view(prepare_gaussians(random_cloud(5)), np.eye(4), np.diag((60, -58, 1.0)), 10, 10)
