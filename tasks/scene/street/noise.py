"""Named random streams and smooth noise, so that every part of the street is reproducible by itself."""

from hashlib import blake2b

import numpy as np
from numpy.typing import ArrayLike, NDArray

_LATTICE = 256


def named_generator(seed: int, name: str) -> np.random.Generator:
    """Return a separate counter-based generator for one named part of the street.

    Parameters
    ----------
    seed : the street's seed [1]
    name : name of the part; other names give independent numbers
    """
    key = blake2b(f"{seed}/{name}".encode(), digest_size=16).digest()
    return np.random.Generator(np.random.Philox(key=np.frombuffer(key, dtype="<u8")))


def fractal_noise(
    rng: np.random.Generator, x: ArrayLike, y: ArrayLike, wavelength: float, octaves: int = 1
) -> NDArray[np.float64]:
    """Return smooth noise of about zero mean and unit deviation, each octave half as long and half as strong.

    Parameters
    ----------
    rng : draws the lattice
    x, y : where to evaluate, broadcast together [m]
    wavelength : lattice spacing of the first octave [m]
    octaves : number of octaves [1]
    """
    x, y = np.broadcast_arrays(np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64))
    total, power = np.zeros(x.shape), 0.0
    for octave in range(octaves):
        lattice = rng.standard_normal((_LATTICE, _LATTICE))
        u, v = x / wavelength * 2**octave, y / wavelength * 2**octave
        i, j = np.floor(u).astype(np.int64), np.floor(v).astype(np.int64)
        a, b = smooth_step(u - i), smooth_step(v - j)
        i0, j0, i1, j1 = i % _LATTICE, j % _LATTICE, (i + 1) % _LATTICE, (j + 1) % _LATTICE
        low = lattice[i0, j0] * (1 - a) + lattice[i1, j0] * a
        high = lattice[i0, j1] * (1 - a) + lattice[i1, j1] * a
        total += (low * (1 - b) + high * b) * 0.5**octave
        power += 0.5 * 0.25**octave
    return total / np.sqrt(power)


def smooth_step(t: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return 3 t^2 - 2 t^3, which rises from 0 at t = 0 to 1 at t = 1 and is constant outside [1]."""
    t = np.clip(t, 0.0, 1.0)
    return t * t * (3 - 2 * t)
