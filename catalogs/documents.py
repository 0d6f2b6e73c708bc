"""YAML and JSON text becomes plain values here and nowhere else: bounded, unambiguous, all faults reported at once.

What comes out holds text, finite numbers, booleans, nulls, lists, and tables whose keys are distinct text.
"""

import json
import os
import re
import stat
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np

from catalogs.sentences import cap_problems, is_encodable, shorten, shorten_value
from catalogs.yaml_text import DEEPEST, LARGEST_INTEGER, load_yaml
from tasks.errors import InputError

LARGEST_YAML = 8 * 2**20
"""Bytes of a YAML document [1]: 20,000 scenarios written one by one take 2 MB."""
LARGEST_JSON = 2**30
"""Bytes of a JSON document [1]: the manifest of 10,000 clips takes 20 MB."""
_NOT_STRUCTURE = bytes(set(range(256)) - set(b'"[]{}'))
_STEPS = bytes.maketrans(b'[]{}"', b"\x01\xff\x01\xff\x00")
_BLOCK = 2**18
"""Brackets and quotes that are counted at once [1]: a whole document's would take many times its own memory."""
_BACKSLASH_PAIR = re.compile(rb"\\.", re.DOTALL)
_SURROGATE = re.compile(r"\\u[dD][89abAB]")


def read_content(path: Path, kind: str, largest: int) -> bytes:
    """The bytes of a regular file; anything else is refused without waiting for it.

    Parameters
    ----------
    path : the file
    kind : what it is called in the sentence
    largest : bytes it may have [1]

    Raises
    ------
    InputError
        If it is missing, unreadable, too large or no regular file.
    """
    where = shorten(path)
    try:
        with open(path, "rb", opener=lambda name, flags: os.open(name, flags | os.O_NONBLOCK)) as file:
            state = os.fstat(file.fileno())
            if not stat.S_ISREG(state.st_mode):
                raise InputError(f"{where}: a {kind} must be a regular file; it is a folder, pipe or device")
            if state.st_size > largest:
                raise InputError(
                    f"{where}: a {kind} must have at most {largest} bytes; it has {state.st_size}"
                )
            return file.read(state.st_size)
    except FileNotFoundError:
        raise InputError(f"{where}: no such file; a {kind} must exist") from None
    except OSError as error:
        raise InputError(f"{where}: a {kind} must be readable; {error.strerror}") from None
    except InputError:
        raise
    except ValueError as error:  # a name with NUL, or with characters that no file name can have
        raise InputError(f"{where}: a {kind} must have a proper file name; {shorten(error)}") from None


def parse_yaml(content: bytes, origin: object, kind: str, *, finite: bool = True) -> dict[str, Any]:
    """The table that YAML text holds.

    Parameters
    ----------
    content : UTF-8
    origin : where it comes from, for the sentences
    kind : what it is called in them
    finite : refuse infinite numbers and NaN here; False for a reader that does so beside its other rules

    Raises
    ------
    InputError
        One sentence for each fault: no UTF-8, no YAML, no table, too large, too deep, a key that stands twice or is
        no text, a number that is not finite or too large, a tag beyond plain values.
    """
    value = parse_yaml_value(content, origin, kind, finite=finite)
    if not isinstance(value, dict):
        raise InputError(
            f"{shorten(origin)}: a {kind} must be a table of keys and values; it is {shorten_value(value)}"
        )
    return value


def parse_yaml_value(content: bytes, origin: object, kind: str, *, finite: bool = True) -> Any:
    """The value that YAML text holds, be it a table, a list or a single value; the rules are those of `parse_yaml`.

    Parameters
    ----------
    content : UTF-8
    origin : where it comes from, for the sentences
    kind : what it is called in them
    finite : refuse infinite numbers and NaN here; False for a reader that does so beside its other rules

    Raises
    ------
    InputError
        One sentence for each fault.
    """
    start = f"{shorten(origin)}: a {kind} must"
    text = _decode_text(content, start, LARGEST_YAML)
    return load_yaml(text, start, finite=finite)


def read_json_document(path: Path, kind: str) -> Any:
    """The value that a JSON file holds; the rules are those of `parse_json`.

    Parameters
    ----------
    path : the file
    kind : what it is called in the sentences

    Raises
    ------
    InputError
        If it cannot be read or breaks a rule.
    """
    return parse_json(read_content(path, kind, LARGEST_JSON), path, kind)


def parse_json(content: bytes, origin: object, kind: str, *, large_integers: bool = False) -> Any:
    """The value that JSON text holds.

    Parameters
    ----------
    content : UTF-8
    origin : where it comes from, for the sentences
    kind : what it is called in them
    large_integers : let integers beyond 2^53 pass, for numbers that become floats, such as a logger's time in ns

    Raises
    ------
    InputError
        One sentence for each fault: no UTF-8, no JSON, too large, too deep, a key that stands twice, a number that
        is not finite or too large, half of a surrogate pair.
    """
    start = f"{shorten(origin)}: a {kind} must"
    text = _decode_text(content, start, LARGEST_JSON)
    if (depth := _measure_depth(content)) > DEEPEST:
        raise InputError(f"{start} have at most {DEEPEST} tables and lists inside each other; it has {depth}")
    problems: list[str] = []
    most, longest, rule = (2**63, 20, "2^63") if large_integers else (LARGEST_INTEGER, 17, "2^53")

    def build_table(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        table = dict(pairs)
        if len(table) != len(pairs):
            problems.append(
                f"have distinct keys in a table; {_name_repeated([key for key, _ in pairs])} twice"
            )
        return table

    def build_integer(digits: str) -> int:
        number = int(digits) if len(digits) <= longest else 2 * most
        if not -most <= number <= most:
            problems.append(f"have integers of at most {rule}; one is {shorten(digits, 40)}")
        return number

    def build_float(digits: str) -> float:
        number = float(digits)
        if not isfinite(number):
            problems.append(f"have finite numbers; one is {shorten(digits, 40)}")
        return number

    try:
        value = json.loads(
            text,
            object_pairs_hook=build_table,
            parse_int=build_integer,
            parse_float=build_float,
            parse_constant=build_float,
        )
    except ValueError as error:
        raise InputError(f"{start} be valid JSON; {shorten(error)}") from None
    if _SURROGATE.search(text) and not is_encodable(json.dumps(value, ensure_ascii=False)):
        problems.append("have whole characters; one is half of a surrogate pair")
    if problems:
        raise InputError(cap_problems([f"{start} {problem}" for problem in problems]))
    return value


def _decode_text(content: bytes, start: str, largest: int) -> str:
    if len(content) > largest:
        raise InputError(f"{start} have at most {largest} bytes; it has {len(content)}")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise InputError(f"{start} be UTF-8 text; line {line} is not: save it as UTF-8") from None


def _measure_depth(content: bytes) -> int:
    """Tables and lists inside each other in JSON text: the brackets outside strings, counted up and down."""
    if b"\\" in content:
        content = _BACKSLASH_PAIR.sub(b"", content)
    structure = content.translate(None, _NOT_STRUCTURE)
    deepest = depth = quotes = 0
    for start in range(0, len(structure), _BLOCK):
        block = structure[start : start + _BLOCK]
        quotes_before = quotes + (np.frombuffer(block, np.uint8) == ord('"')).cumsum(dtype=np.int64)
        steps = np.frombuffer(block.translate(_STEPS), np.int8)
        depths = depth + (steps * (quotes_before % 2 == 0)).cumsum(dtype=np.int64)
        deepest = max(deepest, int(depths.max()))
        depth, quotes = int(depths[-1]), int(quotes_before[-1])
    return deepest


def _name_repeated(keys: list[str]) -> str:
    twice = sorted({key for key in keys if keys.count(key) > 1})
    return f"{', '.join(shorten_value(key) for key in twice[:10])} {'stands' if len(twice) == 1 else 'stand'} there"
