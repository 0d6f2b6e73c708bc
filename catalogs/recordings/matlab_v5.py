"""Variables of MATLAB files up to version 7, read by scipy: numbers, text and structs; code and objects stay unread."""

import io
import warnings
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.io import loadmat
from scipy.io.matlab import MatlabFunction, MatlabObject, MatlabOpaque, mat_struct

from catalogs.recordings.forms import LARGEST_FILE
from catalogs.recordings.matlab_elements import check_elements
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
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        loaded = loadmat(io.BytesIO(content), struct_as_record=False, squeeze_me=False, chars_as_strings=True)
    twice = [str(warning.message) for warning in told if "Duplicate variable name" in str(warning.message)]
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
