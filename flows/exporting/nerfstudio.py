"""nerfstudio: a folder a clip with ``transforms.json``, and the edited scene as ``.ply`` of Gaussians.

``NAME/transforms.json`` has pictures (PNG, as stored), depth (``.npy``, float32 [mm]; unseen is 0) and camera-to-world
matrices with nerfstudio's camera axes (OpenGL: x right, y up, z back), which are ours with y and z reversed. Depth is
in millimetres because nerfstudio takes ``depth_unit_scale_factor`` from its own configuration (0.001 by default) and
never from the file. The world is ours (ISO 8855, z up), so that the camera of a braking car looks down: its z axis,
which points back, rises. Pixel centres lie at +0.5 in both. ``time`` is a frame's share of the clip, our times are in
``t_ns``.

``scenes/*.ply`` are the Gaussians of the scene with one road feature each, in the layout of the INRIA code (means [m],
logarithmic scales, logit opacities, quaternions wxyz, spherical harmonics); a clip's file is named in its
``gaussians_file``. The weather is not in them: it is composed onto the pictures.

Format: https://docs.nerf.studio/quickstart/data_conventions.html
"""

from pathlib import Path
from typing import Any

import numpy as np

from catalogs.scenes.gaussian_files import write_gaussians
from flows.exporting.dataset import ExportedClip, ExportedDataset
from flows.making.catalogue import catalogue_of
from flows.making.driving import hazard_of
from flows.making.pictures import edit_scene, shape_road
from flows.store.layout import write_json
from tasks.render.camera import Camera
from tasks.render.contact_sheet import encode_png

OPENGL = np.diag([1.0, -1.0, -1.0, 1.0])
"""Camera axes of nerfstudio in ours."""
MILLIMETRE = np.float32(1000)
"""In one metre: nerfstudio multiplies depth by 0.001 by default."""


def write_nerfstudio(dataset: ExportedDataset, folder: Path) -> None:
    """Write a folder a clip, and ``scenes/``.

    Parameters
    ----------
    dataset : with frames
    folder : empty

    Raises
    ------
    InputError
        If the scene is not to be found.
    """
    roads: dict[tuple[str | None, float, float, float], str] = {}
    (folder / "scenes").mkdir()
    for clip in dataset:
        scenario = clip.scenario
        road = scenario.scene, scenario.hazard_center_m, scenario.hazard_length_m, scenario.hazard_height_m
        if road not in roads:
            catalogue = catalogue_of(dataset.layout.root, scenario.scene)
            roads[road] = f"scenes/road-{len(roads):03d}.ply"
            drawn = edit_scene(
                catalogue.scene,
                shape_road(catalogue.scene, hazard_of(scenario)),
                catalogue.marking,
                catalogue.weather_parameters.sky.asphalt_albedo,
            )
            write_gaussians(drawn, folder / roads[road])
        _write_clip(clip, dataset, folder / clip.name, roads[road])


def _write_clip(clip: ExportedClip, dataset: ExportedDataset, folder: Path, scene: str) -> None:
    for name in ("images", "depth"):
        (folder / name).mkdir(parents=True)
    rgb, depth = clip.read_array("rgb"), clip.read_array("depth")
    poses, times = clip.T_world_camera @ OPENGL, clip.frames["t_ns"].tolist()
    frames = []
    for frame, t_ns in enumerate(times):
        picture, distance = f"images/frame_{frame:05d}.png", f"depth/frame_{frame:05d}.npy"
        (folder / picture).write_bytes(encode_png(rgb[frame]))
        np.save(folder / distance, np.nan_to_num(depth[frame], nan=0.0) * MILLIMETRE)
        frames.append(
            {
                "file_path": picture,
                "depth_file_path": distance,
                "transform_matrix": poses[frame].tolist(),
                "time": t_ns / times[-1],
                "t_ns": t_ns,
            }
        )
    content = _describe_camera(clip.camera) | {
        "gaussians_file": f"../{scene}",
        "frames": frames,
    }
    write_json(folder / "transforms.json", content)


def _describe_camera(camera: Camera) -> dict[str, Any]:
    k1, k2, p1, p2, k3 = [0.0] * 5 if camera.distortion is None else camera.distortion.tolist()
    return {
        "camera_model": "OPENCV",
        "w": camera.width,
        "h": camera.height,
        "fl_x": float(camera.K[0, 0]),
        "fl_y": float(camera.K[1, 1]),
        "cx": float(camera.K[0, 2]),
        "cy": float(camera.K[1, 2]),
        "k1": k1,
        "k2": k2,
        "k3": k3,
        "p1": p1,
        "p2": p2,
    }
