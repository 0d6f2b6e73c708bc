"""Rolling shutter and motion blur out of one render: what they cost, and how near they come to many renders."""

import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.side_by_side import least_cpu_s, make_row, print_rows
from catalogs.entries import load
from catalogs.scenes import load_scene
from tasks.eval.image_quality import psnr
from tasks.render.camera import Camera, continuous_rig, world_to_camera
from tasks.render.composition import compose_over_sky, encode_8bit
from tasks.render.environment import environment_view
from tasks.render.rasterise.backend import CpuBackend
from tasks.render.readout import Field, read_out, sensor_field

SPEED, PITCH_RATE, STATION = 16.0, 0.15, 8.0
"""The drive: along the route [m/s], nose down [rad/s], from a station on [m]."""
RENDERS, ROW_STEP = 32, 8
Light = NDArray[np.float32]


def measure_rows(scene_name: str = "street") -> list[dict[str, Any]]:
    """Hold one render, resampled, against 32 renders over the exposure and one render for every eighth row.

    Returns
    -------
    Rows of name, value, unit, peer (what the value is held against) and ratio (value over peer).
    """
    scene, asked = load_scene(scene_name), load("camera", "dashcam-480x320-rolling")
    pinhole = replace(asked, lens=None)
    backend = CpuBackend()
    prepared = backend.prepare_gaussians(scene.gaussians)
    ticks = np.arange(201, dtype=np.float64) * 1e-3
    rig_at = continuous_rig(
        scene.route, ticks, STATION + SPEED * ticks, 0 * ticks, PITCH_RATE * ticks, np.array([0.1]),
        cg_behind_front_axle=1.2, cg_height=0.55,
    )  # fmt: skip

    def poses(times: NDArray[np.float64]) -> NDArray[np.float64]:
        return rig_at(0, times.ravel()).reshape(*times.shape, 4, 4) @ asked.T_rig_camera

    here = poses(np.zeros(1))[0]
    one = sensor_field(replace(pinhole, line_delay_s=0.0, motion_blur=False))

    def draw(pose: NDArray[np.float64], field: Field = one) -> tuple[Light, Light]:
        view = world_to_camera(pose)
        gbuffer = backend.rasterise_view(prepared, view, field.K, field.width, field.height)
        sky = environment_view(scene.environment, view, field.K, field.width, field.height)
        return compose_over_sky(gbuffer, sky, scene.gaussians.display_encoded), gbuffer.depth

    def sensed(camera: Camera, field: Field) -> Light:
        to_rows = world_to_camera(here) @ poses(camera.row_times)
        return read_out(*draw(here, field), field, to_rows, camera.motion_blur).picture

    def mean_of(count: int) -> Light:
        shares = (np.arange(count) + 0.5) / count - 0.5
        pictures = [draw(pose)[0] for pose in poses(shares * asked.exposure_s)]
        return np.asarray(np.mean(pictures, axis=0, dtype=np.float32), np.float32)

    def row_by_row(camera: Camera, step: int) -> tuple[NDArray[np.intp], Light]:
        chosen = np.arange(step // 2, camera.height, step)
        seen = [draw(pose)[0][r] for r, pose in zip(chosen, poses(camera.row_times[1][chosen]), strict=True)]
        return chosen, np.stack(seen)

    plain, clear_ms = draw(here)[0], 1e3 * least_cpu_s(lambda: draw(here))
    found = [make_row("one shutter, no blur", clear_ms, "CPU-ms")]
    blurred, rolling = replace(pinhole, line_delay_s=0.0), replace(pinhole, motion_blur=False)
    exact = mean_of(RENDERS)
    row_numbers, row_pictures = row_by_row(rolling, ROW_STEP)
    for name, camera in (
        ("blur", blurred),
        ("rolling shutter", rolling),
        ("both", pinhole),
        ("all three", asked),
    ):
        field = sensor_field(camera)
        picture = sensed(camera, field)
        spent = 1e3 * least_cpu_s(lambda camera=camera, field=field: sensed(camera, field))  # type: ignore[misc]
        found.append(make_row(f"{name}: cost", spent, "CPU-ms", "one shutter, no blur", clear_ms))
        if camera is blurred:
            near, far = _compute_psnr(picture, exact), _compute_psnr(plain, exact)
            found.append(make_row("blur: to 32 renders", near, "dB", "blur left out", far))
            found.append(
                make_row(
                    "blur of two renders: to 32 renders",
                    _compute_psnr(mean_of(2), exact),
                    "dB",
                    "blur left out",
                    far,
                )
            )
        if camera is rolling:
            near, far = (
                _compute_psnr(picture[row_numbers], row_pictures),
                _compute_psnr(plain[row_numbers], row_pictures),
            )
            found.append(make_row("rolling shutter: to a render a row", near, "dB", "one shutter", far))
    return found


def _compute_psnr(picture: Light, exact: Light) -> float:
    return psnr(encode_8bit(exact), encode_8bit(picture))


if __name__ == "__main__":
    for scene_name in sys.argv[1:] or ["street"]:
        print(Path(scene_name).name)
        print_rows(measure_rows(scene_name))
