"""The lobe of a rough mirror: light of the pixels above, below and beside it is averaged at every road pixel."""

import numba
import numpy as np
from numpy.typing import NDArray

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
    tall, out = np.zeros_like(light), np.zeros_like(light)
    _slide(light, view.road, view.mirrors, reach, tall)
    _spread(tall, view.road, across, out)
    return out


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _spread(light, road, across, out):  # type: ignore[no-untyped-def]
    """Mean of the road pixels of each row, within the largest reach of that row."""
    height, width = road.shape
    total, count = np.zeros((width + 1, 3)), np.zeros(width + 1)
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
            if not road[row, column]:
                continue
            low, high = max(column - int(reach), 0), min(column + int(reach), width - 1) + 1
            for c in range(3):
                out[row, column, c] = (total[high, c] - total[low, c]) / (count[high] - count[low])


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
