import numpy as np
import pytest

from tasks.render.composition import compose_over_sky, encode_8bit, round_depth, to_display, to_linear
from tasks.render.contact_sheet import CAPTION, CURVE_COLOURS, MARGIN, draw_contact_sheet, encode_png
from tasks.render.environment import direction_angle, environment_view, plain_sky, sample_panorama
from tasks.render.rasterise.gbuffer import GBuffer

K = np.array([[40.0, 0, 24], [0, 40.0, 16], [0, 0, 1]])


def look_along(forward: list[float], down: list[float]) -> np.ndarray:
    view = np.eye(4)
    view[:3, :3] = [np.cross(down, forward), down, forward]
    return view


@pytest.mark.parametrize(
    ("display", "linear"), [(0.0, 0.0), (0.04045, 0.0031308), (0.5, 0.2140411), (1.0, 1.0)]
)
def test_srgb_anchors_of_iec_61966_2_1(display, linear):
    assert to_linear(np.float32([display]))[0] == pytest.approx(linear, rel=1e-4, abs=1e-7)
    assert to_display(np.float32([linear]))[0] == pytest.approx(display, rel=1e-4, abs=1e-6)


def test_every_byte_survives_linear_light_and_back():
    levels = np.arange(256, dtype=np.uint8)
    assert (encode_8bit(to_linear((levels / 255).astype(np.float32))) == levels).all()


def make_buffer(alpha: float) -> GBuffer:
    shape = (4, 5)
    return GBuffer(
        rgb=np.full((*shape, 3), 0.4 * alpha, np.float32), depth=np.ones(shape, np.float32),
        expected_depth=np.ones(shape, np.float32), alpha=np.full(shape, alpha, np.float32),
        normal=np.zeros((*shape, 3), np.float32),
        class_id=np.zeros(shape, np.uint8),
        object_id=np.zeros(shape, np.uint16),
    )  # fmt: skip


def test_the_sky_fills_what_the_street_leaves():
    sky = np.full((4, 5, 3), 0.8, np.float32)
    np.testing.assert_allclose(
        compose_over_sky(make_buffer(0.25), sky, False), 0.25 * 0.4 + 0.75 * 0.8, rtol=1e-6
    )
    np.testing.assert_array_equal(compose_over_sky(make_buffer(0.0), sky, False), sky)


def test_display_encoded_scenes_blend_before_they_are_linearised():
    sky = np.full((4, 5, 3), 0.8, np.float32)
    np.testing.assert_allclose(compose_over_sky(make_buffer(0.0), sky, True), sky, rtol=1e-5)
    np.testing.assert_allclose(
        compose_over_sky(make_buffer(1.0), sky, True), to_linear(np.float32([0.4]))[0], rtol=1e-5
    )


def test_depth_is_rounded_to_thirteen_bits_and_nan_stays():
    depth = np.random.default_rng(1).uniform(0.1, 300, 10_000).astype(np.float32)
    depth[7] = np.nan
    rounded = round_depth(depth)
    error = np.abs(rounded / depth - 1)
    assert np.nanmax(error) <= 2.0**-14
    assert np.isnan(rounded).nonzero()[0].tolist() == [7]
    assert (rounded[~np.isnan(rounded)].view(np.uint32) & 0x3FF == 0).all()


@pytest.mark.parametrize(("forward", "column"), [([1, 0, 0], 0.5), ([0, 1, 0], 0.25), ([0, -1, 0], 0.75)])
def test_the_panorama_centre_is_forward_and_its_left_quarter_is_left(forward, column):
    panorama = np.zeros((64, 128, 3), np.float32)
    at = int(column * 128)
    panorama[28:36, at - 4 : at + 4] = 1.0
    view = environment_view(panorama, look_along(forward, [0, 0, -1]), K, 48, 32)
    assert view[15:17, 23:25].min() > 0.9
    assert view[:, :4].max() < 0.1


def test_the_first_panorama_row_is_the_zenith():
    panorama = np.zeros((64, 128, 3), np.float32)
    panorama[:8] = 1.0
    up = environment_view(panorama, look_along([0, 0, 1], [1, 0, 0]), K, 48, 32)
    assert up[16, 24].min() > 0.99


def test_there_is_no_seam_behind():
    panorama = plain_sky()
    view = environment_view(panorama, look_along([-1, 0, 0], [0, 0, -1]), K, 48, 32)
    assert np.abs(np.diff(view, axis=1)).max() < 0.02


def test_panorama_columns_turn_left_from_plus_x():
    panorama = np.zeros((8, 16, 3), np.float32)
    panorama[3:5, 7:9] = (1, 0, 0)
    panorama[3:5, 3:5] = (0, 1, 0)
    panorama[0] = (0, 0, 1)
    out = np.zeros(3, np.float32)
    for direction, colour in (((1, 0, 0), 0), ((0, 1, 0), 1), ((0, 0, 1), 2)):
        sample_panorama(panorama, *(5.0 * c for c in direction), out)
        assert out.argmax() == colour
        assert out[colour] == pytest.approx(1.0)


def test_angles_are_those_of_the_library_all_round():
    angle = np.linspace(-np.pi, np.pi, 4001)[1:-1]
    for y, x in zip(np.sin(angle), np.cos(angle), strict=True):
        assert direction_angle(np.float32(5 * y), np.float32(5 * x)) == pytest.approx(
            np.arctan2(y, x), abs=1.2e-6
        )
    assert direction_angle(np.float32(1), np.float32(0)) == pytest.approx(np.pi / 2)
    assert direction_angle(np.float32(0), np.float32(-1)) == pytest.approx(np.pi)


def test_a_view_is_the_panorama_sampled_pixel_by_pixel():
    panorama = np.random.default_rng(2).random((64, 128, 3), np.float32)
    view = look_along([-0.8, 0.5, 0.2], [0, 0, -1])
    seen, out = environment_view(panorama, view, K, 48, 32), np.zeros(3, np.float32)
    for row, column in ((0, 0), (31, 47), (11, 30)):
        ray = np.linalg.inv(K) @ (column + 0.5, row + 0.5, 1.0) @ view[:3, :3]
        sample_panorama(panorama, *ray, out)
        np.testing.assert_allclose(seen[row, column], out, atol=1e-4)


def test_a_contact_sheet_has_a_row_a_clip_and_decodes():
    import cv2

    pictures = [np.full((32, 48, 3), 200, np.uint8)] * 2
    curves = {"speed": np.linspace(16, 0, 9), "pitch": np.linspace(0, 0.03, 9)}
    sheet = draw_contact_sheet([("dry", pictures, curves), ("snow", pictures, curves)], [0, 8], 10.0)
    assert (cv2.imdecode(np.frombuffer(encode_png(sheet), np.uint8), 1)[..., ::-1] == sheet).all()
    one = draw_contact_sheet([("dry", pictures, curves)], [0, 8], 10.0)
    assert sheet.shape[0] > 1.8 * one.shape[0]


def test_each_curve_is_named_in_its_own_colour():
    pictures = [np.full((32, 48, 3), 200, np.uint8)]
    curves = {"speed": np.linspace(16, 0, 9), "pitch": np.linspace(0, 0.03, 9)}
    sheet = draw_contact_sheet([("dry", pictures, curves)], [0], 10.0)
    heading = sheet[: MARGIN + CAPTION]
    for colour in CURVE_COLOURS.values():
        assert (np.abs(heading.astype(int) - colour).max(axis=2) < 20).any()
