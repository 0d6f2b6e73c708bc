"""Fields over the ground that are the same whoever looks, from where and when: puddles and snow patches.

A field is a sum of smooth lattice noises from coarse to fine in world coordinates. A pixel that is wider
than a wave sees the wave's mean, so a wave fades as its length nears the footprint and nothing flickers.
"""

from dataclasses import dataclass
from math import floor, sqrt

import numba
import numpy as np
from numpy.typing import NDArray

from tasks.render.weather.random_streams import lattice_unit, stream_key


@dataclass(frozen=True, kw_only=True)
class FieldParameters:
    """A coarse-to-fine field.

    Parameters
    ----------
    coarsest_m : longest wave [m]
    octaves : number of waves, each half as long as the one before [1]
    roughness : amplitude of a wave by the amplitude of the one before [1]
    """

    coarsest_m: float
    octaves: int
    roughness: float


def height_field(
    x: NDArray[np.floating],
    y: NDArray[np.floating],
    parameters: FieldParameters,
    seed: int,
    stream: str,
    footprint: NDArray[np.floating] | float = 0.0,
) -> NDArray[np.float32]:
    """A field of mean 0 and, seen from near, standard deviation 1.

    Parameters
    ----------
    x, y : [...] world coordinates [m]
    parameters : its waves
    seed : visual seed of the clip [1]
    stream : name of the field
    footprint : [...] or one number, width of what looks at the point [m]

    Returns
    -------
    float32 [...] field [1]
    """
    shape = np.shape(x)
    places = np.stack((np.ravel(x), np.ravel(y))).astype(np.float64)
    prints = np.array(np.broadcast_to(footprint, shape), dtype=np.float64).ravel()
    out = np.empty(len(prints))
    sum_waves(
        len(out), places, prints, parameters.coarsest_m, parameters.octaves, parameters.roughness,
        np.uint64(stream_key(seed, stream)), out,
    )  # fmt: skip
    return out.astype(np.float32).reshape(shape)


def rank_uniform(
    values: NDArray[np.floating], weights: NDArray[np.floating] | None = None
) -> NDArray[np.float32]:
    """Map values to [0, 1] so that the weight below a level is that level, keeping their order.

    Parameters
    ----------
    values : [N] any numbers; equal ones keep the order they stand in [1]
    weights : [N] positive weights, such as areas; None for equal ones [1]

    Returns
    -------
    float32 [N] mid-ranks in (0, 1) [1]
    """
    weights = np.ones(len(values)) if weights is None else np.asarray(weights, dtype=np.float64)
    order = np.argsort(values, kind="stable")
    upper = np.cumsum(weights[order])
    ranks = np.empty(len(values), dtype=np.float32)
    ranks[order] = (upper - weights[order] / 2) / (upper[-1] if len(upper) else 1)
    return ranks


@numba.njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _smooth_noise(x, y, key):  # type: ignore[no-untyped-def]
    """Smooth noise of unit wavelength: mean 0, variance 1 over all places and seeds.

    Corner values are blended with weights that keep the variance (their squares sum to 1), so the field has
    no grid of calm places.
    """
    fx, fy = floor(x), floor(y)
    ix, iy = np.int64(fx), np.int64(fy)
    tx, ty = x - fx, y - fy
    tx, ty = tx * tx * (3 - 2 * tx), ty * ty * (3 - 2 * ty)
    a = (1 - tx) * (lattice_unit(ix, iy, key) - 0.5) + tx * (lattice_unit(ix + 1, iy, key) - 0.5)
    b = (1 - tx) * (lattice_unit(ix, iy + 1, key) - 0.5) + tx * (lattice_unit(ix + 1, iy + 1, key) - 0.5)
    spread = ((1 - tx) ** 2 + tx * tx) * ((1 - ty) ** 2 + ty * ty)
    return ((1 - ty) * a + ty * b) * sqrt(12 / spread)


@numba.njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _read_wave(x, y, footprint, wave, amplitude, key):  # type: ignore[no-untyped-def]
    """Return one wave at a place, as far as what looks at it is narrower than the wave."""
    seen = min(1.0, max(0.0, wave / (2 * footprint + 1e-9) - 1))
    return seen * amplitude * _smooth_noise(x / wave, y / wave, key)


@numba.njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _turn_place(x, y):  # type: ignore[no-untyped-def]
    """Turn each wave against the one before, so that their grids do not align."""
    return 0.8 * x - 0.6 * y, 0.6 * x + 0.8 * y


@numba.njit(cache=True, nogil=True, error_model="numpy")
def read_field(x, y, footprint, coarsest, octaves, roughness, key):  # type: ignore[no-untyped-def]
    """Return the field at one place; `sum_waves` returns it at many.

    Parameters
    ----------
    x, y : world coordinates [m]
    footprint, coarsest, octaves, roughness, key : see `sum_waves`
    """
    power, total = 0.0, 0.0
    wave, amplitude = coarsest, 1.0
    for k in range(octaves):
        power += amplitude * amplitude
        total += _read_wave(x, y, footprint, wave, amplitude, key + np.uint64(k))
        x, y = _turn_place(x, y)
        wave *= 0.5
        amplitude *= roughness
    return total / sqrt(power)


@numba.njit(cache=True, nogil=True, error_model="numpy")
def sum_waves(count, places, footprint, coarsest, octaves, roughness, key, out):  # type: ignore[no-untyped-def]
    """Write the field at the first places into ``out``, wave after wave in loops that the compiler turns into vectors.

    Parameters
    ----------
    count : number of places, int64 [1]
    places : float64 [2, N] world coordinates x and y, which are overwritten [m]
    footprint : float64 [N] width of what looks at each place [m]
    coarsest, octaves, roughness : as in `FieldParameters`; octaves as int64, because Numba compiles literals one by one
    key : uint64 of the field's stream [1]
    out : float64 [N], written [1]
    """
    power = 0.0
    wave, amplitude = coarsest, 1.0
    for i in range(count):
        out[i] = 0.0
    for k in range(octaves):
        power += amplitude * amplitude
        own = key + np.uint64(k)
        for i in range(count):
            x, y = places[0, i], places[1, i]
            out[i] += _read_wave(x, y, footprint[i], wave, amplitude, own)
            places[0, i], places[1, i] = _turn_place(x, y)
        wave *= 0.5
        amplitude *= roughness
    for i in range(count):
        out[i] /= sqrt(power)
