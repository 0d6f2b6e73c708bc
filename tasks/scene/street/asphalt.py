"""Reflectance of the road's surface: grain, tyre tracks, repairs, sealed cracks, iron covers, worn paint."""

import numpy as np
from numpy.typing import NDArray

from tasks.scene.street.layout import StreetLayout
from tasks.scene.street.noise import fractal_noise, named_generator

_ASPHALT = np.array([0.112, 0.108, 0.103])
_PAINT = np.array([0.50, 0.50, 0.475])
_BITUMEN = np.array([0.035, 0.034, 0.034])
_IRON = np.array([0.075, 0.066, 0.058])
_LEAVES = np.array([[0.20, 0.13, 0.03], [0.13, 0.14, 0.03], [0.22, 0.09, 0.02]])

Floats = NDArray[np.float64]


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
