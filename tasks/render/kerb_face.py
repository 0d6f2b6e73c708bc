"""Faces of kerbs beside a road that sinks: continued down to the road, so that nobody sees under the pavement."""

from dataclasses import fields, replace
from typing import Any

import numpy as np

from tasks.conventions import SemanticClass
from tasks.render.road_edit import RoadRelief
from tasks.render.weather.scene_light import append_gaussians
from tasks.scene.gaussians import Gaussians

STEEPEST_TOP = 0.5
"""Upward part of a normal below which a kerb's Gaussian belongs to its face: 60 deg steep [1]."""
FACE_HEIGHT_M = 0.1
"""Height that a kerb's face surely has, by which its copies are moved down; kerbs stand 0.1 to 0.15 m high [m]."""
REACH = 2.0
"""Extent of a Gaussian along the road, in standard deviations, over which the road must not lie lower than the face."""


def extend_kerbs(gaussians: Gaussians, relief: RoadRelief) -> Gaussians:
    """Return the street with copies of the kerbs' faces below these, as far down as the road sinks.

    Parameters
    ----------
    gaussians : the street
    relief : the road feature

    Returns
    -------
    Gaussians
        Copies come last; the others are bitwise unchanged. Beside a hump and a flat road there are none.
    """
    kerb = np.flatnonzero(gaussians.class_id == SemanticClass.KERB)
    station = relief.route.project(gaussians.means[kerb])[0]
    up = relief.route.pose(np.clip(station, 0, relief.route.length))[:, :3, 2]
    reach = REACH * gaussians.scales[kerb].max(axis=1)
    sunk = -np.min([relief.elevation(station + shift) for shift in (-reach, 0.0, reach)], axis=0)
    face = (sunk > 0) & (np.abs((gaussians.normals[kerb] * up).sum(axis=1)) < STEEPEST_TOP)
    if not face.any():
        return gaussians
    kerb, up, sunk = kerb[face], up[face], sunk[face]
    copies = np.ceil(sunk / FACE_HEIGHT_M).astype(np.int64)
    source = np.repeat(np.arange(len(kerb)), copies)
    number = np.arange(len(source)) - np.repeat(np.cumsum(copies) - copies, copies) + 1
    taken: dict[str, Any] = {
        member.name: value[kerb[source]]
        for member in fields(Gaussians)
        if isinstance(value := getattr(gaussians, member.name), np.ndarray)
    }
    down = (sunk[source] * number / copies[source])[:, None] * up[source]
    taken["means"] = (taken["means"] - down).astype(np.float32)
    return append_gaussians(gaussians, replace(gaussians, **taken))
