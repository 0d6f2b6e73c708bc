"""Real spherical harmonics up to degree 3, in the band order and signs of the INRIA layout."""

from math import pi, sqrt

import numpy as np
from numpy.typing import NDArray

C0 = 0.5 * sqrt(1 / pi)
C1 = 0.5 * sqrt(3 / pi)
C2 = (0.5 * sqrt(15 / pi), 0.25 * sqrt(5 / pi), 0.25 * sqrt(15 / pi))
C3 = (
    0.25 * sqrt(35 / (2 * pi)),
    0.5 * sqrt(105 / pi),
    0.25 * sqrt(21 / (2 * pi)),
    0.25 * sqrt(7 / pi),
    0.25 * sqrt(105 / pi),
)


def sh_basis(directions: NDArray[np.floating], count: int) -> NDArray[np.float64]:
    """Return the first ``count`` basis functions (Kerbl et al. 2023, doi:10.1145/3592433, their code's order).

    Parameters
    ----------
    directions : [..., 3] unit vectors from the camera to the Gaussian, world frame [1]
    count : number of functions: 1, 4, 9 or 16 [1]

    Returns
    -------
    float64 [..., count] basis values [1]
    """
    x, y, z = np.moveaxis(np.asarray(directions, dtype=np.float64), -1, 0)
    values = [
        np.full_like(x, C0),
        -C1 * y,
        C1 * z,
        -C1 * x,
        C2[0] * x * y,
        -C2[0] * y * z,
        C2[1] * (2 * z * z - x * x - y * y),
        -C2[0] * x * z,
        C2[2] * (x * x - y * y),
        -C3[0] * y * (3 * x * x - y * y),
        C3[1] * x * y * z,
        -C3[2] * y * (4 * z * z - x * x - y * y),
        C3[3] * z * (2 * z * z - 3 * x * x - 3 * y * y),
        -C3[2] * x * (4 * z * z - x * x - y * y),
        C3[4] * z * (x * x - y * y),
        -C3[0] * x * (x * x - 3 * y * y),
    ]
    return np.stack(values[:count], axis=-1)
