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
    x = np.ascontiguousarray(x, dtype=np.float64)
    prints = np.ascontiguousarray(np.broadcast_to(np.asarray(footprint, dtype=np.float64), x.shape))
    out = np.empty(x.size, dtype=np.float32)
    _field(
        x.ravel(), np.ascontiguousarray(y, dtype=np.float64).ravel(), prints.ravel(), out,
        parameters.coarsest_m, parameters.octaves, parameters.roughness, np.uint64(stream_key(seed, stream)),
    )  # fmt: skip
    return out.reshape(x.shape)


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


@numba.njit(cache=True, nogil=True, error_model="numpy")
def lattice_noise(x, y, key):  # type: ignore[no-untyped-def]
    """Smooth noise of unit wavelength: mean 0, variance 1 over all places and seeds.

    Corner values are blended with weights that keep the variance (their squares sum to 1), so the field has
    no grid of calm places.

    Parameters
    ----------
    x, y : float64 place in wavelengths [1]
    key : uint64 [1]

    Returns
    -------
    float64 [1]
    """
    fx, fy = floor(x), floor(y)
    ix, iy = np.int64(fx), np.int64(fy)
    tx, ty = x - fx, y - fy
    tx, ty = tx * tx * (3 - 2 * tx), ty * ty * (3 - 2 * ty)
    a = (1 - tx) * (lattice_unit(ix, iy, key) - 0.5) + tx * (lattice_unit(ix + 1, iy, key) - 0.5)
    b = (1 - tx) * (lattice_unit(ix, iy + 1, key) - 0.5) + tx * (lattice_unit(ix + 1, iy + 1, key) - 0.5)
    spread = ((1 - tx) ** 2 + tx * tx) * ((1 - ty) ** 2 + ty * ty)
    return ((1 - ty) * a + ty * b) * sqrt(12 / spread)


@numba.njit(cache=True, nogil=True, error_model="numpy")
def fractal_noise(x, y, footprint, coarsest, octaves, roughness, key):  # type: ignore[no-untyped-def]
    """Sum of `lattice_noise` waves, each turned against the one before so that their grids do not align."""
    total, power = 0.0, 0.0
    wave, amplitude = coarsest, 1.0
    for k in range(octaves):
        power += amplitude * amplitude
        seen = min(1.0, max(0.0, wave / (2 * footprint + 1e-9) - 1))
        if seen > 0:
            total += seen * amplitude * lattice_noise(x / wave, y / wave, key + np.uint64(k))
        x, y = 0.8 * x - 0.6 * y, 0.6 * x + 0.8 * y
        wave *= 0.5
        amplitude *= roughness
    return total / sqrt(power)


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _field(x, y, footprint, out, coarsest, octaves, roughness, key):  # type: ignore[no-untyped-def]
    for i in range(len(x)):
        out[i] = fractal_noise(x[i], y[i], footprint[i], coarsest, octaves, roughness, key)
