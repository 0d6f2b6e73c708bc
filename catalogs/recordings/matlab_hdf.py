"""Variables of MATLAB 7.3 files, read by h5py: HDF5 whose groups are structs and whose dimensions are reversed."""

import io
from collections.abc import Iterator
from contextlib import contextmanager
from math import prod
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from catalogs.recordings.forms import MOST_NAMES, import_package
from catalogs.recordings.matlab_values import (
    DEEPEST_STRUCT,
    Array,
    Refused,
    Struct,
    refuse_object,
    spread_elements,
    squeeze_shape,
)
from tasks.errors import InputError

HDF_SIGNATURE = b"\x89HDF\r\n\x1a\n"
"""First bytes of HDF5; MATLAB writes 512 bytes of its own before them."""
LARGEST_CHUNK = 2**28
"""Bytes of a dataset that HDF5 unpacks at once [1]."""
LONGEST_TEXT = 200
"""Characters of a text that may be a unit [1]."""


@contextmanager
def open_hdf_variables(content: bytes) -> Iterator[Struct]:
    """Open the variables of a file of version 7.3; numbers are read from it when they are needed.

    Parameters
    ----------
    content : the file

    Raises
    ------
    InputError
        If h5py is not installed, or the file has too many values.
    """
    h5py = import_package("h5py", "MATLAB 7.3 files", "mat")
    with h5py.File(io.BytesIO(content), "r") as file:
        yield _Variables(h5py, file).convert_group(file, 0)


class _Variables:
    """The conversion of one file, which counts values: links can lead to a group in many ways."""

    def __init__(self, h5py: ModuleType, file: Any):
        self._h5py, self._file, self._count = h5py, file, 0

    def convert_group(self, group: Any, depth: int) -> Struct:
        return spread_elements(
            (name, self._follow_link(group, name, depth)) for name in group if not name.startswith("#")
        )

    def _follow_link(self, group: Any, name: str, depth: int) -> Any:
        self._count += 1
        if self._count > MOST_NAMES:
            raise InputError(f"must have at most {MOST_NAMES} values; it has more")
        if not isinstance(group.get(name, getlink=True), self._h5py.HardLink):
            return Refused(reason="must stand in the file itself; it is a link to another place")
        return self._convert_value(group[name], depth)

    def _convert_value(self, value: Any, depth: int) -> Any:
        kind = _read_class(value)
        if "MATLAB_object_decode" in value.attrs or kind in ("function_handle", "cell"):
            return refuse_object(
                {"function_handle": "function handle", "cell": "cell array"}.get(kind, "MATLAB object")
            )
        if isinstance(value, self._h5py.Group):
            if depth >= DEEPEST_STRUCT:
                return Refused(reason=f"must stand in at most {DEEPEST_STRUCT} structs")
            return self._convert_struct(value, depth + 1)
        if value.is_virtual or value.external:
            return Refused(reason="must stand in the file itself; it is stored in others")
        if value.dtype.kind not in "iufb" or "MATLAB_empty" in value.attrs:
            return Refused(reason="must be of real numbers; it is empty, complex or of another class")
        if prod(value.chunks or (0,)) * value.dtype.itemsize > LARGEST_CHUNK:
            return Refused(
                reason=f"must be stored in pieces of at most {LARGEST_CHUNK} bytes; they are larger"
            )
        if kind == "char":
            return (
                "".join(map(chr, value[()].ravel()))
                if value.size <= LONGEST_TEXT
                else Refused(reason="is text")
            )
        return Array(shape=squeeze_shape(value.shape[::-1]), read=lambda: _read_numbers(value))

    def _convert_struct(self, group: Any, depth: int) -> Any:
        """Return a struct; or a list, where each field holds references to the elements of an array of structs."""
        fields = {name: group[name] for name in group if self._holds_elements(group, name)}
        if not fields or len(fields) != len(group):
            return self.convert_group(group, depth)
        count = min(field.size for field in fields.values())
        return [
            spread_elements(
                (name, self._convert_value(self._file[field[()].ravel()[k]], depth))
                for name, field in fields.items()
            )
            for k in range(min(count, MOST_NAMES))
        ]

    def _holds_elements(self, group: Any, name: str) -> bool:
        if not isinstance(group.get(name, getlink=True), self._h5py.HardLink):
            return False
        value = group[name]
        return (
            isinstance(value, self._h5py.Dataset)
            and self._h5py.check_ref_dtype(value.dtype) is self._h5py.Reference
            and not _read_class(value)
        )


def _read_class(value: Any) -> str:
    kind = value.attrs.get("MATLAB_class", b"")
    return kind.decode("ascii", "replace") if isinstance(kind, bytes) else str(kind)


def _read_numbers(value: Any) -> NDArray[np.float64]:
    # HDF5 keeps MATLAB's dimensions in reverse order
    numbers: NDArray[np.float64] = np.asarray(value[()], dtype=np.float64).T
    return numbers.reshape(squeeze_shape(numbers.shape))
