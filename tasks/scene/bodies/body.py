"""A rigid body as Gaussians in its own axes: what a street, a moving road user or a label takes of one."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tasks.conventions import SemanticClass
from tasks.scene.bodies.solids import Discs, tangents
from tasks.scene.gaussians import Gaussians
from tasks.scene.spherical_harmonics import C0

Floats = NDArray[np.float64]

OVERLAP = 0.7
"""Standard deviation of a disc over its cell: below, a flat side shows its lattice [1]."""
OPACITY = 0.985
THICKNESS = 0.004
"""Standard deviation along the normal [m]."""


@dataclass(frozen=True, kw_only=True)
class Finish:
    """How a material looks.

    Parameters
    ----------
    albedo : [3] diffuse reflectance, linear light [1]
    gloss : reflectance at normal incidence; 0 mirrors nothing [1]
    """

    albedo: tuple[float, float, float]
    gloss: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Body:
    """N Gaussians in body axes: x forward, y left, z up, origin on the ground under the middle [m].

    Parameters
    ----------
    gaussians : places, axes, sizes, opacities, normals and class; their colour is ``albedo`` under light of 1
    albedo : float64 [N, 3] diffuse reflectance, linear light [1]
    gloss : float64 [N] reflectance at normal incidence, clear coat or glass; 0 mirrors nothing [1]
    openness : float64 [N] share of the ambient light that reaches a disc past its own body [1]
    size : length, width and height [m]
    """

    gaussians: Gaussians
    albedo: Floats
    gloss: Floats
    openness: Floats
    size: tuple[float, float, float]


def make_body(
    discs: Discs,
    finishes: Mapping[int, Finish],
    class_id: SemanticClass,
    size: tuple[float, float, float],
    openness: Floats,
) -> Body:
    """Return a body of discs.

    Parameters
    ----------
    discs : of its surface
    finishes : by the number of a material
    class_id : of every disc
    size : length, width and height [m]
    openness : [N] see `Body` [1]
    """
    first, second = tangents(discs.normal)
    axes = np.stack([first, second, discs.normal], axis=2)
    wide = OVERLAP * discs.cell
    albedo = np.zeros((len(discs), 3))
    gloss = np.zeros(len(discs))
    for number, finish in finishes.items():
        own = discs.material == number
        albedo[own], gloss[own] = finish.albedo, finish.gloss
    gaussians = Gaussians(
        means=discs.centre.astype(np.float32),
        quats_wxyz=Rotation.from_matrix(axes).as_quat(scalar_first=True).astype(np.float32),
        scales=np.stack([wide, wide, np.minimum(THICKNESS, wide / 2)], axis=1).astype(np.float32),
        opacities=np.full(len(discs), OPACITY, dtype=np.float32),
        sh=((albedo - 0.5) / C0).astype(np.float32)[:, None],
        normals=discs.normal.astype(np.float32),
        class_id=np.full(len(discs), class_id, dtype=np.uint8),
        antialiased=True,
    )
    return Body(gaussians=gaussians, albedo=albedo, gloss=gloss, openness=openness, size=size)


def join_discs(parts: list[Discs]) -> Discs:
    """Return the discs of all parts, in order."""
    return Discs(
        **{
            name: np.concatenate([getattr(part, name) for part in parts])
            for name in Discs.__dataclass_fields__
        }
    )


def mirror_discs(discs: Discs) -> Discs:
    """Return the discs and their images on the other side of the plane y = 0."""
    flip = np.array([1.0, -1.0, 1.0])
    return join_discs([discs, replace(discs, centre=discs.centre * flip, normal=discs.normal * flip)])
