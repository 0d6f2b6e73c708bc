"""Rigid bodies among a scene: prepared once in their own axes, and projected from wherever they stand.

A camera at ``viewmat`` sees a body at ``T_world_body`` as a camera at ``viewmat T_world_body`` sees it in body axes, so
that nothing of the body is computed again when it moves; only the normals of its splats turn back into the world.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tasks.render.rasterise.preparation import PreparedGaussians
from tasks.render.rasterise.projection import CLASS, CODES, NORMAL_X, NOTHING, RED, project_gaussians
from tasks.render.rasterise.view import View


@dataclass(frozen=True, kw_only=True)
class Shade:
    """Gaussians of the scene that bodies shade in one frame.

    Parameters
    ----------
    index : int64 [S] places in the cloud [1]
    share : float32 [S] by which their colours are multiplied [1]
    """

    index: NDArray[np.int64]
    share: NDArray[np.float32]


@dataclass(frozen=True, kw_only=True)
class PlacedBody:
    """A rigid cloud where it stands in one frame.

    Parameters
    ----------
    prepared : in body axes, as the backend prepares a cloud
    T_world_body : float64 [4, 4] [m]
    number : of the body in `GBuffer.object_id`, 1 to 65535 [1]
    """

    prepared: Any
    T_world_body: NDArray[np.float64]
    number: int


def project_bodies(bodies: Sequence[PlacedBody], view: View) -> NDArray[np.float32]:
    """Return the splat records of bodies, as `project_gaussians` does of a scene, float32 [V, 16].

    Parameters
    ----------
    bodies : prepared for the CPU, from `tasks.render.rasterise.preparation.prepare_gaussians`
    view : the camera
    """
    parts = [NOTHING]
    for body in bodies:
        records, _ = project_gaussians(body.prepared, replace(view, viewmat=view.viewmat @ body.T_world_body))
        R = body.T_world_body[:3, :3].astype(np.float32)
        x, y, z = records[:, NORMAL_X : NORMAL_X + 3].T.copy()
        records[:, NORMAL_X : NORMAL_X + 3] = (
            x[:, None] * R[:, 0] + y[:, None] * R[:, 1] + z[:, None] * R[:, 2]
        )
        records[:, CLASS] += np.float32(CODES * body.number)
        parts.append(records)
    return np.concatenate(parts)


def shade_records(
    records: NDArray[np.float32], slots: NDArray[np.int64], prepared: PreparedGaussians, shade: Shade
) -> None:
    """Multiply the colours of a scene's splat records by their share of light, in place.

    Parameters
    ----------
    records, slots : of the scene alone, from `project_gaussians`
    prepared : the scene
    shade : what bodies leave of its light
    """
    share = np.ones(len(prepared), np.float32)
    share[shade.index] = shade.share
    seen = share[prepared.order[slots]]
    dimmed = np.flatnonzero(seen != 1)
    records[dimmed, RED : RED + 3] *= seen[dimmed, None]
