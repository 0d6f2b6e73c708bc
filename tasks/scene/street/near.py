"""What a clip comes near: how near, and how finer discs take the place of the street's own."""

from collections.abc import Sequence
from dataclasses import fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tasks.scene.gaussians import Gaussians

Floats = NDArray[np.float64]

_IN_VIEW = 0.8
"""Cosine of the angle from the camera's axis up to which a point counts as in view [1]."""


def measure_approach(point: Floats, T_world_camera: Floats) -> tuple[float, int]:
    """Return how near a camera comes to a point that it has in view, infinite where it never has [m], and the pose.

    Parameters
    ----------
    point : float64 [3] world [m]
    T_world_camera : float64 [F, 4, 4] its poses [m]
    """
    away = point - T_world_camera[:, :3, 3]
    ahead = np.einsum("fk,fk->f", away, T_world_camera[:, :3, 2])
    distance = np.linalg.norm(away, axis=1)
    seen = np.where(ahead > _IN_VIEW * distance, distance, np.inf)
    return float(seen.min()), int(seen.argmin())


def choose_cell(px: float, approach: float, focal_px: float, levels: Sequence[float]) -> float | None:
    """Return the smallest cell that is no finer than a camera resolves, or None where the street's own will do [m].

    Parameters
    ----------
    px : wanted size where the camera comes nearest [px]
    approach : how near it comes [m]
    focal_px : its focal length [px]
    levels : cells, the finest first, which also serves a camera that resolves more [m]
    """
    wanted = px * approach / focal_px
    return None if wanted > levels[-1] else next(level for level in levels if level >= wanted)


def replace_discs(gaussians: Gaussians, index: NDArray[np.int64], finer: list[Gaussians]) -> Gaussians:
    """Return the set without some of its Gaussians, and with finer ones last.

    Parameters
    ----------
    gaussians : of the street
    index : int64 [B] positions of those that go [1]
    finer : what comes in their place, with the same members
    """
    joined: dict[str, Any] = {}
    kept = np.delete(np.arange(len(gaussians)), index)
    for name in (member.name for member in fields(Gaussians)):
        if isinstance(value := getattr(gaussians, name), np.ndarray):
            parts = [value.take(kept, axis=0), *(getattr(one, name) for one in finer)]
            joined[name] = np.concatenate(parts)
    return replace(gaussians, **joined)
