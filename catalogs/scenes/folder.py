"""A scene folder: one .npy file per array, and scene.json with what they are and their hashes."""

import hashlib
import json
import re
import secrets
import shutil
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from catalogs.documents import parse_json
from catalogs.scenes.array_files import open_regular, read_array
from catalogs.sentences import shorten_value
from tasks.conventions import ROAD_CLASSES
from tasks.errors import InputError
from tasks.scene.gaussians import Gaussians, check_gaussians
from tasks.scene.route import Route
from tasks.scene.scene import LOWEST_SUN_DEG, Scene, find_sun_problems

SCENE_FORMAT = "musync-scene/1"
GAUSSIAN_ARRAYS = ("means", "quats_wxyz", "scales", "opacities", "sh", "normals", "class_id")
OPTIONAL_ARRAYS = ("surroundings", "light")
BLENDING_RULES = ("antialiased", "display_encoded")
SCENE_ARRAYS = (*GAUSSIAN_ARRAYS, "station", "T_world_rig", "environment")
SHAPES: dict[str, tuple[type[np.generic], tuple[int | None, ...]]] = {
    "means": (np.float32, (None, 3)),
    "quats_wxyz": (np.float32, (None, 4)),
    "scales": (np.float32, (None, 3)),
    "opacities": (np.float32, (None,)),
    "sh": (np.float32, (None, None, 3)),
    "normals": (np.float32, (None, 3)),
    "class_id": (np.uint8, (None,)),
    "surroundings": (np.float32, (None, 2)),
    "light": (np.float32, (None, 4)),
    "station": (np.float64, (None,)),
    "T_world_rig": (np.float64, (None, 4, 4)),
    "environment": (np.float32, (None, None, 3)),
}
"""Type and shape of every array; None where any length goes."""
LONGEST_FACTS = 2**20
"""Bytes of scene.json [1]."""
LONGEST_NAME = 255
"""Characters of a scene's name [1]: that of its folder when it was made."""
DIGEST = re.compile("[0-9a-f]{64}")
FARTHEST_EDGE = 1000.0
"""Greatest distance of a carriageway's edge from the route [m]."""
ARRAY_FILES, OPTIONAL_FILES = (
    tuple(f"{name}.npy" for name in names) for names in (SCENE_ARRAYS, OPTIONAL_ARRAYS)
)


def write_scene(scene: Scene, folder: Path, facts: dict[str, Any]) -> None:
    """Write a scene beside its target, then rename it there.

    Parameters
    ----------
    scene : the scene
    folder : new or empty folder
    facts : further entries of scene.json, such as held-out figures, source and licence

    Raises
    ------
    InputError
        If the folder holds other files.
    """
    must_be_new(folder)
    partial = folder.with_name(f"{folder.name}.{secrets.token_hex(4)}.partial")
    partial.mkdir(parents=True)
    try:
        for name, array in _list_arrays(scene).items():
            np.save(partial / f"{name}.npy", np.ascontiguousarray(array), allow_pickle=False)
        content = {
            "format": SCENE_FORMAT,
            "name": scene.name,
            "gaussians": len(scene.gaussians),
            "route_length_m": scene.route.length,
            "road_share": float(np.isin(scene.gaussians.class_id, ROAD_CLASSES).mean()),
            "held_out_psnr_db": None,
            **{name: getattr(scene.gaussians, name) for name in BLENDING_RULES},
            "carriageway_left": scene.carriageway_left,
            "carriageway_right": scene.carriageway_right,
            "sha256": {path.name: _file_hash(path) for path in sorted(partial.glob("*.npy"))},
        }
        if scene.sun_direction_deg is not None:
            content["sun_direction_deg"] = list(scene.sun_direction_deg)
        if scene.daylight is not None:
            content["daylight"] = list(map(list, scene.daylight))
        (partial / "scene.json").write_text(json.dumps(content | facts, indent=1, sort_keys=True) + "\n")
        if folder.exists():
            folder.rmdir()
        partial.rename(folder)
    finally:
        shutil.rmtree(partial, ignore_errors=True)


def must_be_new(folder: Path) -> None:
    """Raise `InputError` if the folder holds anything, or is none of its own."""
    if folder.is_symlink():
        raise InputError(f"{folder}: must be a new or empty folder; it is a link: give the folder itself")
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise InputError(f"{folder}: must be a new or empty folder; it holds other files")


def read_scene(folder: Path) -> Scene:
    """Read a scene folder, and verify hashes, shapes and values.

    Raises
    ------
    InputError
        Naming every file at fault.
    """
    content = read_facts(folder)
    problems = array_damage(folder, content)
    if problems:
        raise InputError(problems)
    arrays: dict[str, Any] = {}
    for name in (*SCENE_ARRAYS, *(name for name in OPTIONAL_ARRAYS if f"{name}.npy" in content["sha256"])):
        try:
            arrays[name] = read_array(folder / f"{name}.npy", *SHAPES[name])
        except InputError as error:
            problems += error.problems
    if problems:
        raise InputError(problems)
    if not len(arrays["means"]):
        raise InputError(f"{folder}: a scene must hold at least one Gaussian; it holds none")
    sky = arrays["environment"]
    if not sky.size or not np.isfinite(sky).all():
        raise InputError(
            f"{folder / 'environment.npy'}: must be a picture [H, W, 3] of finite numbers;"
            f" its shape is {sky.shape}"
        )
    gaussians = Gaussians(
        **{name: arrays[name] for name in (*GAUSSIAN_ARRAYS, *OPTIONAL_ARRAYS) if name in arrays},
        **{name: content[name] for name in BLENDING_RULES},
    )
    check_gaussians(gaussians, str(folder))
    return Scene(
        name=content["name"],
        gaussians=gaussians,
        route=Route(station=arrays["station"], T_world_rig=arrays["T_world_rig"]),
        environment=arrays["environment"],
        carriageway_left=content["carriageway_left"],
        carriageway_right=content["carriageway_right"],
        sun_direction_deg=None if (sun := content.get("sun_direction_deg")) is None else (sun[0], sun[1]),
        daylight=None if (rows := content.get("daylight")) is None else tuple((r, g, b) for r, g, b in rows),
    )


def array_damage(folder: Path, facts: dict[str, Any]) -> list[str]:
    """The arrays of a scene folder that are not those of its scene.json, a sentence each.

    Parameters
    ----------
    folder : of the scene
    facts : its scene.json
    """
    return [
        f"{folder / name}: must have the SHA-256 of scene.json;"
        f" {'it is missing, or no regular file' if digest is None else 'its bytes differ'}"
        for name, expected in sorted(facts["sha256"].items())
        if (digest := _file_hash(folder / name)) != expected
    ]


def scene_hash(folder: Path) -> str:
    """SHA-256 over the hashes of the scene's arrays and the facts that change its picture."""
    content = read_facts(folder)
    decisive = {
        key: content[key] for key in ("sha256", *BLENDING_RULES, "carriageway_left", "carriageway_right")
    }
    decisive |= {
        key: content[key] for key in ("sun_direction_deg", "daylight") if content.get(key) is not None
    }
    return hashlib.sha256(json.dumps(decisive, sort_keys=True).encode()).hexdigest()


def _list_arrays(scene: Scene) -> dict[str, NDArray[Any]]:
    names = (*GAUSSIAN_ARRAYS, *OPTIONAL_ARRAYS)
    held = {name: getattr(scene.gaussians, name) for name in names}
    arrays: dict[str, NDArray[Any]] = {name: array for name, array in held.items() if array is not None}
    return arrays | {
        "station": scene.route.station,
        "T_world_rig": scene.route.T_world_rig,
        "environment": scene.environment,
    }


def read_facts(folder: Path) -> dict[str, Any]:
    """The facts of scene.json, in their form.

    Raises
    ------
    InputError
        Listing every rule that it breaks.
    """
    path = folder / "scene.json"
    if not path.exists():
        raise InputError(f"{path}: no such file; is this a scene folder?")
    with open_regular(path) as stream:
        text = stream.read(LONGEST_FACTS + 1)
    if len(text) > LONGEST_FACTS:
        raise InputError(f"{path}: must have at most {LONGEST_FACTS} bytes; it has more")
    content = parse_json(text, path, "scene.json")
    if not isinstance(content, dict) or content.get("format") != SCENE_FORMAT:
        found = content.get("format") if isinstance(content, dict) else content
        raise InputError(f"{path}: the scene must be of format {SCENE_FORMAT}; it is {shorten_value(found)}")
    hashes = content.get("sha256")
    left, right = content.get("carriageway_left"), content.get("carriageway_right")
    rules = {
        f"name must be printable text of at most {LONGEST_NAME} characters": (
            isinstance(content.get("name"), str)
            and content["name"].isprintable()
            and len(content["name"]) <= LONGEST_NAME
        ),
        f"{' and '.join(BLENDING_RULES)} must be true or false": all(
            isinstance(content.get(name), bool) for name in BLENDING_RULES
        ),
        "carriageway_left and carriageway_right must be numbers [m], positive and negative, of at most"
        f" {FARTHEST_EDGE:g} m": (
            _is_number(left, FARTHEST_EDGE) and _is_number(right, FARTHEST_EDGE) and right < 0 < left  # type: ignore[operator]
        ),
        f"sun_direction_deg, where given, must be azimuth and elevation [deg], the latter {LOWEST_SUN_DEG:g} to 90": (
            _is_sun(content.get("sun_direction_deg"))
        ),
        "daylight must be three colours of three numbers above 0, beside light.npy and sun_direction_deg": (
            _is_daylight(content)
        ),
        f"sha256 must name {', '.join(ARRAY_FILES)}, may name {', '.join(OPTIONAL_FILES)}, and nothing else": (
            isinstance(hashes, dict) and set(ARRAY_FILES) <= set(hashes) <= {*ARRAY_FILES, *OPTIONAL_FILES}
        ),
        "sha256 must hold hashes of 64 hexadecimal digits": isinstance(hashes, dict)
        and all(isinstance(digest, str) and DIGEST.fullmatch(digest) for digest in hashes.values()),
    }
    problems = [f"{path}: {rule}; it is not so" for rule, kept in rules.items() if not kept]
    if problems:
        raise InputError(problems)
    return content


def _is_number(value: Any, most: float = 360.0) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= most


def _is_sun(value: Any) -> bool:
    """Whether an entry of scene.json is a sound direction of the sun, or none."""
    pair = isinstance(value, list) and len(value) == 2 and all(map(_is_number, value))
    return value is None or (pair and not find_sun_problems((value[0], value[1])))


def _is_daylight(content: dict[str, Any]) -> bool:
    """Whether scene.json says the light of `Gaussians.light`, or that there is none."""
    rows, hashes = content.get("daylight"), content.get("sha256")
    lit = isinstance(hashes, dict) and "light.npy" in hashes
    if rows is None or not lit:
        return rows is None and not lit
    return (
        isinstance(rows, list)
        and len(rows) == 3
        and all(isinstance(row, list) and len(row) == 3 for row in rows)
        and all(_is_number(value) and value > 0 for row in rows for value in row)
        and content.get("sun_direction_deg") is not None
    )


def _file_hash(path: Path) -> str | None:
    """SHA-256 of a regular file; None where there is none. Links are not followed."""
    try:
        with open_regular(path) as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest()
    except InputError:
        return None
