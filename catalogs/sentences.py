"""Sentences about faulty input: values and lists cut to what a reader takes in, and pydantic's rules in words."""

import re
from collections.abc import Callable, Iterable, Sequence
from reprlib import Repr
from typing import Any

from pydantic import ValidationError

KeyPath = tuple[int | str, ...]
"""Keys and numbers that lead to a value of a document."""
MOST_PROBLEMS = 20
"""Problems reported of one document [1]: more do not fit on a screen, and the first ones often cause the rest."""

_SHORT = Repr()
_SHORT.maxstring = _SHORT.maxother = _SHORT.maxlong = 60
_SHORT.maxdict = _SHORT.maxlist = _SHORT.maxtuple = _SHORT.maxset = 4
_SHORT.maxlevel = 3


def shorten(text: object, most: int = 200) -> str:
    """The text on one line; where it is too long, its start and its end.

    Parameters
    ----------
    text : what to show, such as a path or another library's message
    most : characters to keep [1]
    """
    line = " ".join("".join(c if c.isprintable() else " " for c in str(text)[: 2 * most]).split())
    whole = len(str(text)) <= 2 * most
    if whole and len(line) <= most:
        return line
    tail = "".join(c if c.isprintable() else " " for c in str(text)[-most // 3 :])
    return f"{line[: most - len(tail) - 3]}...{tail}"


def name_some(labels: list[str]) -> str:
    """The first of some labels, and how many more there are.

    Parameters
    ----------
    labels : one or more
    """
    return shorten(labels[0]) if len(labels) == 1 else f"{shorten(labels[0])} and {len(labels) - 1} more"


def shorten_value(value: object, most: int = 60) -> str:
    """A value as code shows it, cut to a few words.

    Parameters
    ----------
    value : any value of a document
    most : characters to keep [1]
    """
    return shorten(_SHORT.repr(value), most)


def cap_problems(problems: Sequence[str], most: int = MOST_PROBLEMS) -> list[str]:
    """The first problems, and how many more there are.

    Parameters
    ----------
    problems : one sentence each
    most : sentences to keep [1]
    """
    if len(problems) <= most:
        return list(problems)
    return [*problems[:most], f"... and {len(problems) - most} more problems"]


def is_encodable(text: str) -> bool:
    """Whether the text can be written as UTF-8: half of a surrogate pair cannot.

    Parameters
    ----------
    text : any text
    """
    try:
        text.encode()
    except UnicodeEncodeError:
        return False
    return True


def describe_rules(
    error: ValidationError, origin: object, known: Callable[[KeyPath], Iterable[str]] = lambda _: ()
) -> list[str]:
    """Every rule that a document breaks, one sentence each.

    Parameters
    ----------
    error : of the model that the document was held against
    origin : of the document
    known : keys that exist in the table at a key path; listed where a key is unknown
    """
    where = shorten(origin)
    return [f"{where}: {_describe_rule(problem, known)}" for problem in error.errors(include_url=False)]


def _describe_rule(problem: Any, known: Callable[[KeyPath], Iterable[str]]) -> str:
    parts = [str(part) for part in problem["loc"] if part != "[key]"]
    key_path = shorten(".".join(parts) or "the whole document", 120)
    match problem["type"]:
        case "missing":
            return f"{key_path} is missing: add it"
        case "extra_forbidden":
            there = ", ".join(known(problem["loc"][:-1]))
            names = f" (known here are {there})" if there else ""
            return f"{key_path}: unknown key{names}: remove it or correct its name"
        case "value_error":
            rule = shorten(problem["msg"].removeprefix("Value error, "), 1000)
            return f"{key_path}: {rule}" if parts else rule
        case "dict_type" | "model_type" | "model_attributes_type":
            return f"{key_path}: must be a table of keys and values; it is {shorten_value(problem['input'])}"
        case _:
            rule = problem["msg"].replace("Input should be", "must be")
            remedy = _suggest_form(problem["type"], problem["input"])
            return f"{key_path}: {rule}; it is {shorten_value(problem['input'])}{remedy}"


def _suggest_form(rule: str, value: object) -> str:
    """Return what to write in place of a number given as text, or the reverse; empty where that is not clear."""
    if rule == "string_type" and isinstance(value, bool | int | float):
        return ": put it in quotes"
    if rule not in {"float_type", "int_type"} or not isinstance(value, str):
        return ""
    if re.fullmatch(r"[+-]?\d*,\d+", value):
        return f": write it with a point, {value.replace(',', '.')}"
    if found := re.fullmatch(r"([+-]?)(\d*)\.?(\d*)[eE]([+-]?)(\d+)", value):
        sign, whole, part, direction, power = found.groups()
        return f": YAML wants the point and the sign of the power, {sign}{whole}.{part or 0}e{direction or '+'}{power}"
    if re.fullmatch(r"[+-]?[\d.]+ *%", value):
        return ": write it without the sign, in the unit that stands beside it"
    return ""
