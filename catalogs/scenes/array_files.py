"""Arrays of a scene folder: a .npy file is checked before memory is allocated for it."""

import math
import os
import stat
from io import BufferedReader
from pathlib import Path
from typing import Any

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from catalogs.sentences import shorten, shorten_value
from tasks.errors import InputError

LONGEST_HEADER = 1024
"""Characters of a header [1]: those that NumPy writes for these arrays take 118."""
HEADERS = {(1, 0): npy.read_array_header_1_0, (2, 0): npy.read_array_header_2_0}


def read_array(path: Path, dtype: type[np.generic], shape: tuple[int | None, ...]) -> NDArray[Any]:
    """An array of a .npy file.

    Parameters
    ----------
    path : the file
    dtype : of its numbers
    shape : None where any length goes

    Raises
    ------
    InputError
        If it is a link or no .npy file, or its header announces other numbers, another shape or another size.
    """
    with open_regular(path) as stream:
        try:
            version = npy.read_magic(stream)
            found, by_column, kind = HEADERS[version](stream, max_header_size=LONGEST_HEADER)
        except Exception as error:  # whatever a damaged header makes NumPy's parser raise
            raise InputError(f"{path}: must be a .npy file; {shorten(error)}") from None
        lengths = zip(found, shape, strict=False)
        if kind != np.dtype(dtype) or len(found) != len(shape) or any(b not in (None, a) for a, b in lengths):
            expected = ", ".join("N" if length is None else str(length) for length in shape)
            raise InputError(
                f"{path}: must hold {np.dtype(dtype)} of shape [{expected}]; it announces {shorten_value(kind)} of"
                f" shape {shorten_value(list(found))}"
            )
        announced = math.prod(found) * kind.itemsize
        there = os.fstat(stream.fileno()).st_size - stream.tell()
        if announced != there:
            raise InputError(
                f"{path}: must hold the {announced} bytes that its header announces; it holds {there}"
            )
        numbers = np.fromfile(stream, kind, math.prod(found))
    return numbers.reshape(found, order="F" if by_column else "C")


def open_regular(path: Path) -> BufferedReader:
    """A regular file, opened for reading; a link is not followed and a pipe not waited for.

    Raises
    ------
    InputError
        If it is missing, or anything else.
    """
    try:
        number = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC)
    except OSError as error:
        raise InputError(f"{path}: must be a regular file, and no link; {error.strerror}") from None
    if not stat.S_ISREG(os.fstat(number).st_mode):
        os.close(number)
        raise InputError(f"{path}: must be a regular file; it is none")
    return os.fdopen(number, "rb")
