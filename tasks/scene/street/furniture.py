"""Lamp posts, signs, bollards, bins and a letter box."""

import numpy as np
from numpy.typing import NDArray

from tasks.conventions import SemanticClass
from tasks.scene.street import palette
from tasks.scene.street.layout import StreetLayout
from tasks.scene.street.noise import named_generator
from tasks.scene.street.plan import Plan
from tasks.scene.street.roadside import list_signs
from tasks.scene.street.surfels import Surfels, build_box, build_tube, join_surfels, tile_surface

Floats = NDArray[np.float64]

_POST_INSET = 0.45
"""Of posts from the kerb's edge [m]."""


def build_furniture(layout: StreetLayout, plan: Plan, seed: int) -> Surfels:
    """Build the surfels of the street furniture, classes pole and other.

    Parameters
    ----------
    layout : dimensions
    plan : positions of everything on the street
    seed : the street's seed [1]
    """
    return join_surfels([surfels for _, surfels in list_furniture(layout, plan, seed)])


def list_furniture(layout: StreetLayout, plan: Plan, seed: int) -> list[tuple[str, Surfels]]:
    """Build each piece of the street furniture; return its kind and its surfels.

    Parameters
    ----------
    layout : dimensions
    plan : positions of everything on the street
    seed : the street's seed [1]
    """
    pieces = [("lamp", join_surfels(_build_lamp(layout, station, side))) for station, side in plan.lamps]
    pieces += _build_crossing_signs(layout) if layout.has_crossing else []
    pieces += [("sign", sign) for sign in list_signs(layout, seed)]
    rng = named_generator(seed, "bins")
    for station, side in plan.lamps[::2] if layout.has_pavement else ():
        pieces.append(("bin", join_surfels(_build_bin(layout, station + rng.uniform(1.2, 2.2), side))))
    if layout.has_pavement:
        pieces.append(("letter box", _build_letter_box(layout, layout.crossing_station - 12.0)))
    return pieces


def post_boxes(layout: StreetLayout, plan: Plan) -> Floats:
    """Return the boxes [K, 2, 3] that cast the lamp posts' shadows [m]."""
    half = np.array([0.06, 0.06, 0.0])
    boxes = []
    for station, side in plan.lamps:
        foot = np.array([station, _post_line(layout, side), layout.kerb_height])
        boxes.append([foot - half, foot + half + [0, 0, layout.lamp_height]])
    return np.array(boxes).reshape(-1, 2, 3)


def _post_line(layout: StreetLayout, side: int) -> float:
    return layout.kerb_position(side) + side * (layout.kerb_width + _POST_INSET)


def _build_lamp(layout: StreetLayout, station: float, side: int) -> list[Surfels]:
    foot = np.array([station, _post_line(layout, side), layout.kerb_height])
    top = layout.lamp_height
    t, up = np.linspace(0, 1, 25)[:, None], np.array([0, 0, 1])
    pole, steel = SemanticClass.POLE, palette.METAL_DARK
    inward = np.array([0, -side, 0])
    reach = 1.5
    bend = np.linspace(0, np.pi / 2, 7)[:, None]
    arm = foot + top * up + 0.5 * ((1 - np.cos(bend)) * inward + np.sin(bend) * up)
    out = arm[-1] + np.linspace(0, reach - 0.5, 5)[1:, None] * inward
    head, half = out[-1] + 0.3 * inward, np.array([0.13, 0.38, 0.03])
    return [
        build_tube(foot + top * t[:4] * up, 0.10, 8, pole, steel),
        build_tube(foot + top * t[3:] * up, 0.075 - 0.03 * t[3:, 0], 6, pole, steel),
        build_tube(np.concatenate([arm, out]), 0.035, 6, pole, steel),
        build_box(head - half, head + half + up * 0.05, 0.13, pole, steel),
        tile_surface(
            head + np.array([[0, y, -0.035] for y in (-0.24, -0.08, 0.08, 0.24)]),
            [0, 0.16, 0],
            [0.2, 0, 0],
            pole,
            palette.HEAD_LIGHT,
        ),
    ]


def _build_crossing_signs(layout: StreetLayout) -> list[tuple[str, Surfels]]:
    """Build a sign at either end of the crossing, facing the traffic that keeps right, and bollards beside it."""
    pole, up = SemanticClass.POLE, np.array([0.0, 0.0, 1.0])
    start, stop = layout.crossing_station, layout.crossing_station + layout.crossing_length
    pieces = []
    for side, station, outward in ((-1, start - 0.5, -1.0), (1, stop + 0.5, 1.0)):
        foot = np.array([station, _post_line(layout, side), layout.kerb_height])
        post = build_tube(foot + np.linspace(0, 2.9, 16)[:, None] * up, 0.038, 6, pole, palette.METAL_GREY)
        board = _build_sign(foot + np.array([0.06 * outward, 0, 2.5]), outward)
        pieces.append(("sign", join_surfels([post, *board])))
        for s in (start - 1.6, start - 3.2, stop + 1.6, stop + 3.2):
            base = np.array([s, layout.kerb_position(side) + side * 0.4, layout.kerb_height])
            tube = build_tube(base + np.linspace(0, 0.9, 10)[:, None] * up, 0.05, 8, pole, _banded_albedo(10))
            pieces.append(("bollard", tube))
    return pieces


def _build_sign(middle: Floats, outward: float) -> list[Surfels]:
    """Build a pedestrian on a white triangle on blue (Vienna Convention, sign E,12), front and back."""
    n, edge = 15, 0.66
    grid = (np.arange(n) + 0.5) / n * 2 - 1
    a, b = np.meshgrid(grid, grid, indexing="ij")
    picture = np.tile(palette.SIGN_BLUE, (n, n, 1))
    for shape, colour in (
        ((np.abs(a) < 0.46 * (0.75 - b)) & (b > -0.6), palette.WHITE_PAINT),
        ((np.abs(a - 0.08 * b) < 0.13) & (b > -0.45) & (b < 0.15), palette.METAL_DARK),
        (np.maximum(np.abs(a), np.abs(b)) > 0.9, palette.WHITE_PAINT),
    ):
        picture[shape] = colour
    offset = np.stack([0 * a, outward * a * edge / 2, b * edge / 2], axis=-1)
    across, rise = np.array([0, outward * edge / n, 0]), np.array([0, 0, edge / n])
    back = middle - np.array([0.02 * outward, 0, 0])
    return [
        tile_surface(middle + offset, across, rise, SemanticClass.POLE, picture),
        tile_surface(back + offset, -across, rise, SemanticClass.POLE, palette.METAL_GREY),
    ]


def _banded_albedo(n: int) -> Floats:
    """Return the albedo [8, n - 1, 3] of a dark bollard with a light band near its top."""
    colour = np.tile(palette.METAL_DARK, (8, n - 1, 1))
    colour[:, -3:-1] = palette.WHITE_PAINT
    return colour


def _build_bin(layout: StreetLayout, station: float, side: int) -> list[Surfels]:
    foot = np.array([station, _post_line(layout, side), layout.kerb_height])
    other, green = SemanticClass.OTHER, palette.BIN_GREEN
    up = np.linspace(0.1, 0.95, 10)[:, None] * [0, 0, 1]
    lid = np.linspace(0, 1, 4)[:, None] * [0, 0, 0.12] + [0, 0, 0.95]
    return [
        build_tube(foot + up, 0.21, 12, other, green),
        build_tube(foot + lid, np.array([0.23, 0.22, 0.15, 0.02]), 12, other, 0.6 * green),
    ]


def _build_letter_box(layout: StreetLayout, station: float) -> Surfels:
    side = -1
    low = np.array([station, layout.pavement_end(side) + 0.35, layout.kerb_height + 0.25])
    return build_box(low, low + np.array([0.5, 0.4, 1.0]), 0.1, SemanticClass.OTHER, palette.POST_YELLOW)
