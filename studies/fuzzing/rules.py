"""Rules that a mutation breaks knowingly: an input that is accepted all the same is a finding."""

import math
import re
from dataclasses import dataclass
from typing import Any

Path = tuple[Any, ...]
"""Keys and positions from a document's root."""


@dataclass(frozen=True, kw_only=True)
class Rule:
    """One rule of a document, and values that break it.

    Parameters
    ----------
    name : the rule, in words
    where : regular expression that a place must match in full; its keys are joined by ``|``, ``runs.csv``'s cells
        are ``column``
    values : each breaks the rule at such a place
    of_keys : the values take the place of the key, not of what it holds
    numbers_only : the rule holds for places that hold a number
    """

    name: str
    where: str
    values: tuple[Any, ...]
    of_keys: bool = False
    numbers_only: bool = False

    def holds_at(self, path: Path, value: Any) -> bool:
        """Whether a place of a sound document is under the rule."""
        is_number = isinstance(value, int | float) and not isinstance(value, bool)
        return (is_number or not self.numbers_only) and re.fullmatch(
            self.where, format_place(path)
        ) is not None


def format_place(path: Path) -> str:
    """A place in a document as text."""
    return "|".join(str(key) for key in path)


NAN, INF = math.nan, math.inf
OUTSIDE = ("../x", "/etc/passwd", "a/../../x", "..", "", "a\x00b", "./../x")
"""Names of files that do not lie in the folder of their document, or are no names."""
WRONG_IDS = (
    "../0123456789abcde",
    "0123456789ABCDEF",
    "0123456789abcde",
    "",
    "0123456789abcdef\n",
    7,
    None,
    "*" * 16,
)
WRONG_HASHES = ("0" * 63, "z" * 64, "", 7, None, "../" + "0" * 61)

FINITE = Rule(name="numbers are finite", where=r".*", values=(NAN, INF, -INF), numbers_only=True)
UNITS = Rule(name="units are those of the field", where=r"(?!printed)(.*\|)?unit", values=("furlong", "", 7))
"""A printed figure's unit is what is printed beside it."""
CELLS_FINITE = Rule(
    name="numbers are finite", where=r".*", values=("nan", "inf", "-inf", "1e999"), numbers_only=True
)


def files_inside(where: str, *, of_keys: bool = False) -> Rule:
    """Files lie in the folder of their document."""
    return Rule(name="files lie inside the folder", where=where, values=OUTSIDE, of_keys=of_keys)


def ids_keep_their_form(where: str) -> Rule:
    """Content ids are sixteen hexadecimal digits."""
    return Rule(name="ids keep their form", where=where, values=WRONG_IDS)


def hashes_keep_their_form(where: str) -> Rule:
    """Hashes are 64 hexadecimal digits."""
    return Rule(name="hashes keep their form", where=where, values=WRONG_HASHES)


def limit_values(where: str, *values: Any) -> Rule:
    """Numbers keep their physical limits; what a grid leaves out may lie beyond them."""
    return Rule(name="numbers keep their limits", where=rf"(?!exclude)(.*\|)?{where}", values=values)
