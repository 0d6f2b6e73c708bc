"""Whether a clip fits into the memory of this machine, said before anything is made."""

import os
import resource
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from catalogs.grids import GridFile
from flows.store.arrays import ARRAYS, DIMENSION_SIZES, PixelArray, arrays_of
from tasks.render.camera import Camera

BASE_BYTES = 560 * 2**20
"""Of a worker with its libraries, the built-in street and the compiled kernels [B]: measured."""
BYTES_PER_PIXEL = 160
"""Of one frame while it is drawn, in rain [B]: measured at 480 x 320 and at 1280 x 720."""
BYTES_PER_TICK = 700
"""Memory of a clip's telemetry while it is driven and written [B]: measured over 500,000 ticks."""


def clip_memory(settings: GridFile, camera: Camera, ticks: int) -> int:
    """Memory that a worker needs for one clip [B].

    Parameters
    ----------
    settings : of the grid
    camera : whose pictures are made
    ticks : rows of telemetry of a clip [1]
    """
    # the check takes lens and rolling shutter out of copies; else it needs no more than the last frame has freed
    copies = (camera.distortion is not None) + (camera.line_delay_s > 0)
    held = _count_bytes(arrays_of(settings.labels, settings.has_objects)) + copies * _count_bytes(ARRAYS)
    pixels = camera.width * camera.height if settings.pictures else 0
    return BASE_BYTES + pixels * (BYTES_PER_PIXEL + settings.frames * held) + BYTES_PER_TICK * ticks


def _count_bytes(arrays: Mapping[str, PixelArray]) -> int:
    """Return the bytes of a pixel in some arrays."""
    return sum(
        np.dtype(array.dtype).itemsize
        * int(np.prod([DIMENSION_SIZES[dimension] for dimension in array.dimensions]))
        for array in arrays.values()
    )


def memory_here() -> int:
    """Memory that a process of this machine may have at most [B]."""
    limits = [os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")]
    soft, _ = resource.getrlimit(resource.RLIMIT_AS)
    if soft != resource.RLIM_INFINITY:
        limits.append(soft)
    container = Path("/sys/fs/cgroup/memory.max")
    if container.is_file() and (text := container.read_text().strip()).isdigit():
        limits.append(int(text))
    return min(limits)


def find_memory_problems(settings: GridFile, camera: Camera, ticks: int) -> list[str]:
    """A sentence where one clip does not fit into this machine's memory.

    Parameters
    ----------
    settings, camera, ticks : as of `clip_memory`
    """
    needed, here = clip_memory(settings, camera, ticks), memory_here()
    if needed <= here:
        return []
    return [
        f"frames: a clip must fit into memory; {settings.frames} frames need about {needed / 1e9:.1f} GB,"
        f" and this machine has {here / 1e9:.1f} GB: take fewer frames, or a smaller camera"
    ]
