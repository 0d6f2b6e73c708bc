"""The bodywork of a car: a skin lofted over its outline, with glass, lamps, plates and reflections in the lacquer."""

import numpy as np
from numpy.typing import NDArray

from tasks.conventions import SemanticClass
from tasks.scene.street import palette
from tasks.scene.street.cars.shapes import Shape, cross_section
from tasks.scene.street.surfels import Surfels, graded_cells, sheet_cells, tile_surface

Floats = NDArray[np.float64]

WHEEL = 0.315
"""Radius of a wheel [m]."""
_BUMPER = 0.42
_SECTION_LENGTHS = np.array([0.14, 0.2, 0.3, 0.08, 0.42, 0.14, 0.62])
"""Usual lengths of the pieces of half a cross-section [m]."""
_LAMP, _PLATE = 0.56, 0.29
"""Inner edge of the lamps and half width of the number plate, over half the car's width [1]."""
_LACQUER, _GLASS = 0.045, 0.10
"""Reflectance at normal incidence of clear coat (index 1.5) and of the two faces of a pane [1]."""
_MOST_MIRRORED = 0.55
_DARK, _BLACK = np.full(3, 0.012), np.full(3, 0.006)
_SKY, _HOUSES, _ROAD = (
    np.array([0.42, 0.52, 0.68]),
    np.array([0.16, 0.15, 0.14]),
    np.array([0.13, 0.13, 0.125]),
)


def build_bodywork(shape: Shape, cell: Floats, paint: Floats, eye: Floats) -> Surfels:
    """Build the skin from sill to sill over the roof, class vehicle, in the car's axes: x from the tail, y left, z up.

    Parameters
    ----------
    shape : the car
    cell : largest length and height of a cell [m]
    paint : [3] reflectance [1]
    eye : [3] where it is mostly seen from, for the mirror images [m]
    """
    place = np.concatenate(
        [shape.roof[:, 0], shape.belt[:, 0], shape.glass, shape.pillar + np.array([-0.012, 0.012])]
    )
    _, width, _ = graded_cells(np.unique(place) * shape.length, cell[0], 1.0)
    x = np.concatenate([[0.0], np.cumsum(width)])
    keys = cross_section(shape, x / shape.length)
    counts = np.maximum(np.ceil(_SECTION_LENGTHS / (1.25 * cell[1])), 1).astype(int)
    half = np.concatenate([k + np.arange(n) / n for k, n in enumerate(counts)] + [[float(len(counts))]])
    right = np.stack([[np.interp(half, np.arange(len(counts) + 1), row) for row in key.T] for key in keys])
    outline = np.concatenate([right * [[-1], [1]], right[:, :, -2::-1]], axis=2)
    corners = np.stack(
        [np.broadcast_to(x[:, None], outline[:, 0].shape), outline[:, 0], outline[:, 1]], axis=-1
    )
    centre, edge_u, edge_v = sheet_cells(corners)
    segment = np.repeat(np.arange(len(counts)), counts)
    segment = np.concatenate([segment, segment[::-1]])
    along, z = centre[..., 0] / shape.length, centre[..., 2]
    roof, belt = (np.interp(along, *line.T) for line in (shape.roof, shape.belt))
    rise = np.abs(edge_u[..., 2]) / edge_u[..., 0]

    pane = (segment == 4) & (along > shape.glass[0]) & (along < shape.glass[1]) & (roof - belt > 0.16)
    pane &= np.abs(along - shape.pillar) > 0.012
    pane |= (segment == 6) & (rise > 0.3) & (z > belt + 0.05) & (z < shape.roof[:, 1].max() - 0.03)
    arch = np.zeros(z.shape, dtype=bool)
    for axle in shape.axles:
        arch |= (segment <= 2) & (np.hypot((along - axle) * shape.length, z - WHEEL) < WHEEL + 0.06)
    lower = (segment == 0) & ~arch
    red = (along < 0.045) & (segment >= 2) & (segment <= 3) & ~arch
    white = (along > 0.93) & (segment >= 2) & (segment <= 3)
    seam = (segment < 4) & (np.abs(along - shape.pillar) < 0.014)

    albedo = np.broadcast_to(paint, centre.shape)
    for chosen, colour in (
        (lower, palette.PLASTIC), (seam, 0.45 * paint), (red, palette.TAIL_LIGHT), (white, palette.HEAD_LIGHT),
        (pane, _DARK), (arch, _BLACK),
    ):  # fmt: skip
        albedo = np.where(chosen[..., None], colour, albedo)
    gloss = np.where(arch | lower, 0.0, np.where(pane, _GLASS, _LACQUER))
    openness = np.where(arch, 0.15, np.clip(0.25 + 1.1 * z, 0.0, 1.0))
    glow = _mirrored_radiance(centre, edge_u, edge_v, gloss, eye)
    return tile_surface(centre, edge_u, edge_v, SemanticClass.VEHICLE, albedo, glow=glow, openness=openness)


def build_car_ends(shape: Shape, cell: Floats, paint: Floats, eye: Floats) -> list[Surfels]:
    """Build tail and nose, with lamps, number plates, bumpers and grille; parameters as `build_bodywork`."""
    parts = []
    for along, outward in ((0.0, -1.0), (1.0, 1.0)):
        half_width, height = cross_section(shape, np.array([along]))[0, :6].T
        belt, roof = height[4], height[5]
        plate = (0.54, 0.66) if outward < 0 else (0.40, 0.51)
        lamp = (belt - 0.22, belt - 0.05)
        window = (belt + 0.08, roof - 0.12, roof) if roof > belt + 0.3 else ()
        rows = np.unique([height[0], _BUMPER, *plate, *lamp, belt, *window])
        _, step, _ = graded_cells(rows, cell[1], 1.0)
        z = height[0] + np.concatenate([[0.0], np.cumsum(step)])
        _, step, _ = graded_cells([-1.0, -_LAMP, -_PLATE, _PLATE, _LAMP, 1.0], 2 * cell[1] / shape.width, 1.0)
        across = np.concatenate([[0.0], np.cumsum(step)])[:, None] - 1
        y = outward * across * np.interp(z, height, half_width)
        x = along * shape.length + outward * 0.09 * (1 - across**2) + 0 * z
        centre, edge_u, edge_v = sheet_cells(np.stack([x, y, np.broadcast_to(z, y.shape)], axis=-1))
        side, z = np.abs(centre[..., 1]) / (shape.width / 2), centre[..., 2]
        light = (side > _LAMP) & (z > lamp[0]) & (z < lamp[1])
        number = (side < _PLATE) & (z > plate[0]) & (z < plate[1])
        pane = (side < 0.8) & (z > belt + 0.08) & (z < roof - 0.12)
        grille = (outward > 0) & (side < _LAMP) & (z > 0.34) & (z < 0.60) & ~number
        albedo = np.broadcast_to(paint, centre.shape)
        for chosen, colour in (
            (z < _BUMPER, palette.PLASTIC), (grille, palette.PLASTIC), (number, palette.NUMBER_PLATE),
            (light, palette.TAIL_LIGHT if outward < 0 else palette.HEAD_LIGHT), (pane, _DARK),
        ):  # fmt: skip
            albedo = np.where(chosen[..., None], colour, albedo)
        gloss = np.where(z < _BUMPER, 0.0, np.where(pane, _GLASS, _LACQUER))
        glow = _mirrored_radiance(centre, edge_u, edge_v, gloss, eye)
        openness = np.clip(0.2 + 1.1 * z, 0.0, 1.0)
        parts.append(
            tile_surface(centre, edge_u, edge_v, SemanticClass.VEHICLE, albedo, glow=glow, openness=openness)
        )
    return parts


def _mirrored_radiance(centre: Floats, edge_u: Floats, edge_v: Floats, gloss: Floats, eye: Floats) -> Floats:
    """Return the radiance [..., 3] mirrored towards the eye, after Schlick (1994), doi:10.1111/1467-8659.1330233."""
    normal = np.cross(edge_u, edge_v)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    view = eye - centre
    view /= np.linalg.norm(view, axis=-1, keepdims=True)
    cosine = np.clip((normal * view).sum(axis=-1), 0.0, 1.0)
    up = (2 * cosine[..., None] * normal - view)[..., 2:]
    share = gloss + (1 - gloss) * (1 - cosine) ** 5 * (gloss > 0)
    sky = np.clip((up - 0.30) / 0.25, 0.0, 1.0)
    road = np.clip(-up / 0.1 + 0.5, 0.0, 1.0)
    around = (_HOUSES * (1 - sky) + _SKY * sky) * (1 - road) + _ROAD * road
    return np.minimum(share, _MOST_MIRRORED)[..., None] * around
