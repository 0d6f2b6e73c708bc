"""Values of a MATLAB file in one form, whichever library reads them."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from catalogs.recordings.forms import MOST_COLUMNS

DEEPEST_STRUCT = 32
"""Structs inside each other [1]."""


@dataclass(frozen=True, kw_only=True)
class Array:
    """Numbers that are read when they are needed.

    Parameters
    ----------
    shape : in MATLAB's order of dimensions, without those of one element
    read : returns the values as float64, in that order
    """

    shape: tuple[int, ...]
    read: Callable[[], NDArray[np.float64]]


@dataclass(frozen=True, kw_only=True)
class Refused:
    """A value that is no signal, and why: a sentence's end."""

    reason: str


Struct = dict[str, Any]
"""Name to `Struct`, `Array`, `Refused`, or text."""


def refuse_object(kind: str) -> Refused:
    """Return the refusal of a value that only MATLAB itself can read.

    Parameters
    ----------
    kind : MATLAB's class of it
    """
    return Refused(
        reason=f"must be of numbers; it is a {kind}, which only MATLAB reads: save it as a struct of vectors, such as"
        " s.Time and s.Data"
    )


def squeeze_shape(shape: Iterable[int]) -> tuple[int, ...]:
    """Return the dimensions of more than one element, or none."""
    return tuple(int(count) for count in shape if count != 1)


def spread_elements(fields: Iterable[tuple[str, Any]]) -> Struct:
    """Return the fields of a struct; elements of an array of structs get MATLAB's names, such as ``signals(2)``.

    Parameters
    ----------
    fields : names and values, where the value of structs is a list
    """
    struct: Struct = {}
    for name, value in fields:
        if not isinstance(value, list):
            struct[name] = value
        elif len(value) == 1:
            struct[name] = value[0]
        elif len(value) > MOST_COLUMNS:
            struct[name] = Refused(
                reason=f"must be an array of at most {MOST_COLUMNS} structs; it has {len(value)}"
            )
        else:
            struct |= {f"{name}({k + 1})": element for k, element in enumerate(value)}
    return struct
