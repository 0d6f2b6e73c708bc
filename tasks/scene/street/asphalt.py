"""Reflectance of asphalt and of the paint on it: age and kind by street, and the traces of its use.

A road is laid and renewed in stretches of one age a lane. Wheels darken it or polish its stones bare, engines drip
between them, frost and load crack it, and crews cut it open and seal it.
"""

import numpy as np
from numpy.typing import NDArray

from tasks.scene.street import palette
from tasks.scene.street.layout import StreetLayout
from tasks.scene.street.noise import fractal_noise, named_generator

Floats = NDArray[np.float64]

_WHEEL, _TRACK = 0.74, 0.27
"""Lateral position of the wheels from the middle of a lane, and half width of the tracks they leave [m]."""
_STREAK = 26.0
"""Streaks that traffic and pavers draw along the road: length over width [1]."""


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
    to_kerb = np.minimum(layout.carriageway_left - d, d - layout.carriageway_right)
    tone, seam = _renewed_stretches(layout, seed, s, d, size)
    for name, wave, octaves, spread in (("age", 9.0, 2, 0.14), ("mix", 0.9, 3, 0.11)):
        tone += spread * fractal_noise(named_generator(seed, f"asphalt {name}"), s, d, wave, octaves)
    tone += 0.14 * fractal_noise(named_generator(seed, "asphalt streaks"), s / _STREAK, d, 0.4, 3)
    tone += 0.17 * grain[:, 0] * np.minimum(1.0, np.sqrt(0.05 / size))
    tone += _worn_lanes(layout, seed, s, d)
    shade = np.exp(tone)
    shade *= 1 + 0.12 * np.exp(-(((to_kerb - 0.35) / 0.25) ** 2)) - 0.3 * np.exp(-to_kerb / 0.07)
    albedo = layout.asphalt_scale * palette.ASPHALT * shade[:, None]
    albedo *= 1 + 0.015 * grain[:, 1:] * np.array([1, 0, -1])
    repaired, cut = _repairs(layout, seed, s, d, size)
    tar = np.maximum.reduce([seam, cut, _cracks(layout, seed, s, d, size)])
    albedo = _mix_colours(albedo * repaired[:, None], palette.BITUMEN, tar)
    albedo = _add_covers(layout, seed, s, d, size, albedo)
    albedo = _add_soil(layout, seed, s, d, to_kerb, albedo)
    return np.minimum(_add_leaves(layout, seed, to_kerb, albedo), 0.5)


def paint_albedo(layout: StreetLayout, seed: int, s: Floats, d: Floats, grain: Floats) -> Floats:
    """Return the reflectance of worn road paint, float64 [N, 3] [1]; parameters as `asphalt_albedo`."""
    parts_traffic = np.abs(d - layout.lane_width / 2) < layout.marking_width
    crosses = layout.has_crossing & (
        np.abs(s - layout.crossing_station - layout.crossing_length / 2) < layout.crossing_length / 2
    )
    yellow = ~crosses & parts_traffic & (named_generator(seed, "paint").random() < layout.yellow_share)
    wear = 0.10 * fractal_noise(named_generator(seed, "paint wear"), s, d, 0.7, 3) + 0.05 * grain[:, 0]
    colour = np.where(yellow[:, None], palette.YELLOW_PAINT, palette.PAINT)
    return colour * np.clip(0.95 + np.minimum(wear, 0.06), 0.45, 1.0)[:, None]


def _renewed_stretches(
    layout: StreetLayout, seed: int, s: Floats, d: Floats, size: Floats
) -> tuple[Floats, Floats]:
    """Return the logarithm of the tone of each lane's stretches by age, and the cover of the seams about them [N]."""
    lane = np.clip(np.floor(d / layout.lane_width + 0.5), 0, 1).astype(np.int64)
    joint = np.abs(d - (0.5 * layout.lane_width + 0.12)) - 0.015
    seam = np.clip(1 - joint / size, 0, 0.6 * min(layout.wear_scale, 1.0))
    tone = np.zeros(len(s))
    first, last = layout.station_range
    for number in (0, 1):
        rng = named_generator(seed, f"renewed lane {number}")
        lengths = rng.uniform(0.3, 1.7, 200) * layout.renewal_spacing
        ends = first + rng.uniform(0, 1) * lengths[0] + np.concatenate([[0], np.cumsum(lengths)])
        tones = layout.renewal_scale * rng.standard_normal(len(ends) + 1)
        own = lane == number
        tone[own] = tones[np.searchsorted(ends, s[own])]
        for end in ends[ends < last]:
            at = own & (np.abs(s - end) < 3.0)
            seam[at] = np.maximum(seam[at], np.clip(1 - (np.abs(s[at] - end) - 0.03) / size[at], 0, 0.8))
    return tone, seam


def _worn_lanes(layout: StreetLayout, seed: int, s: Floats, d: Floats) -> Floats:
    """Return the logarithm of the tone that wheels, dripping oil and braking give the lanes [N]."""
    tone = np.zeros(len(s))
    wander = 0.05 * fractal_noise(named_generator(seed, "wander"), s, 0 * d, 14.0)
    uneven = 1 + 0.35 * fractal_noise(named_generator(seed, "worn"), s / _STREAK, d, 0.7, 2)
    for lane in (0.0, layout.lane_width):
        across = d - lane - wander
        for wheel in (-_WHEEL, _WHEEL):
            tone += np.log(layout.track_scale) * np.exp(-(((across - wheel) / _TRACK) ** 2))
        tone += np.log(layout.strip_scale) * np.exp(-((across / 0.33) ** 2))
    tone *= np.clip(uneven, 0.2, 2.0)
    rng = named_generator(seed, "skid marks")
    for start in rng.uniform(0, layout.route_length, round(3 * layout.wear_scale)):
        length, turn = rng.uniform(6, 20), rng.uniform(-0.02, 0.02)
        lateral = rng.choice([0.0, layout.lane_width]) + rng.uniform(-0.3, 0.3)
        on = np.flatnonzero((s > start) & (s < start + length))
        along, across = s[on] - start, d[on] - lateral - turn * (s[on] - start)
        for wheel in (-_WHEEL, _WHEEL):
            tone[on] -= 0.45 * np.exp(-(((across - wheel) / 0.11) ** 4)) * np.minimum(1, 3 * along / length)
    return tone


def _repairs(layout: StreetLayout, seed: int, s: Floats, d: Floats, size: Floats) -> tuple[Floats, Floats]:
    """Return the tone of trenches and patches over the road about them, and the cover of their seams [N]."""
    rng = named_generator(seed, "repairs")
    tone, seam = np.ones(len(s)), np.zeros(len(s))
    spacing = 15.0 / max(layout.wear_scale, 0.05)
    for slot in np.arange(14.0 - layout.behind, layout.station_range[1], spacing):
        middle, trench = slot + rng.uniform(-6, 6), rng.random() < 0.25
        half_s = rng.uniform(4, 14) if trench else rng.uniform(0.5, 3.2)
        half_d = rng.uniform(0.25, 0.45) if trench else rng.uniform(0.4, 1.1)
        lateral, own = (
            rng.uniform(-1.6, 1.5 * layout.lane_width),
            rng.choice([0.5, 0.62, 0.72, 0.85, 1.2, 1.35]),
        )
        outside = np.maximum(np.abs(s - middle) - half_s, np.abs(d - lateral) - half_d)
        tone = np.where(outside < 0, own, tone)
        seam = np.maximum(seam, np.clip(1 - (np.abs(outside) - 0.015) / size, 0, 0.7))
    return tone, seam


def _cracks(layout: StreetLayout, seed: int, s: Floats, d: Floats, size: Floats) -> Floats:
    """Return the share of each cell that cracks and the bitumen on them cover [N].

    Long ones run along joints, short ones across; fatigue breaks the tracks into a net.
    """
    rng = named_generator(seed, "cracks")
    cover = np.zeros(len(s))
    last = layout.station_range[1]
    for middle in rng.uniform(0, last, round(34 * layout.wear_scale)):
        along, across = rng.random() < 0.45, rng.uniform(-1.7, 1.5 * layout.lane_width)
        half = rng.uniform(3, 14) if along else rng.uniform(0.8, 3.6)
        width = rng.choice([0.008, 0.014, 0.035])
        run, offset = (s - middle, d - across) if along else (d - across, s - middle)
        near = np.flatnonzero((np.abs(run) < half) & (np.abs(offset) < 1.0))
        bend = sum(
            rng.uniform(0.03, 0.1) * np.sin(run[near] * 2 * np.pi / wave + rng.uniform(0, 6.3))
            for wave in (5.0, 1.7, 0.6)
        )
        thin = np.clip(1 - (np.abs(offset[near] - bend) - width) / size[near], 0, 0.85)
        cover[near] = np.maximum(cover[near], thin)
    net = np.abs(fractal_noise(named_generator(seed, "fatigue net"), s, d, 0.3, 2))
    tired = fractal_noise(named_generator(seed, "fatigue"), s / 4, d, 1.1, 2) + 0.5 * layout.wear_scale - 2.2
    broken = np.clip(1 - net / 0.16, 0, 0.5) * np.clip(2 * tired, 0, 1) * np.minimum(1, 0.06 / size)
    return np.maximum(cover, broken)


def _add_covers(
    layout: StreetLayout, seed: int, s: Floats, d: Floats, size: Floats, albedo: Floats
) -> Floats:
    if not layout.has_pavement:
        return albedo  # pipes lie under streets with houses
    rng = named_generator(seed, "covers")
    for middle in np.arange(9.0, layout.station_range[1], 31.0):
        lateral = rng.choice([0.55, -0.4, layout.lane_width])
        radius = np.hypot(s - middle - rng.uniform(-3, 3), d - lateral)
        albedo = _mix_colours(albedo, palette.IRON, np.clip((0.31 - radius) / size + 0.5, 0, 1))
        albedo = _mix_colours(albedo, palette.BITUMEN, np.clip(1 - np.abs(radius - 0.34) / size, 0, 0.9))
    return albedo


def _add_soil(
    layout: StreetLayout, seed: int, s: Floats, d: Floats, to_kerb: Floats, albedo: Floats
) -> Floats:
    """Wind and wheels carry soil onto a road without kerbs; it lies beyond the edge line."""
    if layout.has_pavement:
        return albedo
    drift = fractal_noise(named_generator(seed, "drift"), s / 5, d, 0.5, 3)
    lies = (0.35 + 0.5 * layout.bare_share) * np.exp(-to_kerb / (0.25 + 0.3 * layout.bare_share))
    return _mix_colours(albedo, palette.choose_soil(seed), np.clip(lies * (1 + 0.7 * drift), 0, 0.85))


def _add_leaves(layout: StreetLayout, seed: int, to_kerb: Floats, albedo: Floats) -> Floats:
    rng = named_generator(seed, "leaves on the road")
    often = (0.10 + 0.25 * layout.autumn_share) * np.exp(-to_kerb / 0.4) + 0.002 + 0.01 * layout.autumn_share
    fallen = rng.random(len(albedo)) < often
    colour = palette.FALLEN[rng.integers(0, len(palette.FALLEN), len(albedo))]
    return _mix_colours(albedo, colour, np.where(fallen, 0.75, 0.0))


def _mix_colours(albedo: Floats, colour: Floats, share: Floats) -> Floats:
    return albedo + (colour - albedo) * share[:, None]
