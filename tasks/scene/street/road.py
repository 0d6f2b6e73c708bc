"""The cells of the carriageway: asphalt and markings, all in the plane of height zero."""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from tasks.conventions import SemanticClass
from tasks.scene.street.asphalt import asphalt_albedo, paint_albedo
from tasks.scene.street.layout import EYE_HEIGHT, PIXEL, StreetLayout, nearest_depth
from tasks.scene.street.noise import named_generator
from tasks.scene.street.surfels import Cover, Surfels, graded_cells, join_surfels, tile_surface

CELL = 6.3
"""Width of an asphalt cell where it is seen closest [px]."""
_COVER = Cover(0.8, 0.94)
"""Wide and slightly transparent cells. Where cells are smaller than a
pixel, opaque ones hide all behind them and the road seems to slide under a moving camera."""
_STONES = 32.0
"""Single light or dark stones where the road is seen closest [m-2]."""
_STONE = (0.055, 0.026)
"""Length and width of a stone with the gap around it [m]."""
_SLENDER = (2.0, 4.0)
"""Least and greatest length of a cell over its width: the road is seen foreshortened."""


def build_road(layout: StreetLayout, seed: int) -> Surfels:
    """Build the surfels of the carriageway, class road or marking, normals upward.

    Parameters
    ----------
    layout : dimensions
    seed : the street's seed [1]
    """
    first, last = layout.station_range
    begin = layout.crossing_station
    crossing = (begin, begin + layout.crossing_length) if layout.has_crossing else ()
    stops = [first, -2.0, *crossing, layout.route_length + 3.0]
    while stops[-1] < last:
        stops.append(min(stops[-1] + 0.6 * (stops[-1] - layout.route_length) + 2.0, last))
    stretches = [
        _lay_cells(layout, seed, start, stop, is_crossing=start in crossing[:1])
        for start, stop in pairwise(stops)
    ]
    s, d, length, width, mark = np.concatenate(stretches, axis=1)
    zero = np.zeros(len(s))
    grain = named_generator(seed, "road grain").standard_normal((len(s), 2))
    marked = mark > 0.5
    surface = tile_surface(
        np.stack([s, d, zero], axis=1),
        np.stack([length, zero, zero], axis=1),
        np.stack([zero, width, zero], axis=1),
        np.where(marked, SemanticClass.MARKING, SemanticClass.ROAD).astype(np.uint8),
        np.where(
            marked[:, None],
            paint_albedo(layout, seed, s, d, grain),
            asphalt_albedo(layout, seed, s, d, width, grain),
        ),
        cover=_COVER,
    )
    return join_surfels([surface, _build_stones(layout, seed)])


def _build_stones(layout: StreetLayout, seed: int) -> Surfels:
    """Build single light or dark stones: the sharp detail between the cells."""
    rng = named_generator(seed, "stones")
    half = 0.8 * layout.lane_width
    n = int(_STONES * 2 * half * layout.route_length)
    s = rng.uniform(0.0, layout.route_length + 6.0, n)
    d = half * np.sign(rng.uniform(-1, 1, n)) * rng.random(n) ** 1.15
    kept = ~_is_on_paint(layout, s, d)
    s, d = s[kept], d[kept]
    zero, grain = np.zeros(len(s)), rng.standard_normal((len(s), 2))
    albedo = asphalt_albedo(layout, seed, s, d, np.full(len(s), 0.05), grain * [0.2, 1.0])
    albedo = albedo * np.where(rng.random(len(s)) < 0.5, 0.42, 1.9)[:, None] * np.exp(0.2 * grain[:, :1])
    size = rng.uniform(0.7, 1.4, len(s))
    return tile_surface(
        np.stack([s, d, zero], axis=1),
        np.stack([_STONE[0] * size, zero, zero], axis=1),
        np.stack([zero, _STONE[1] * size, zero], axis=1),
        SemanticClass.ROAD,
        albedo,
        cover=Cover(0.5),
    )


def _lay_cells(
    layout: StreetLayout, seed: int, start: float, stop: float, *, is_crossing: bool
) -> NDArray[np.float64]:
    """Return station, lateral, length, width [m] and 1 for paint of each cell of one stretch, as rows."""
    rng = named_generator(seed, f"road {start:.3f}")
    breaks, kind = _cross_section(layout, is_crossing)
    nearest = nearest_depth(
        layout, start if start >= 0 else min(stop, 0.0) - 1e-9, (breaks[1:] + breaks[:-1]) / 2
    )
    columns = []
    for j, (d, width, k) in enumerate(zip(*graded_cells(breaks, CELL * PIXEL * nearest, 0.55), strict=True)):
        cell = CELL * PIXEL * nearest[k]
        length = cell * np.clip(nearest[k] / EYE_HEIGHT, *_SLENDER) * min(cell / width, 1.8)
        if kind[k] != "asphalt":
            length = layout.dash_length / max(round(layout.dash_length / length), 1)
        n = max(round((stop - start) / length), 1)
        length = (stop - start) / n
        if kind[k] == "asphalt" and j % 2:
            # running bond leaves smaller gaps than a chequerboard
            s = start + np.clip(np.arange(n + 1) * length, 0.25 * length, stop - start - 0.25 * length)
        else:
            s = start + (np.arange(n) + 0.5) * length
        n = len(s)
        if kind[k] == "asphalt":
            s = s + 0.1 * length * rng.uniform(-1, 1, n)
        on = {"asphalt": np.zeros(n), "solid": np.ones(n), "dashed": 1.0 * _on_dash(layout, s)}[kind[k]]
        columns.append(np.stack([s, np.full(n, d), np.full(n, length), np.full(n, width), on]))
    return np.concatenate(columns, axis=1)


def _on_dash(layout: StreetLayout, s: NDArray[np.float64]) -> NDArray[np.bool_]:
    return s % (layout.dash_length + layout.dash_gap) < layout.dash_length


def _cross_section(layout: StreetLayout, is_crossing: bool) -> tuple[NDArray[np.float64], list[str]]:
    """Return the edges across the road from right to left [m], and the surface between each two."""
    right, left, half = layout.carriageway_right, layout.carriageway_left, layout.marking_width / 2
    if is_crossing:
        bar = layout.crossing_bar
        bars = int((left - right - 0.3 + bar) / (2 * bar))
        margin = (left - right - (2 * bars - 1) * bar) / 2
        breaks = [right, *(right + margin + bar * np.arange(2 * bars)), left]
        return np.array(breaks), ["asphalt", "solid"] * bars + ["asphalt"]
    lines = [-layout.lane_width / 2, layout.lane_width / 2, 1.5 * layout.lane_width]
    breaks = [right, *(line + side * half for line in lines for side in (-1, 1)), left]
    # the wide intervals are cut where the nearest view changes, so that cells grow outward
    further = [
        cut for cut in (-0.875, 0.0, 0.875, 3.0, 4.2, 6.3) if np.abs(cut - np.array(breaks)).min() > 0.02
    ]
    cuts = np.sort(np.concatenate([breaks, [cut for cut in further if right < cut < left]]))
    kinds = dict(zip(breaks[1:-1:2], ["solid", "dashed", "solid"], strict=True))
    return cuts, [kinds.get(edge, "asphalt") for edge in cuts[:-1]]


def _is_on_paint(layout: StreetLayout, s: NDArray[np.float64], d: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return whether points lie on paint, or so close to it that they would blur its edge."""
    margin = 0.04
    line = np.zeros(len(s), dtype=bool)
    for middle in (-layout.lane_width / 2, layout.lane_width / 2):
        line |= np.abs(d - middle) < layout.marking_width / 2 + margin
    along = s - layout.crossing_station
    return line | layout.has_crossing & (along > -margin) & (along < layout.crossing_length + margin)
