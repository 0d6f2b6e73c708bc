"""Every layer on a device is the processor's, pixel by pixel: on a GPU where one is there, else in CUDA's simulator."""

from dataclasses import fields, is_dataclass, replace
from typing import Any

import numba
import numpy as np
import pytest

from tasks.render.rasterise.backend import _GPU_DEVICES, CpuBackend

HAS_GPU = any(device.exists() for device in _GPU_DEVICES)
numba.config.ENABLE_CUDASIM = not HAS_GPU  # read when numba.cuda is first imported

import torch  # noqa: E402

from tasks.render.camera import Camera, world_to_camera  # noqa: E402
from tasks.render.clip import RigMotion, render_clip  # noqa: E402
from tasks.render.composition import compose_over_sky, round_depth  # noqa: E402
from tasks.render.device import blur_tensor  # noqa: E402
from tasks.render.display_bytes import encode_picture  # noqa: E402
from tasks.render.environment import environment_view  # noqa: E402
from tasks.render.grain import add_grain  # noqa: E402
from tasks.render.pixels import blur  # noqa: E402
from tasks.render.weather.falling.particles import STREAK  # noqa: E402
from tasks.render.weather.falling.streaks import draw_streaks  # noqa: E402
from tasks.render.weather.layers import ClipConditions, apply_weather  # noqa: E402
from tasks.surface.state import SurfaceState  # noqa: E402
from tests.render.weather.conftest import shutter  # noqa: E402
from tests.render.weather.scenes import PAVEMENT, clear_sky, flat_gbuffer, road, weather_over  # noqa: E402
from tests.toy_street import toy_street  # noqa: E402

VIEW = shutter(width=16, height=8, focal=13.0, speed=8.0)
DEVICE = "cuda" if HAS_GPU else "cpu"
"""The simulator takes tensors of the processor."""


def move(value: Any) -> Any:
    """An array, or a frozen value with all its arrays, on the device."""
    if isinstance(value, np.ndarray):
        return torch.from_numpy(value.astype(np.int32) if value.dtype == np.uint16 else value).to(DEVICE)
    if is_dataclass(value):
        return replace(value, **{f.name: move(getattr(value, f.name)) for f in fields(value)})
    return value


def differ(got: Any, wanted: Any) -> float:
    """Largest difference of two pictures; NaN in both is none."""
    assert isinstance(got, torch.Tensor)
    pair = (np.nan_to_num(one.astype(np.float64), nan=-1) for one in (got.cpu().numpy(), wanted))
    return float(np.abs(np.subtract(*pair)).max())


@pytest.fixture(scope="module")
def seen():
    """A road before a striped wall under a sky: the G-buffer, and its sky."""
    _, gbuffer = flat_gbuffer(VIEW, wall_x=12.0)
    gbuffer = replace(gbuffer, alpha=gbuffer.alpha * np.float32(0.97))
    viewmat = world_to_camera(VIEW.T_world_camera)
    return gbuffer, environment_view(clear_sky(), viewmat, VIEW.K, VIEW.width, VIEW.height)


def test_sky_grain_composition_and_bytes(seen) -> None:
    gbuffer, sky = seen
    viewmat = world_to_camera(VIEW.T_world_camera)
    there = environment_view(move(clear_sky()), viewmat, VIEW.K, VIEW.width, VIEW.height)
    assert differ(there, sky) < 1e-6
    near = replace(gbuffer, depth=0.02 * gbuffer.depth)
    grained = add_grain(near, VIEW.T_world_camera, VIEW.K)
    assert np.abs(grained.rgb - near.rgb).max() > 0.01
    assert differ(add_grain(move(near), VIEW.T_world_camera, VIEW.K).rgb, grained.rgb) < 1e-6
    for display_encoded in (False, True):
        wanted = compose_over_sky(gbuffer, sky, display_encoded)
        got = compose_over_sky(move(gbuffer), there, display_encoded)
        assert differ(got, wanted) < 1e-6
        assert differ(encode_picture(got), encode_picture(wanted)) <= 1
        assert encode_picture(got).dtype == torch.uint8
    assert differ(round_depth(move(gbuffer.depth)), round_depth(gbuffer.depth)) == 0


def test_window_means(seen) -> None:
    gbuffer, sky = seen
    for picture in (gbuffer.alpha, sky):
        assert differ(blur_tensor(move(picture), 5), blur(picture, 5)) < 1e-6


STATES = {
    "rain": SurfaceState(kind="rain", precipitation_mm_h=50, film_depth_mm=1.263),
    "snow": SurfaceState(kind="snow", precipitation_mm_h=3, snow_depth_mm=30, snow_coverage=1.0),
}


@pytest.mark.parametrize("kind", STATES)
def test_layers_of_a_weather(seen, parameters, kind) -> None:
    gbuffer, _ = seen
    _, weather = weather_over(road(length=3.0), clear_sky(), STATES[kind], parameters)
    black = np.zeros_like(gbuffer.rgb)
    wanted = apply_weather(weather, gbuffer.rgb, black, gbuffer, VIEW)
    outside = replace(weather.outside, environment=move(weather.outside.environment))
    there = replace(weather, outside=outside)
    device = move(gbuffer)
    got = apply_weather(there, device.rgb, move(black), device, VIEW)
    for one, other in zip(got.layers, wanted.layers, strict=True):
        assert differ(one.add, other.add) < 2e-5, one.name
        assert one.name == "light" or differ(one.gain, other.gain) < 2e-5, one.name
    assert differ(got.picture, wanted.picture) < 2e-5


def test_streaks_of_two_blocks(seen) -> None:
    gbuffer, _ = seen
    draw = np.random.Generator(np.random.Philox(3))
    streaks = np.zeros(12, dtype=STREAK)
    streaks["begin"] = draw.uniform((-4, -4), (52, 20), (12, 2))
    streaks["end"] = streaks["begin"] + draw.uniform(-6, 6, (12, 2))
    streaks["z"], streaks["diameter"], streaks["share"] = draw.uniform(0.5, 9, 12), 0.5, 1.0
    depth = np.tile(gbuffer.depth, (3, 3))[:20]
    light = draw.uniform(0.2, 0.8, (12, 3))
    wanted = draw_streaks(streaks, light, depth, VIEW.K, 2e-3)
    assert wanted.alpha[:, 32:].max() > 0.1 and wanted.alpha[:, :32].max() > 0.1
    got = draw_streaks(streaks, light, move(depth), VIEW.K, 2e-3)
    assert differ(got.rgb, wanted.rgb) < 1e-6 and differ(got.alpha, wanted.alpha) < 1e-6


class DeviceBackend(CpuBackend):
    """The processor's rasteriser, whose buffers lie on the device."""

    keep = staticmethod(move)

    @staticmethod
    def rasterise_view(*arguments: Any, **options: Any) -> Any:
        return move(CpuBackend.rasterise_view(*arguments, **options))


def test_clip_in_rain(parameters) -> None:
    camera = Camera(
        name="tiny",
        width=VIEW.width,
        height=VIEW.height,
        K=VIEW.K,
        T_rig_camera=VIEW.T_world_camera,
        exposure_s=0.008,
    )
    poses = np.tile(np.eye(4), (2, 1, 1))
    poses[:, 0, 3] = (4.0, 4.5)
    motion = RigMotion(T_world_rig=poses, frame_rate_hz=10.0)
    conditions = ClipConditions(state=STATES["rain"], pavement=PAVEMENT, parameters=parameters, seed=1)
    clips = [
        render_clip(toy_street(), camera, motion, conditions, backend)
        for backend in (CpuBackend(), DeviceBackend())
    ]
    for name, wanted in clips[0].items():
        assert clips[1][name].dtype == wanted.dtype
        apart = np.nan_to_num(clips[1][name].astype(float)) - np.nan_to_num(wanted.astype(float))
        assert np.abs(apart).max() <= (name == "rgb"), name
