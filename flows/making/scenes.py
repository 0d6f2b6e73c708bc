"""Scenes made, imported and looked at."""

from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from catalogs.documents import parse_json, read_content
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
from tasks.scene.classify import (
    ENOUGH,
    HEIGHT_TOLERANCE,
    classify_road,
    find_level_surface,
    measure_coverage,
)
from tasks.scene.scene import Scene, find_sun_problems
from tasks.scene.transform import transform_gaussians

LARGEST_POSE = 2**20
"""Bytes of a pose file [1]: 26 numbers take 1,000."""


def scene_import(
    gaussians: str,
    route: str,
    out: str,
    *,
    camera_height: float = 1.5,
    half_width: float = 3.5,
    sun_direction_deg: tuple[float, float] | None = None,
    **frame: Any,
) -> dict[str, Any]:
    """Make a scene folder of Gaussians trained elsewhere and a route.

    Parameters
    ----------
    camera_height : of the route's camera poses above the road [m]
    half_width : of the carriageway, to either side of the route [m]
    sun_direction_deg : azimuth and elevation of the sun, as in `Scene` [deg]
    frame : ``metres_per_unit``, ``poses`` and ``dataparser`` of `catalogs.scenes.route_files.read_route`

    Raises
    ------
    InputError
        Listing the problems of the files, or if ``out`` is not empty, or the sun below the horizon.
    """
    must_be_new(Path(out))
    if problems := find_sun_problems(sun_direction_deg):
        raise InputError(problems)
    course, T_world_cloud = read_route(Path(route), camera_height, **frame)
    warnings: list[str] = []
    cloud = transform_gaussians(read_gaussians(Path(gaussians), warnings), T_world_cloud)
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
    coverage = measure_coverage(scene.gaussians, course)
    if coverage < ENOUGH:
        warnings.append(
            _explain_missing_road(scene, coverage, camera_height, frame.get("metres_per_unit", 1.0))
        )
    return {
        "scene": out,
        "gaussians": len(scene.gaussians),
        "route_length_m": scene.route.length,
        "road_share": float(road),
        "road_coverage": coverage,
        "road_found": coverage >= ENOUGH,
        "warnings": warnings,
    }


def _explain_missing_road(scene: Scene, coverage: float, camera_height: float, metres_per_unit: float) -> str:
    found = (
        f"Gaussians of a road must lie within {HEIGHT_TOLERANCE:g} m of the route's road along at least"
        f" {ENOUGH:.0%} of its length; they do along {coverage:.0%}"
    )
    surface = find_level_surface(
        scene.gaussians, scene.route, scene.carriageway_left, scene.carriageway_right
    )
    if surface is not None and surface < camera_height:
        height = camera_height - surface
        return (
            f"{found}: a level surface lies {abs(surface):.2f} m {'above' if surface > 0 else 'below'} it; give"
            f" --camera-height {height:.2f} or, where the files are not in metres, --metres-per-unit"
            f" {metres_per_unit * camera_height / height:.4g}"
        )
    spans = " x ".join(f"{span:.3g}" for span in np.ptp(scene.gaussians.means, axis=0))
    return (
        f"{found}: is the route in the cloud's frame (of a cloud that nerfstudio exported, give --dataparser"
        " dataparser_transforms.json), in its unit (--metres-per-unit), with its axes (--poses) and with this camera"
        f" height (--camera-height)? The cloud spans {spans} m, the route {scene.route.length:.3g} m"
    )


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
    ).on_host()
    sky = environment_view(loaded.environment, viewmat, intrinsics, width, height)
    picture = encode_8bit(compose_over_sky(gbuffer, sky, loaded.gaussians.display_encoded))
    buffers: dict[str, Any] = {
        "depth": gbuffer.expected_depth,
        "surface_depth": gbuffer.depth,
        "alpha": gbuffer.alpha,
        "normal": gbuffer.normal,
        "class": gbuffer.class_id,
    }
    results = Outputs(out, "scene render", "rgb.png", *(f"{name}.npy" for name in buffers))
    results.write("rgb.png", encode_png(picture))
    for name, buffer in buffers.items():
        content = BytesIO()
        np.save(content, buffer)
        results.write(f"{name}.npy", content.getvalue())
    return {"picture": str(results.path("rgb.png")), "backend": engine.name, "width": width, "height": height}


def _read_pose(pose: str) -> tuple[np.ndarray, np.ndarray, int, int]:
    content = parse_json(read_content(Path(pose), "pose", LARGEST_POSE), pose, "pose")
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
