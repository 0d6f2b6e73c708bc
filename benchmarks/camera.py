"""Rolling shutter and motion blur out of one render: what they cost, and how near they come to many renders."""

import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

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
RENDERS, ROW_STEP, REPEATS = 32, 8, 3
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

    plain, clear_ms = draw(here)[0], _cpu_ms(lambda: draw(here))
    found = [
        {"name": "one shutter, no blur", "value": clear_ms, "unit": "CPU-ms", "peer": None, "ratio": None}
    ]
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
        spent = _cpu_ms(lambda camera=camera, field=field: sensed(camera, field))  # type: ignore[misc]
        found.append(_make_row(f"{name}: cost", spent, "CPU-ms", "one shutter, no blur", clear_ms))
        if camera is blurred:
            near, far = _compute_psnr(picture, exact), _compute_psnr(plain, exact)
            found.append(_make_row("blur: to 32 renders", near, "dB", "blur left out", far))
            found.append(
                _make_row(
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
            found.append(_make_row("rolling shutter: to a render a row", near, "dB", "one shutter", far))
    return found


def _compute_psnr(picture: Light, exact: Light) -> float:
    return psnr(encode_8bit(exact), encode_8bit(picture))


def _make_row(name: str, value: float, unit: str, peer: str, held: float) -> dict[str, Any]:
    return {"name": name, "value": value, "unit": unit, "peer": peer, "ratio": value / held}


def _cpu_ms(call: Callable[[], object]) -> float:
    """Median CPU time of a few calls after a first one that may compile [ms]."""
    call()
    spent = []
    for _ in range(REPEATS):
        started = time.process_time()
        call()
        spent.append(time.process_time() - started)
    return 1e3 * float(np.median(spent))


if __name__ == "__main__":
    for scene_name in sys.argv[1:] or ["street"]:
        for row in measure_rows(scene_name):
            ratio = "" if row["ratio"] is None else f"{row['ratio']:.2f} of {row['peer']}"
            print(f"{Path(scene_name).name:8} {row['name']:36} {row['value']:8.1f} {row['unit']:7} {ratio}")
