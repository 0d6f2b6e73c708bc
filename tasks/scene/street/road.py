"""The carriageway: asphalt with its wear, and the markings, all in the plane of height zero.

Its reflectance has grain, tyre tracks, repairs, sealed cracks, iron covers and worn paint.
"""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from tasks.conventions import SemanticClass
from tasks.scene.street.layout import EYE_HEIGHT, PIXEL, StreetLayout, nearest_depth
from tasks.scene.street.noise import fractal_noise, named_generator
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
_ASPHALT = np.array([0.112, 0.108, 0.103])
_PAINT = np.array([0.50, 0.50, 0.475])
_BITUMEN = np.array([0.035, 0.034, 0.034])
_IRON = np.array([0.075, 0.066, 0.058])
_LEAVES = np.array([[0.20, 0.13, 0.03], [0.13, 0.14, 0.03], [0.22, 0.09, 0.02]])

Floats = NDArray[np.float64]


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
            marked[:, None], paint_albedo(seed, s, d, grain), asphalt_albedo(layout, seed, s, d, width, grain)
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


def asphalt_albedo(
    layout: StreetLayout, seed: int, s: Floats, d: Floats, size: Floats, grain: Floats
) -> Floats:
    """Return the reflectance of the asphalt at each cell.

    Parameters
    ----------
    layout : dimensions
    seed : the street's seed [1]
    s, d : station and lateral position [N] [m]
    size : width of the cell [N], over which thin details are averaged [m]
    grain : [N, 2] independent normal numbers, the stones of the cell [1]

    Returns
    -------
    float64 [N, 3] linear reflectance [1]
    """
    shade = 1 + 0.07 * fractal_noise(named_generator(seed, "asphalt age"), s, d, 9.0, 2)
    shade += 0.06 * fractal_noise(named_generator(seed, "asphalt mix"), s, d, 0.9, 3)
    shade *= np.exp(0.17 * grain[:, 0] * np.minimum(1.0, np.sqrt(0.05 / size)))
    for lane in (0.0, layout.lane_width):
        for wheel in (-0.74, 0.74):
            shade *= 1 - 0.13 * np.exp(-(((d - lane - wheel) / 0.24) ** 2))
        shade *= 1 - 0.07 * np.exp(-(((d - lane) / 0.3) ** 2))
    to_kerb = np.minimum(layout.carriageway_left - d, d - layout.carriageway_right)
    shade *= 1 + 0.12 * np.exp(-(((to_kerb - 0.35) / 0.25) ** 2)) - 0.3 * np.exp(-to_kerb / 0.07)
    albedo = (
        layout.asphalt_scale * _ASPHALT * shade[:, None] * (1 + 0.015 * grain[:, 1:] * np.array([1, 0, -1]))
    )
    albedo = _add_repairs(layout, seed, s, d, size, albedo)
    albedo = _add_cracks(layout, seed, s, d, size, albedo)
    albedo = _add_covers(layout, seed, s, d, size, albedo)
    return _add_leaves(layout, seed, to_kerb, albedo)


def paint_albedo(seed: int, s: Floats, d: Floats, grain: Floats) -> Floats:
    """Return the reflectance of worn road paint, float64 [N, 3] [1]; parameters as `asphalt_albedo`."""
    wear = 0.10 * fractal_noise(named_generator(seed, "paint wear"), s, d, 0.7, 3) + 0.05 * grain[:, 0]
    return _PAINT * np.clip(0.95 + np.minimum(wear, 0.06), 0.45, 1.0)[:, None]


def _add_repairs(
    layout: StreetLayout, seed: int, s: Floats, d: Floats, size: Floats, albedo: Floats
) -> Floats:
    rng = named_generator(seed, "repairs")
    shade = np.ones(len(s))
    seam = np.zeros(len(s))
    spacing = 15.0 / max(layout.wear_scale, 0.05)
    for slot in np.arange(14.0, layout.station_range[1], spacing):
        middle = slot + rng.uniform(-6, 6)
        half_s, half_d = rng.uniform(0.5, 3.2), rng.uniform(0.4, 0.9)
        lateral, tone = rng.uniform(-1.6, 1.5 * layout.lane_width), rng.choice([0.68, 0.78, 0.86, 1.14])
        outside = np.maximum(np.abs(s - middle) - half_s, np.abs(d - lateral) - half_d)
        shade = np.where(outside < 0, tone, shade)
        seam = np.maximum(seam, np.clip(1 - (np.abs(outside) - 0.015) / size, 0, 0.7))
    return _mix_colours(albedo * shade[:, None], _BITUMEN, seam)


def _add_cracks(
    layout: StreetLayout, seed: int, s: Floats, d: Floats, size: Floats, albedo: Floats
) -> Floats:
    rng = named_generator(seed, "cracks")
    cover = np.zeros(len(s))
    last = layout.station_range[1]
    for middle in rng.uniform(0, last, round(26 * layout.wear_scale)):
        along, across = rng.random() < 0.5, rng.uniform(-1.7, 1.5 * layout.lane_width)
        half = rng.uniform(3, 10) if along else rng.uniform(0.8, 2.5)
        run, offset = (s - middle, d - across) if along else (d - across, s - middle)
        bend = sum(
            rng.uniform(0.03, 0.1) * np.sin(run * 2 * np.pi / wave + rng.uniform(0, 6.3))
            for wave in (5.0, 1.7, 0.6)
        )
        thin = np.clip(1 - (np.abs(offset - bend) - 0.012) / size, 0, 0.8)
        cover = np.maximum(cover, np.where(np.abs(run) < half, thin, 0))
    return _mix_colours(albedo, _BITUMEN, cover)


def _add_covers(
    layout: StreetLayout, seed: int, s: Floats, d: Floats, size: Floats, albedo: Floats
) -> Floats:
    rng = named_generator(seed, "covers")
    for middle in np.arange(9.0, layout.station_range[1], 31.0):
        lateral = rng.choice([0.55, -0.4, layout.lane_width])
        radius = np.hypot(s - middle - rng.uniform(-3, 3), d - lateral)
        albedo = _mix_colours(albedo, _IRON, np.clip((0.31 - radius) / size + 0.5, 0, 1))
        albedo = _mix_colours(albedo, _BITUMEN, np.clip(1 - np.abs(radius - 0.34) / size, 0, 0.9))
    return albedo


def _add_leaves(layout: StreetLayout, seed: int, to_kerb: Floats, albedo: Floats) -> Floats:
    rng = named_generator(seed, "leaves on the road")
    often = (0.10 + 0.25 * layout.autumn_share) * np.exp(-to_kerb / 0.4) + 0.002 + 0.01 * layout.autumn_share
    fallen = rng.random(len(albedo)) < often
    colour = _LEAVES[rng.integers(0, len(_LEAVES), len(albedo))]
    return _mix_colours(albedo, colour, np.where(fallen, 0.75, 0.0))


def _mix_colours(albedo: Floats, colour: Floats, share: Floats) -> Floats:
    return albedo + (colour - albedo) * share[:, None]
