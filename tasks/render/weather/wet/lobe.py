"""The lobe of a rough mirror: light of the pixels above, below and beside it is averaged at every road pixel."""

from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from tasks.render.pixels import INLINED, LAW, find_namespace, new_picture, run_on_device
from tasks.render.weather.wet.road_view import RoadView


def average_over_lobe(
    light: NDArray[np.float32], view: RoadView, reach: int, across: NDArray[np.float32]
) -> NDArray[np.float32]:
    """Return mirrored light averaged over a lobe, for every road pixel.

    Parameters
    ----------
    light : float32 [H, W, 3] light of the mirroring pixels [1]
    view : the road
    reach : rows to either side over which a lobe extends [px]
    across : float32 [H, W] columns to either side [px]
    """
    tall, out = new_picture(light, 3), new_picture(light, 3)
    if isinstance(light, np.ndarray):
        _slide(light, view.road, view.mirrors, reach, tall)
        width = light.shape[1]
        _spread(tall, view.road, across, np.zeros((width + 1, 3)), np.zeros(width + 1), out)
        return out
    # on a device all pixels at once read sums up to every row, and then up to every column
    run_on_device(_average_down, view.road, *_sum_along(light, view.mirrors, 0), reach, tall)
    run_on_device(_average_across, view.road, *_sum_along(tall, view.road, 1), across.amax(1), out)
    return out


def _sum_along(light: Any, counted: Any, axis: int) -> tuple[Any, Any]:
    """Sums of the light and of the pixels counted before each place of an axis, one longer than it."""
    xp = find_namespace(light)
    sums = []
    for values in (light, counted):
        total = xp.cumsum(values, axis, dtype=xp.float64)
        sums.append(xp.concatenate((xp.zeros_like(total.narrow(axis, 0, 1)), total), axis))
    return sums[0], sums[1]


@numba.njit(**INLINED)
def _average(at, road, total, count, reach, out):  # type: ignore[no-untyped-def]
    """Mean about a place of a row or a column, from the sums before each of its places."""
    if not road[at]:
        return
    low, high = max(at - int(reach), 0), min(at + int(reach), len(road) - 1) + 1
    for c in range(3):
        out[at, c] = (total[high, c] - total[low, c]) / (count[high] - count[low])


@numba.njit(**LAW)
def _average_down(row, column, road, total, count, reach, out):  # type: ignore[no-untyped-def]
    _average(row, road[:, column], total[:, column], count[:, column], reach, out[:, column])


@numba.njit(**LAW)
def _average_across(row, column, road, total, count, reach, out):  # type: ignore[no-untyped-def]
    _average(column, road[row], total[row], count[row], reach[row], out[row])


@numba.njit(**LAW)
def _spread(light, road, across, total, count, out):  # type: ignore[no-untyped-def]
    """Mean of the road pixels of each row, within the largest reach of that row."""
    height, width = road.shape
    for row in range(height):
        reach = np.float32(0)
        for column in range(width):
            on = road[row, column]
            reach = max(reach, across[row, column])
            count[column + 1] = count[column] + on
            for c in range(3):
                total[column + 1, c] = total[column, c] + light[row, column, c]
        if count[width] == 0:
            continue
        for column in range(width):
            _average(column, road[row], total, count, reach, out[row])


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _slide(light, road, mirrors, reach, out):  # type: ignore[no-untyped-def]
    height, width = road.shape
    total = np.zeros((width, 3))
    count = np.zeros(width)
    for row in range(-reach, height):
        enters, leaves = row + reach, row - reach - 1
        for column in range(width):
            if enters < height and mirrors[enters, column]:
                count[column] += 1
                for c in range(3):
                    total[column, c] += light[enters, column, c]
            if leaves >= 0 and mirrors[leaves, column]:
                count[column] -= 1
                for c in range(3):
                    total[column, c] -= light[leaves, column, c]
            if row >= 0 and road[row, column]:
                for c in range(3):
                    out[row, column, c] = total[column, c] / count[column]
