"""Flat Gaussians that tile surfaces, in route coordinates, before lighting."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tasks.conventions import SemanticClass

OVERLAP = 0.74
"""Standard deviation over cell size: below 0.7 the sky shows through, above 0.8 the picture becomes blurred."""
OPACITY = 0.985
"""Peak opacity: nearly opaque splats that close a pixel early leave up to a tenth of its light."""
_SHARP = 0.25
"""Largest cell beside a sharp edge of a panel over the others [1]."""
THICKNESS = 0.002
"""Standard deviation along the normal [m]."""


class Cover(NamedTuple):
    """Coverage of a surface by the Gaussians of its cells: standard deviation over cell size and peak opacity [1]."""

    overlap: float = OVERLAP
    opacity: float = OPACITY


CLOSED = Cover()
"""A surface through which nothing is seen."""


class Grain(NamedTuple):
    """Variation of a reflectance from cell to cell: the generator that draws it, and its relative deviation [1]."""

    rng: np.random.Generator
    deviation: float


@dataclass(frozen=True, kw_only=True)
class Surfels:
    """N flat Gaussians in route coordinates: station, lateral (left positive), height [m].

    Parameters
    ----------
    centre : float64 [N, 3] positions [m]
    axes : float64 [N, 3, 3] unit axes as rows, the last one the normal [1]
    scale : float64 [N, 2] standard deviations along the first two axes [m]
    albedo : float64 [N, 3] diffuse reflectance, linear light [1]
    glow : float64 [N, 3] radiance that does not depend on the incident light: reflections, lamps [1]
    openness : float64 [N] share of the ambient light that reaches the surfel past its own object [1]
    opacity : float64 [N] peak opacity [1]
    class_id : uint8 [N] `SemanticClass`
    """

    centre: NDArray[np.float64]
    axes: NDArray[np.float64]
    scale: NDArray[np.float64]
    albedo: NDArray[np.float64]
    glow: NDArray[np.float64]
    openness: NDArray[np.float64]
    opacity: NDArray[np.float64]
    class_id: NDArray[np.uint8]

    def __len__(self) -> int:
        return len(self.centre)


def join_surfels(parts: Sequence[Surfels]) -> Surfels:
    """Concatenate the surfels of the parts, in order; without parts there are none."""
    nothing = np.empty((0, 3))
    parts = parts or [tile_surface(nothing, nothing, nothing, SemanticClass.OTHER, nothing)]
    return Surfels(**{f.name: np.concatenate([getattr(p, f.name) for p in parts]) for f in fields(Surfels)})


def tile_surface(
    centre: ArrayLike,
    edge_u: ArrayLike,
    edge_v: ArrayLike,
    class_id: SemanticClass | NDArray[np.uint8],
    albedo: ArrayLike,
    *,
    glow: ArrayLike = 0.0,
    openness: ArrayLike = 1.0,
    cover: Cover = CLOSED,
) -> Surfels:
    """Build one surfel per cell of a surface; leading shapes broadcast and are flattened.

    Parameters
    ----------
    centre : [..., 3] middle of each cell [m]
    edge_u, edge_v : [..., 3] the cell's edges; their cross product points outward [m]
    class_id : one class, or one per cell
    albedo, glow : [..., 3] see `Surfels` [1]
    openness : [...] see `Surfels` [1]
    cover : size and opacity of each cell's Gaussian
    """
    p, u, v = (np.asarray(x, dtype=np.float64) for x in (centre, edge_u, edge_v))
    shape = np.broadcast_shapes(p.shape, u.shape, v.shape, np.shape(albedo))
    n = int(np.prod(shape[:-1]))
    p, u, v = (np.broadcast_to(x, shape).reshape(n, 3) for x in (p, u, v))
    length_u = np.linalg.norm(u, axis=1, keepdims=True)
    axis_u = u / length_u
    normal = np.cross(u, v)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    axis_v = np.cross(normal, axis_u)
    length_v = np.abs(np.einsum("ij,ij->i", v, axis_v))[:, None]
    return Surfels(
        centre=p,
        axes=np.stack([axis_u, axis_v, normal], axis=1),
        scale=cover.overlap * np.concatenate([length_u, length_v], axis=1),
        albedo=np.broadcast_to(np.asarray(albedo, dtype=np.float64), shape).reshape(n, 3),
        glow=np.broadcast_to(np.asarray(glow, dtype=np.float64), shape).reshape(n, 3),
        openness=np.broadcast_to(np.asarray(openness, dtype=np.float64), shape[:-1]).reshape(n),
        opacity=np.broadcast_to(np.asarray(cover.opacity, dtype=np.float64), shape[:-1]).reshape(n),
        class_id=np.broadcast_to(np.asarray(class_id, dtype=np.uint8), shape[:-1]).reshape(n),
    )


def sheet_cells(
    corners: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return centres and edges of the cells of a curved sheet given by its corner points.

    Parameters
    ----------
    corners : float64 [..., n + 1, m + 1, 3] lattice of points [m]

    Returns
    -------
    centre, edge_u, edge_v : float64 [..., n, m, 3] middle of each cell and its mean edges [m]
    """
    a, b = corners[..., :-1, :-1, :], corners[..., 1:, :-1, :]
    c, d = corners[..., :-1, 1:, :], corners[..., 1:, 1:, :]
    return (a + b + c + d) / 4, (b + d - a - c) / 2, (c + d - a - b) / 2


def graded_cells(
    breaks: ArrayLike, size: ArrayLike, fine: ArrayLike, growth: float = 0.7
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.int64]]:
    """Split a line at sharp edges into cells that grow away from them, so that the edges stay sharp.

    Parameters
    ----------
    breaks : [n + 1] increasing positions of the edges [m]
    size : [n] or scalar, largest cell of each interval, kept to within a quarter [m]
    fine : [n] or scalar, largest cell next to an edge over ``size``; from 1 on all cells have one size [1]
    growth : largest cell by the distance of its middle from the nearest edge [1]

    Returns
    -------
    centre, width : float64 [m] middle and width of each cell [m]
    interval : int64 [m] which interval of ``breaks`` the cell lies in
    """
    edges = np.asarray(breaks, dtype=np.float64)
    n = len(edges) - 1
    cuts, interval = [edges[:1]], []
    for k, (largest, share) in enumerate(
        zip(np.broadcast_to(size, n), np.broadcast_to(fine, n), strict=True)
    ):
        length = edges[k + 1] - edges[k]
        if share >= 1:
            inner = np.arange(1, int(np.ceil(length / (1.25 * largest)))) * largest
            inner *= length / (largest * (len(inner) + 1))
        else:
            inner = np.array(_halve_interval(length, largest, share, growth))
        cuts += [edges[k] + inner, edges[k + 1 : k + 2]]
        interval += [k] * (len(inner) + 1)
    cut = np.concatenate(cuts)
    return (cut[1:] + cut[:-1]) / 2, np.diff(cut), np.array(interval, dtype=np.int64)


def _halve_interval(length: float, largest: float, share: float, growth: float) -> list[float]:
    """Return inner cuts of an interval [m], halved until no cell is too large for its distance from the ends."""
    cuts, pending = [], [(0.0, length)]
    while pending:
        a, b = pending.pop()
        away = min((a + b) / 2, length - (a + b) / 2)
        if b - a > 1.25 * min(largest, max(share * largest, growth * away)):
            cuts.append((a + b) / 2)
            pending += [((a + b) / 2, b), (a, (a + b) / 2)]
    return sorted(cuts)


def build_tube(
    path: ArrayLike,
    radius: ArrayLike,
    around: int,
    class_id: SemanticClass,
    albedo: ArrayLike,
) -> Surfels:
    """Build a round tube along a path, open at both ends.

    Parameters
    ----------
    path : [n + 1, 3] its axis, from the foot up [m]
    radius : [n + 1] or scalar [m]
    around : cells around it [1]
    class_id : its class
    albedo : broadcast to [around, n, 3]; see `Surfels` [1]
    """
    axis = np.asarray(path, dtype=np.float64)
    run = np.gradient(axis, axis=0)
    run /= np.linalg.norm(run, axis=1, keepdims=True)
    helper = np.where(np.abs(run[:, 2:]) > 0.9, [1.0, 0.0, 0.0], [0.0, 0.0, 1.0])
    side = np.cross(helper, run)
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    other = np.cross(run, side)
    angle = 2 * np.pi * np.arange(around + 1)[:, None, None] / around
    thickness = np.broadcast_to(np.asarray(radius, dtype=np.float64), len(axis))[:, None]
    corners = axis + thickness * (np.cos(angle) * side + np.sin(angle) * other)
    return tile_surface(*sheet_cells(corners), class_id, albedo)


def build_panel(
    origin: ArrayLike,
    edge_u: ArrayLike,
    edge_v: ArrayLike,
    cell: float,
    class_id: SemanticClass,
    albedo: ArrayLike,
    *,
    grain: Grain | None = None,
    sharp: bool = False,
) -> Surfels:
    """Build a plain rectangle of square cells.

    Parameters
    ----------
    origin : [3] its first corner [m]
    edge_u, edge_v : [3] its sides; their cross product points outward [m]
    cell : largest cell [m]
    class_id : its class
    albedo : [3] see `Surfels` [1]
    grain : variation of the reflectance from cell to cell; None for an even colour
    sharp : the rectangle's own edges are sharp, by finer cells beside them
    """
    corner, u, v = (np.asarray(x, dtype=np.float64) for x in (origin, edge_u, edge_v))
    sides = [(edge, float(np.linalg.norm(edge))) for edge in (u, v)]
    cuts = [
        graded_cells((0.0, length), 0.8 * cell, _SHARP if sharp else 1.0, growth=1.5) for _, length in sides
    ]
    (a, wide), (b, high) = (
        (cut[0] / length, cut[1] / length) for cut, (_, length) in zip(cuts, sides, strict=True)
    )
    a, b, wide, high = (x[..., None] for x in np.broadcast_arrays(a[:, None], b, wide[:, None], high))
    tone = np.ones(a.shape)
    if grain is not None:
        tone += grain.deviation * grain.rng.standard_normal(a.shape)
    return tile_surface(
        corner + a * u + b * v,
        wide * u,
        high * v,
        class_id,
        np.asarray(albedo) * tone,
    )


def build_box(
    low: ArrayLike,
    high: ArrayLike,
    cell: float,
    class_id: SemanticClass,
    albedo: ArrayLike,
    grain: Grain | None = None,
) -> Surfels:
    """Build the four walls and the top of an upright box between two corners [3] [m]; parameters as `build_panel`."""
    a, b = np.asarray(low, dtype=np.float64), np.asarray(high, dtype=np.float64)
    x, y, z = np.diag(b - a)
    sides = (
        (a, x, z),
        (a + x, y, z),
        (a + x + y, -x, z),
        (a + y, -y, z),
        (a + z, x, y),
    )
    return join_surfels(
        [build_panel(origin, u, v, cell, class_id, albedo, grain=grain) for origin, u, v in sides]
    )
