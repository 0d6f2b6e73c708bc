"""Measure the device path where a GPU is at hand, in under eight minutes: ``python -m studies.gpu``.

For each size and weather of one street: how far the device's frames are from the processor's, and how long a whole
clip takes, alone and beside others. Without a GPU, ``--rehearse`` runs the same steps on two tiny frames.
"""

import argparse
import json
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import Any

import numpy as np

from catalogs.entries import load
from catalogs.scenes import load_scene
from catalogs.weather.look import load_weather
from tasks.render.camera import Camera
from tasks.render.clip import RigMotion, render_clip
from tasks.render.rasterise.backend import Backend, CpuBackend, select_backend
from tasks.render.weather.layers import ClipConditions
from tasks.scene.scene import Scene
from tasks.surface.state import SurfaceState

STATES = {
    "dry": SurfaceState(kind="dry"),
    "rain": SurfaceState(kind="rain", precipitation_mm_h=50, film_depth_mm=1.263),
    "snow": SurfaceState(kind="snow", precipitation_mm_h=3, snow_depth_mm=30, snow_coverage=1.0),
}
SIZES = ((480, 320), (1280, 720), (1920, 1280))
FRAMES, COMPARED, BESIDE = 41, 2, 4
"""Frames of a clip, frames that the processor draws too, and clips at once [1]."""
STEP_M = 1.2
"""Way between two frames: 12 m/s at 10 Hz [m]."""


def measure(
    scene: Scene, device: Backend, sizes: tuple[tuple[int, int], ...] = SIZES, frames: int = FRAMES
) -> list[dict[str, Any]]:
    """Return a row for each size and weather: differences, and seconds of a clip alone and beside others."""
    rows = []
    for width, height in sizes:
        camera = resize(load("camera", "dashcam-480x320"), width, height)
        for name in STATES:
            got = draw(scene, camera, name, device, frames)  # compiles, too
            wanted = draw(scene, camera, name, CpuBackend(), min(COMPARED, frames))
            got = {key: values[: len(wanted["rgb"])] for key, values in got.items()}
            apart = got["rgb"].astype(np.float64) - wanted["rgb"]
            started = time.perf_counter()
            draw(scene, camera, name, device, frames)
            alone = time.perf_counter() - started
            with ThreadPoolExecutor(BESIDE) as pool:
                started = time.perf_counter()
                list(pool.map(lambda _: draw(scene, camera, name, device, frames), range(BESIDE)))  # noqa: B023
                beside = time.perf_counter() - started
            rows.append(
                {
                    "size": f"{width}x{height}",
                    "weather": name,
                    "psnr_db": round(float(10 * np.log10(255**2 / max(np.mean(apart**2), 1e-12))), 1),
                    "class_differs": float(np.mean(got["class"] != wanted["class"])),
                    "clip_s": round(alone, 3),
                    "frames_per_s": round(frames / alone, 1),
                    "frames_per_s_beside": round(BESIDE * frames / beside, 1),
                }
            )
            print(json.dumps(rows[-1]), flush=True)
    return rows


def resize(camera: Camera, width: int, height: int) -> Camera:
    """Return the camera with another number of pixels over the same field."""
    scale = width / camera.width
    K = np.diag((scale, scale, 1.0)) @ np.asarray(camera.K, dtype=np.float64)
    K[1, 2] = height / 2
    return replace(camera, width=width, height=height, K=K)


def draw(scene: Scene, camera: Camera, name: str, backend: Backend, frames: int) -> dict[str, Any]:
    """Return a clip in a weather, made from scratch."""
    motion = RigMotion(
        T_world_rig=np.stack([scene.route.pose(10 + STEP_M * k) for k in range(frames)]), frame_rate_hz=10.0
    )
    conditions = ClipConditions(
        state=STATES[name], pavement=load("surface", "dense-asphalt"), parameters=load_weather(), seed=1
    )
    return render_clip(scene, camera, motion, conditions, backend)


def main() -> None:
    """Print one row a line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rehearse", action="store_true", help="two tiny frames, by the processor alone")
    if parser.parse_args().rehearse:
        measure(load_scene("street"), CpuBackend(), ((48, 32),), 2)
        return
    import torch

    print(json.dumps({"device": torch.cuda.get_device_name(0), "torch": torch.__version__}), flush=True)
    measure(load_scene("street"), select_backend("gsplat"))


if __name__ == "__main__":
    main()
