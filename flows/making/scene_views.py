"""Scenes looked at along their routes: a sheet of pictures, and the check of many scenes."""

from collections.abc import Iterator
from math import isnan
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from catalogs.entries import load
from catalogs.scenes import find_recipe, load_scene
from catalogs.scenes.street import STREET_FILE, load_street_layout
from catalogs.street_names import KINDS
from flows.running.progress import progress_bar
from flows.store.outputs import Outputs
from tasks.errors import InputError
from tasks.render.composition import compose_over_sky, encode_8bit
from tasks.render.contact_sheet import draw_picture_sheet, encode_png
from tasks.render.environment import environment_view
from tasks.render.rasterise.backend import select_backend
from tasks.scene.scene import Scene
from tasks.scene.soundness import find_faults, measure_soundness
from tasks.scene.street.build import build_street
from tasks.scene.street.layout import EYE_HEIGHT

SEEDS = 4
"""Streets of each kind where none are named [1]."""
SHOWN = (0.05, 0.35, 0.65)
"""Places of the pictures, as shares of the route [1]."""
SHEET, SMALL = (480, 320), (120, 80)
"""Width and height of the pictures of a sheet, and of those that are checked and compared [px]."""
GRAIN = (24, 16)
"""Width and height of the pictures in which streets are compared: what they show, not how they are textured [px]."""
STEP = 1.0
"""Way between two pictures of one station of a street [m]."""
SEEN, MOST_HOLES = 0.5, 0.002
"""Opacity below which a pixel of the road is a hole, and the share of such pixels [1]."""
AHEAD = (4.0, 40.0)
"""Nearest and farthest road that is looked at for holes [m]."""


def show_scenes(
    scenes: list[str] | None = None, *, out: str, streets: int = SEEDS, backend: str = "auto"
) -> dict[str, Any]:
    """Draw a sheet with a row of pictures of each scene along its route.

    Parameters
    ----------
    scenes : names or folders; None takes the first streets of every kind
    streets : how many streets of every kind, where none are named [1]
    out : folder for gallery.png
    backend : rasteriser

    Returns
    -------
    ``scenes``, how many, and ``picture``, the file

    Raises
    ------
    InputError
        If a scene is missing or damaged, or no street is asked for.
    """
    results = Outputs(out, "scene gallery", "gallery.png")
    names = scenes or list_streets(streets)
    rows = []
    with progress_bar("scenes", len(names)) as advance:
        for name, scene in _open_scenes(names):
            stations = [share * scene.route.length for share in SHOWN]
            pictures = [picture for picture, _ in _look(scene, stations, SHEET, backend)]
            captions = [name, *(f"{station:.0f} m" for station in stations[1:])]
            rows.append(list(zip(captions, pictures, strict=True)))
            advance(name)
    results.write("gallery.png", encode_png(draw_picture_sheet(rows)))
    return {"scenes": len(names), "picture": str(results.path("gallery.png"))}


def check_scenes(
    scenes: list[str] | None = None, *, out: str | None = None, streets: int = SEEDS, backend: str = "auto"
) -> dict[str, Any]:
    """Check scenes for holes, for what floats or stands in the way, for a route off the road, and for their scale.

    Of several scenes it also says how much each differs from the one most like it, in small pictures, over what one
    metre of way changes in its own pictures.

    Parameters
    ----------
    scenes : names or folders; None takes the first streets of every kind
    streets : how many streets of every kind, where none are named [1]
    out : folder for check.json
    backend : rasteriser

    Returns
    -------
    ``sound``, ``scenes[]`` with the figures and ``faults`` of each, ``faults`` in all, ``least_ratio`` of the
    differences, None for one scene

    Raises
    ------
    InputError
        If a scene is missing or damaged, or no street is asked for.
    """
    results = Outputs(out, "scene check", "check.json")
    names = scenes or list_streets(streets)
    limit = load("table of physical limits").road_grade.value
    rows: list[dict[str, Any]] = []
    grains: list[NDArray[np.float64]] = []
    with progress_bar("scenes", len(names)) as advance:
        for name, scene in _open_scenes(names):
            row, grain = check_scene(scene, limit, backend)
            rows.append({"scene": name, **row})
            grains.append(grain)
            advance(name, failed=bool(row["faults"]))
    ratios = compare_streets(np.stack(grains)) if len(names) > 1 else None
    if ratios is not None:
        for row, ratio, other in zip(rows, *ratios, strict=True):
            row |= {"ratio": float(ratio), "most_like": names[int(other)]}
    result = {
        "sound": not any(row["faults"] for row in rows),
        "scenes": rows,
        "faults": sum(len(row["faults"]) for row in rows),
        "least_ratio": None if ratios is None else float(ratios[0].min()),
    }
    results.write_json("check.json", result)
    return result


def check_scene(
    scene: Scene, steepest_grade: float, backend: str
) -> tuple[dict[str, Any], NDArray[np.float64]]:
    """Return the figures and faults of a scene, and its small pictures [station, 2, h, w, 3] a metre apart.

    Parameters
    ----------
    scene : the scene
    steepest_grade : limit [1]
    backend : rasteriser
    """
    figures = measure_soundness(scene)
    faults = find_faults(figures, steepest_grade)
    stations = [share * (scene.route.length - STEP) for share in SHOWN]
    views = list(_look(scene, [s + step for s in stations for step in (0.0, STEP)], SMALL, backend))
    holes = float(np.mean([hole for _, hole in views[::2]]))
    if holes > MOST_HOLES:
        faults.append(f"at most {MOST_HOLES:.1%} of the road that is seen may be holes; {holes:.2%} is")
    grain = np.stack([_coarsen(picture) for picture, _ in views]).reshape(len(stations), 2, *GRAIN[::-1], 3)
    known = {name: None if isnan(value) else value for name, value in figures.items()}
    return {**known, "holes": holes, "faults": faults}, grain


def compare_streets(grains: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return each street's difference to the one most like it over its own within a metre [N] [1], and which that is.

    Parameters
    ----------
    grains : small pictures of `check_scene`, [N, station, 2, h, w, 3]
    """
    within = np.sqrt(np.mean((grains[:, :, 0] - grains[:, :, 1]) ** 2, axis=(1, 2, 3, 4)))
    flat = grains[:, :, 0].reshape(len(grains), -1)
    between = np.sqrt(np.mean((flat[:, None] - flat[None]) ** 2, axis=2))
    np.fill_diagonal(between, np.inf)
    return between.min(axis=1) / np.median(within), between.argmin(axis=1)


def list_streets(count: int) -> list[str]:
    """Return the names of the first streets of every kind, so many of each [1]."""
    if count < 1:
        raise InputError(f"streets must be 1 or more; it is {count}")
    return [f"{kind}-{seed}" for kind in KINDS for seed in range(count)]


def _open_scenes(names: list[str]) -> Iterator[tuple[str, Scene]]:
    """Yield each scene; one that muSync makes is made here and not kept, since many are looked at once."""
    for name in names:
        recipe = find_recipe(name)
        if recipe is None:
            yield name, load_scene(name)
            continue
        changes, seed = recipe
        yield name, build_street(load_street_layout(STREET_FILE, *changes, seed=seed), seed)


def _look(
    scene: Scene, stations: list[float], size: tuple[int, int], backend: str
) -> Iterator[tuple[NDArray[np.uint8], float]]:
    """Yield the picture from each station, uint8 [H, W, 3], and the share of its road that is a hole [1]."""
    if scene.route.length < AHEAD[0]:
        raise InputError(
            f"scene {scene.name}: its route must be {AHEAD[0]:g} m long; it is {scene.route.length:.1f} m"
        )
    engine = select_backend(backend)
    cloud = engine.prepare_gaussians(scene.gaussians)
    width, height = size
    focal = 0.83 * width
    K = np.array([[focal, 0, width / 2], [0, focal, height / 2], [0, 0, 1]])
    T_rig_camera = np.array([[0.0, 0, 1, 0], [-1, 0, 0, 0], [0, -1, 0, EYE_HEIGHT], [0, 0, 0, 1]])
    for station in stations:
        viewmat = np.linalg.inv(scene.route.pose(station) @ T_rig_camera)
        buffer = engine.rasterise_view(cloud, viewmat, K, width, height)
        sky = environment_view(scene.environment, viewmat, K, width, height)
        picture = encode_8bit(compose_over_sky(buffer, sky, scene.gaussians.display_encoded))
        yield picture, _measure_holes(scene, station, viewmat, K, buffer.alpha)


def _measure_holes(
    scene: Scene,
    station: float,
    viewmat: NDArray[np.float64],
    K: NDArray[np.float64],
    alpha: NDArray[np.float32],
) -> float:
    """Return the share of the carriageway's pixels that are not opaque [1]; 0 where none is seen.

    The outermost pixel is left out: at its edge, and on a crest, the sky shares it.
    """
    ahead = np.arange(station + AHEAD[0], min(station + AHEAD[1], scene.route.length), 0.5)
    poses = scene.route.pose(ahead)
    edges = np.array([scene.carriageway_right + 0.3, scene.carriageway_left - 0.3])
    points = poses[:, None, :3, 3] + edges[None, :, None] * poses[:, None, :3, 1]
    x, y, z = np.moveaxis(points @ viewmat[:3, :3].T + viewmat[:3, 3], -1, 0)
    pixels = (
        np.stack([K[0, 0] * x / z + K[0, 2], K[1, 1] * y / z + K[1, 2]], axis=-1).round().astype(np.int32)
    )
    road = np.zeros(alpha.shape, np.uint8)
    for k in np.flatnonzero((z[1:] > 1).all(axis=1) & (z[:-1] > 1).all(axis=1)):
        cv2.fillConvexPoly(road, np.stack([*pixels[k], *pixels[k + 1][::-1]]), 1)
    inside = cv2.erode(road, np.ones((3, 3), np.uint8), borderValue=1).astype(bool)
    return float(np.mean(alpha[inside] < SEEN)) if inside.any() else 0.0


def _coarsen(picture: NDArray[np.uint8]) -> NDArray[np.float64]:
    """Return the picture in `GRAIN`, display values 0 to 1."""
    width, height = GRAIN
    blocks = picture.reshape(height, picture.shape[0] // height, width, picture.shape[1] // width, 3)
    return blocks.mean(axis=(1, 3)) / 255.0
