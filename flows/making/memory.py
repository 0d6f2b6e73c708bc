"""Whether a clip fits into the memory of this machine, said before anything is made."""

import os
import resource
from pathlib import Path

import numpy as np

from catalogs.grids import GridFile
from flows.store.arrays import DIMENSION_SIZES, arrays_of
from tasks.render.camera import Camera

BASE_BYTES = 600 * 2**20
"""Of a worker with its libraries, the built-in street and the compiled kernels [B]: measured."""
COPIES_OF_PICTURES = 2.5
"""Memory of a clip over the size of its frames [1]: measured between 11 and 81 frames, with and without labels."""
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
    numbers = sum(
        np.dtype(array.dtype).itemsize
        * int(np.prod([DIMENSION_SIZES[dimension] for dimension in array.dimensions]))
        for array in arrays_of(settings.labels, settings.has_objects).values()
    )
    pixels = settings.frames * camera.width * camera.height if settings.pictures else 0
    return int(BASE_BYTES + COPIES_OF_PICTURES * numbers * pixels + BYTES_PER_TICK * ticks)


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
