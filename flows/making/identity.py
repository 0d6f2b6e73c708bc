"""Ids of clips and runs: hashes of all that decides the bytes, which anybody can compute again from a record."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from catalogs.grids import GridFile
from catalogs.grids.form import BEFORE
from catalogs.road_grade import SCENE_GRADES, name_grade_file
from manifests.canonical import content_id


def list_deciding(
    settings: GridFile,
    scene: Mapping[str, Any],
    inputs: Mapping[str, str],
    backend: str,
    scenes: Sequence[Mapping[str, Any]] = (),
) -> dict[str, Any]:
    """Return what decides the bytes of a run.

    Parameters
    ----------
    settings : of the grid
    scene : name and hash of its scene
    scenes : of a run with several, name and hash of each
    inputs : name of each catalogue file to its SHA-256
    backend : rasteriser
    """
    later = {name: getattr(settings, name) for name in BEFORE}
    if not settings.keeps_stops_steady:
        later["low_speed"] = BEFORE["low_speed"]
    # among the inputs, and only where a scenario has a feature
    later["hazard_marking"] = BEFORE["hazard_marking"]
    if not settings.grips_by_speed:
        later["wet_friction"] = BEFORE["wet_friction"]
    return {
        "scene": dict(scene),
        **({"scenes": [dict(one) for one in scenes]} if scenes else {}),
        "inputs": dict(inputs),
        "backend": backend,
        "vehicle_mode": settings.vehicle_mode,
        "frames": settings.frames,
        "frame_rate_hz": settings.frame_rate_hz,
        **{name: value for name, value in later.items() if value != BEFORE[name]},
    }


def narrow_deciding(deciding: Mapping[str, Any], scene: Mapping[str, Any]) -> dict[str, Any]:
    """Return what decides the bytes of a clip: of several scenes its own alone, so that others do not change its id.

    Parameters
    ----------
    deciding : of `list_deciding`
    scene : of the clip
    """
    if "scenes" not in deciding:
        return dict(deciding)
    grade = name_grade_file(scene["name"])
    inputs = {
        name: digest
        for name, digest in deciding["inputs"].items()
        if name == grade or not name.startswith(SCENE_GRADES)
    }
    kept = {name: value for name, value in deciding.items() if name != "scenes"}
    return kept | {"scene": dict(scene), "inputs": inputs}


def identify_clip(deciding: Mapping[str, Any], scenario: Mapping[str, Any], seed: str) -> str:
    """The id of a clip.

    Parameters
    ----------
    deciding : of `narrow_deciding`
    scenario, seed : of the clip
    """
    return content_id([deciding, scenario, seed])


def identify_run(
    deciding: Mapping[str, Any],
    grid: Mapping[str, Any],
    clip_ids: Iterable[str],
    made_with: Mapping[str, Any],
) -> str:
    """The id of a run.

    Parameters
    ----------
    deciding : of `list_deciding`
    grid : settings as they are recorded
    clip_ids : of its clips, in their order
    made_with : code and libraries
    """
    return content_id([deciding, grid, list(clip_ids), made_with])
