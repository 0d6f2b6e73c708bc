"""Ids of clips and runs: hashes of all that decides the bytes, which anybody can compute again from a record."""

from collections.abc import Iterable, Mapping
from typing import Any

from catalogs.grids import GridFile
from catalogs.grids.form import BEFORE
from manifests.canonical import content_id


def list_deciding(
    settings: GridFile, scene: Mapping[str, Any], inputs: Mapping[str, str], backend: str
) -> dict[str, Any]:
    """Return what decides the bytes of every clip of a run alike.

    Parameters
    ----------
    settings : of the grid
    scene : its name and hash
    inputs : name of each catalogue file to its SHA-256
    backend : rasteriser
    """
    later = {name: getattr(settings, name) for name in BEFORE}
    if not settings.keeps_stops_steady:
        later["low_speed"] = BEFORE["low_speed"]
    if not settings.grips_by_speed:
        later["wet_friction"] = BEFORE["wet_friction"]
    return {
        "scene": dict(scene),
        "inputs": dict(inputs),
        "backend": backend,
        "vehicle_mode": settings.vehicle_mode,
        "frames": settings.frames,
        "frame_rate_hz": settings.frame_rate_hz,
        **{name: value for name, value in later.items() if value != BEFORE[name]},
    }


def identify_clip(deciding: Mapping[str, Any], scenario: Mapping[str, Any], seed: str) -> str:
    """The id of a clip.

    Parameters
    ----------
    deciding : of `list_deciding`
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
