"""Scenes made, imported and looked at."""

from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from catalogs.documents import read_json_document
from catalogs.scenes import load_scene, write_scene
from catalogs.scenes.folder import must_be_new
from catalogs.scenes.gaussian_files import read_gaussians
from catalogs.scenes.route_files import read_route
from flows.store.outputs import Outputs
from tasks.conventions import ROAD_CLASSES
from tasks.errors import InputError
from tasks.render.composition import compose_over_sky, encode_8bit
from tasks.render.contact_sheet import encode_png
from tasks.render.environment import environment_view, plain_sky
from tasks.render.rasterise.backend import select_backend
from tasks.scene.classify import classify_road
from tasks.scene.scene import Scene, find_sun_problems
from tasks.scene.transform import transform_gaussians


def scene_import(
    gaussians: str,
    route: str,
    out: str,
    *,
    camera_height: float = 1.5,
    half_width: float = 3.5,
    metres_per_unit: float = 1.0,
    sun_direction_deg: tuple[float, float] | None = None,
) -> dict[str, Any]:
    """Make a scene folder of Gaussians trained elsewhere and a route.

    Parameters
    ----------
    camera_height : of the route's camera poses above the road [m]
    half_width : of the carriageway, to either side of the route [m]
    metres_per_unit : scale of the files, for reconstructions without one [m]
    sun_direction_deg : azimuth and elevation of the sun, as in `Scene` [deg]

    Raises
    ------
    InputError
        Listing the problems of the files, or if ``out`` is not empty, or the sun below the horizon.
    """
    must_be_new(Path(out))
    if problems := find_sun_problems(sun_direction_deg):
        raise InputError(problems)
    course, T_world_source = read_route(Path(route), camera_height, metres_per_unit)
    cloud = transform_gaussians(read_gaussians(Path(gaussians)), T_world_source)
    scene = Scene(
        name=Path(out).name,
        gaussians=classify_road(cloud, course, half_width, -half_width),
        route=course,
        environment=plain_sky(),
        carriageway_left=half_width,
        carriageway_right=-half_width,
        sun_direction_deg=sun_direction_deg,
    )
    write_scene(scene, Path(out), {"source": Path(gaussians).name})
    road = np.isin(scene.gaussians.class_id, ROAD_CLASSES).mean()
    return {
        "scene": out,
        "gaussians": len(scene.gaussians),
        "route_length_m": scene.route.length,
        "road_share": float(road),
    }


def render_pose(scene: str, pose: str, out: str, *, backend: str = "auto") -> dict[str, Any]:
    """Render one frame at a world-to-camera pose and write its buffers.

    Raises
    ------
    InputError
        If the pose file lacks a key or a matrix has the wrong shape.
    """
    viewmat, intrinsics, width, height = _read_pose(pose)
    loaded = load_scene(scene)
    engine = select_backend(backend)
    gbuffer = engine.rasterise_view(
        engine.prepare_gaussians(loaded.gaussians), viewmat, intrinsics, width, height
    )
    sky = environment_view(loaded.environment, viewmat, intrinsics, width, height)
    picture = encode_8bit(compose_over_sky(gbuffer, sky, loaded.gaussians.display_encoded))
    buffers: dict[str, Any] = {
        "depth": gbuffer.expected_depth,
        "surface_depth": gbuffer.depth,
        "alpha": gbuffer.alpha,
        "normal": gbuffer.normal,
        "class": gbuffer.class_id,
    }
    results = Outputs(out, "render", "rgb.png", *(f"{name}.npy" for name in buffers))
    results.write("rgb.png", encode_png(picture))
    for name, buffer in buffers.items():
        content = BytesIO()
        np.save(content, buffer)
        results.write(f"{name}.npy", content.getvalue())
    return {"picture": str(results.path("rgb.png")), "backend": engine.name, "width": width, "height": height}


def _read_pose(pose: str) -> tuple[np.ndarray, np.ndarray, int, int]:
    content = read_json_document(Path(pose), "pose")
    if not isinstance(content, dict):
        raise InputError(f"{pose}: a pose must be a JSON object with viewmat, K, width and height")
    problems = [
        f"{pose}: {key} is required; it is missing"
        for key in ("viewmat", "K", "width", "height")
        if key not in content
    ]
    matrices = {}
    for key, shape in (("viewmat", (4, 4)), ("K", (3, 3))):
        if key in content:
            try:
                matrices[key] = np.array(content[key], dtype=float)
            except (TypeError, ValueError):
                matrices[key] = np.empty(0)
            if matrices[key].shape != shape or not np.isfinite(matrices[key]).all():
                problems.append(
                    f"{pose}: {key} must be a {shape[0]}x{shape[1]} matrix of finite numbers; it is not"
                )
    for key in ("width", "height"):
        if key in content and not (isinstance(content[key], int) and content[key] > 0):
            problems.append(f"{pose}: {key} must be a positive whole number; it is {content[key]!r}")
    if problems:
        raise InputError(problems)
    return matrices["viewmat"], matrices["K"], content["width"], content["height"]
