"""The pixels that one particle passes while the shutter is open."""

from math import cos, pi, sin

import numba

from tasks.render.lens import distort_rays

NEAREST_Z_SHARE = 0.3
"""Particles are cut at this share of the nearest distance along the optical axis."""
ROW_STEPS, MOST_LONGER = 8, 4.0
"""Steps by which a particle's row is found, and the most that a row-by-row shutter lengthens a streak [1]."""


@numba.njit(cache=True, nogil=True, error_model="numpy")
def rotate_vector(R, vector, out):  # type: ignore[no-untyped-def]
    for i in range(3):
        out[i] = R[i, 0] * vector[0] + R[i, 1] * vector[1] + R[i, 2] * vector[2]


@numba.njit(cache=True, nogil=True, error_model="numpy")
def add_flutter(offset, moving, amplitude, rate, time, chances):  # type: ignore[no-untyped-def]
    """Add a flake's own slow elliptic motion to its position and velocity.

    Its four chances from 0 to 1 are the phases in x and y, its quickness and its amplitude.
    """
    turn_x, turn_y, quickness, size = chances
    amplitude *= 0.3 + 0.7 * size
    rate *= 0.6 + 0.8 * quickness
    for i in range(2):
        own = rate * (1 - 0.23 * i)
        phase = 2 * pi * (turn_x if i == 0 else turn_y) + own * time
        offset[i] += amplitude * sin(phase)
        moving[i] += amplitude * own * cos(phase)


@numba.njit(cache=True, nogil=True, error_model="numpy")
def expose(streak, place, motion, exposure, K):  # type: ignore[no-untyped-def]
    """Write the pixels of a particle when the shutter opens and when it closes."""
    z = place[2]
    first = max(z - 0.5 * exposure * motion[2], NEAREST_Z_SHARE * z)
    last = max(z + 0.5 * exposure * motion[2], NEAREST_Z_SHARE * z)
    for i in range(2):
        step = 0.5 * exposure * motion[i]
        streak.begin[i] = K[i, i] * (place[i] - step) / first + K[i, 2]
        streak.end[i] = K[i, i] * (place[i] + step) / last + K[i, 2]


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _seen_at(place, motion, time, K, coefficients):  # type: ignore[no-untyped-def]
    """Return the distorted pixel of a particle at a time from the middle of the frame [px]."""
    z = max(place[2] + time * motion[2], NEAREST_Z_SHARE * place[2])
    x, y = (place[0] + time * motion[0]) / z, (place[1] + time * motion[1]) / z
    x, y = distort_rays(x, y, coefficients)
    return K[0, 0] * x + K[0, 2], K[1, 1] * y + K[1, 2]


@numba.njit(cache=True, nogil=True, error_model="numpy")
def expose_by_rows(streak, place, motion, exposure, K, coefficients, line_delay, height):  # type: ignore[no-untyped-def]
    """`expose` behind a lens, by a shutter that opens for one row after the other.

    A particle is seen at the time t of its row, t = line_delay (row(t) - middle). A particle that moves in the
    direction of the readout is exposed longer, by 1 / (1 - line_delay row'), and leaves that much more light.
    """
    half = 0.5 * abs(line_delay) * height
    time = 0.0
    for _ in range(ROW_STEPS if line_delay != 0 else 0):
        _, row = _seen_at(place, motion, time, K, coefficients)
        time = min(max(line_delay * (row - 0.5 * height), -half), half)
    _, above = _seen_at(place, motion, time - 0.5 * exposure, K, coefficients)
    _, below = _seen_at(place, motion, time + 0.5 * exposure, K, coefficients)
    longer = 1 / max(1 - line_delay * (below - above) / exposure, 1 / MOST_LONGER)
    streak.begin[0], streak.begin[1] = _seen_at(
        place, motion, time - 0.5 * longer * exposure, K, coefficients
    )
    streak.end[0], streak.end[1] = _seen_at(place, motion, time + 0.5 * longer * exposure, K, coefficients)
    return longer
