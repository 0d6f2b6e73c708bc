"""Variables of MATLAB files up to version 7, read by scipy: numbers, text and structs; code and objects stay unread.

scipy's compiled reader takes types and counts as the file states them, and a wrong one ends the process: so every
element is held against the format first. Source: MathWorks, MAT-File Format (R2023b), level 5: tags, data types (table
1-1), array classes (table 1-3), subelements.
"""

import io
import struct
import warnings
import zlib
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.io import loadmat
from scipy.io.matlab import MatlabFunction, MatlabObject, MatlabOpaque, mat_struct

from catalogs.recordings.forms import LARGEST_FILE
from catalogs.recordings.matlab_values import (
    DEEPEST_STRUCT,
    Array,
    Refused,
    Struct,
    refuse_object,
    spread_elements,
    squeeze_shape,
)
from catalogs.sentences import shorten
from tasks.errors import InputError

HEADER, BLOCK = 128, 2**24
"""Bytes before the first element [1], and bytes that are unpacked at once [1]."""
MATRIX, COMPRESSED = 14, 15
"""Types of elements that hold others."""
NUMBERS, TEXT = frozenset((1, 2, 3, 4, 5, 6, 7, 9, 12, 13)), frozenset((16, 17, 18))
"""Types of elements with numbers, and with text as UTF."""
CELL, STRUCTURE, OBJECT, CHARACTERS, SPARSE, FUNCTION, OPAQUE = 1, 2, 3, 4, 5, 16, 17
"""Classes of arrays; those from 6 to 15 hold numbers."""
COMPLEX = 0x800
"""Flag of an array that has a second element, of imaginary parts."""
NAME = 2
"""Place of an array's name among its elements."""
DEEPEST_ARRAY = 64
"""Arrays inside each other [1]."""


def load_v5_variables(content: bytes) -> Struct:
    """Return the variables of a file of version 4, 5, 6 or 7.

    Parameters
    ----------
    content : the file

    Raises
    ------
    InputError
        If its elements break the format, or are too large when unpacked.
    """
    check_elements(content, LARGEST_FILE)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        loaded = loadmat(io.BytesIO(content), struct_as_record=False, squeeze_me=False, chars_as_strings=True)
    twice = [str(warning.message) for warning in caught if "Duplicate variable name" in str(warning.message)]
    if twice:
        raise InputError(
            f"must have distinct variables; {shorten(twice[0].split(' in stream')[0])}: save each under its own name"
        )
    return spread_elements(
        (name, _convert_value(value, 0)) for name, value in loaded.items() if not name.startswith("__")
    )


def _convert_value(value: Any, depth: int) -> Struct | list[Struct | Refused] | Array | Refused | str:
    if isinstance(value, MatlabFunction | MatlabObject | MatlabOpaque):
        return refuse_object("function handle" if isinstance(value, MatlabFunction) else "MATLAB object")
    if not isinstance(value, np.ndarray):
        return Refused(reason=f"must be of numbers; it is a {type(value).__name__}")
    if value.dtype == object and value.size and all(isinstance(entry, mat_struct) for entry in value.flat):
        return [_convert_fields(entry, depth) for entry in value.flatten("F")]
    if value.dtype.kind == "U":
        return str(value.flat[0]) if value.size == 1 else Refused(reason="must be of numbers; it is text")
    if value.dtype.kind not in "iufb":
        return Refused(reason="must be of real numbers; it is a cell array, complex or of another class")
    return Array(shape=squeeze_shape(value.shape), read=lambda: _to_numbers(value))


def _convert_fields(entry: mat_struct, depth: int) -> Struct | Refused:
    if depth >= DEEPEST_STRUCT:
        return Refused(reason=f"must stand in at most {DEEPEST_STRUCT} structs")
    return spread_elements((name, _convert_value(vars(entry)[name], depth + 1)) for name in entry._fieldnames)


def _to_numbers(value: NDArray[Any]) -> NDArray[np.float64]:
    return np.asarray(value, dtype=np.float64).reshape(squeeze_shape(value.shape))


def check_elements(content: bytes, most: int) -> None:
    """Check every element of a file of version 5 to 7; others are left to scipy, which reads version 4 in Python.

    Parameters
    ----------
    content : the file
    most : bytes that its packed elements may have when unpacked [1]

    Raises
    ------
    InputError
        If an element is cut off, of a type that cannot stand where it is, or the file is too large when unpacked.
    """
    order = {b"IM": "<", b"MI": ">"}.get(content[HEADER - 2 : HEADER])
    if order is None:
        return
    offset, total = HEADER, 0
    while offset < len(content):
        if offset + 8 > len(content):
            raise _refuse("ends within an element")
        kind, size = struct.unpack_from(f"{order}II", content, offset)
        element = memoryview(content)[offset : offset + 8 + size]
        if kind == COMPRESSED:
            unpacked = _unpack(bytes(element[8:]), most - total)
            total += len(unpacked)
            element = memoryview(unpacked)
        _check_array(element, order, 0)
        offset += 8 + size


def _unpack(packed: bytes, most: int) -> bytes:
    unpacker, pieces, total = zlib.decompressobj(), [], 0
    while packed and not unpacker.eof:
        pieces.append(unpacker.decompress(packed, BLOCK))
        packed, total = unpacker.unconsumed_tail, total + len(pieces[-1])
        if total > most:
            raise InputError(f"must have at most {most} bytes when unpacked; it has more")
    return b"".join(pieces)


def _check_array(element: memoryview, order: str, depth: int) -> None:
    """Check an element that must be an array, with all that it holds."""
    if depth > DEEPEST_ARRAY:
        raise InputError(f"must have at most {DEEPEST_ARRAY} arrays inside each other; it has more")
    if len(element) < 8 or struct.unpack_from(f"{order}II", element) != (MATRIX, len(element) - 8):
        raise _refuse("has an element that is no array, or cut off")
    parts = list(_split(element[8:], order))
    if not parts:  # an empty array inside a cell or a struct
        return
    if parts[0][0] != 6 or len(parts[0][1]) != 8:
        raise _refuse("has an array without its class")
    flags = struct.unpack_from(f"{order}I", parts[0][1])[0]
    array_class, is_complex = flags & 0xFF, bool(flags & COMPLEX)
    if not CELL <= array_class <= OPAQUE:
        raise _refuse("has an array of an unknown class")
    holds_arrays = array_class in (CELL, STRUCTURE, OBJECT, FUNCTION, OPAQUE)
    for index, (kind, content) in enumerate(parts[1:], start=1):
        if kind == MATRIX and holds_arrays:
            _check_array(content, order, depth + 1)
        elif kind not in NUMBERS and not (kind in TEXT and (array_class == CHARACTERS or index == NAME)):
            raise _refuse("has an element of a type that cannot stand in its array")
    if not holds_arrays and len(parts) != 3 + (3 if array_class == SPARSE else 1) + is_complex:
        raise _refuse("has an array with too many or too few elements")
    if array_class == STRUCTURE:
        _check_field_names(parts, order)


def _check_field_names(parts: list[tuple[int, memoryview]], order: str) -> None:
    """Check the length of a field's name, by which the text of all names is divided."""
    if len(parts) < 5 or len(parts[3][1]) != 4 or struct.unpack(f"{order}i", parts[3][1])[0] <= 0:
        raise _refuse("has a struct without names of fields")


def _split(content: memoryview, order: str) -> Iterator[tuple[int, memoryview]]:
    """Yield the type and the content of each element; an array's content keeps its tag."""
    offset = 0
    while offset < len(content):
        if offset + 8 > len(content):
            raise _refuse("ends within an element")
        kind, size = struct.unpack_from(f"{order}II", content, offset)
        small = kind >> 16
        if small:  # up to 4 bytes stand in the tag itself
            if small > 4:
                raise _refuse("has an element with a wrong tag")
            yield kind & 0xFFFF, content[offset + 4 : offset + 4 + small]
            offset += 8
            continue
        end = offset + 8 + size
        if end > len(content):
            raise _refuse("ends within an element")
        yield kind, content[offset:end] if kind == MATRIX else content[offset + 8 : end]
        offset = end + -size % 8


def _refuse(fault: str) -> InputError:
    return InputError(f"must be a whole MATLAB file; it {fault}")
