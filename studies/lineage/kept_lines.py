"""Catalogue lines that a dataset keeps: each number with key, unit and source, and the same file with one changed."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from catalogs.documents import parse_yaml_value
from catalogs.tyres import tyre_entries
from catalogs.vehicles.frozen import frozen_text, plain_text
from manifests.explain import kind_of_input

Place = tuple[str | int, ...]
"""Keys from the top of a file down to a line."""


@dataclass(frozen=True, kw_only=True)
class Line:
    """One catalogue line.

    Parameters
    ----------
    file : name under ``inputs/``
    place : keys that lead to it
    value : number, numbers or word
    unit, source : as they stand there; a tyre property file has one source for all its lines, and no units
    """

    file: str
    place: Place
    value: Any
    unit: str
    source: str

    @property
    def key(self) -> str:
        """The keys that lead to it, with dots between them."""
        return ".".join(str(part) for part in self.place)


def list_lines(name: str, content: bytes) -> list[Line]:
    """Every line of a kept file that has a value and a source.

    Parameters
    ----------
    name : of the file, under ``inputs/``
    content : of the file

    Raises
    ------
    InputError
        If it is no YAML.
    """
    if kind_of_input(name) == "tyre":
        source = describe_file(content)
        return [
            Line(file=name, place=(key,), value=number, unit="", source=source)
            for key, text in tyre_entries(content).items()
            if (number := _read_number(text)) is not None
        ]
    return [
        Line(file=name, place=place, value=leaf["value"], unit=str(leaf.get("unit", "")), source=leaf["source"])
        for place, leaf in _walk(parse_yaml_value(content, name, "catalogue entry"), ())
    ]  # fmt: skip


def describe_file(content: bytes) -> str:
    """Return the comment with which a kept file begins; an empty text where it begins with none."""
    words = []
    for line in content.decode("utf-8", "replace").splitlines():
        if not line.startswith(("#", "$")):
            break
        words.append(line.lstrip("#$ ").strip())
    return " ".join(words)


def scale_line(name: str, content: bytes, place: Place, factor: float) -> bytes:
    """The file with the numbers of one line scaled, its bounds among them; a frozen vehicle is frozen anew.

    Parameters
    ----------
    name, content : of the file
    place : of the line
    factor : on each number; a number that is 0 becomes ``factor - 1`` [1]
    """
    if kind_of_input(name) == "tyre":
        (key,) = place
        entry = re.compile(rf"^(\s*{re.escape(str(key))}\s*=\s*)([^\s$]+)", flags=re.M | re.I)

        def scale_entry(found: re.Match[str]) -> str:
            number = _read_number(found[2])
            return found[0] if number is None else found[1] + repr(_scale(number, factor))

        return entry.sub(scale_entry, content.decode("utf-8", "replace")).encode()
    table = parse_yaml_value(content, name, "catalogue entry")
    leaf = table
    for part in place:
        leaf = leaf[part]
    for part in ("value", "bounds"):
        if part in leaf:
            leaf[part] = _scale(leaf[part], factor)
    if isinstance(table, dict) and "provenance" in table:
        known = {key: value for key, value in table.pop("provenance").items() if key != "sha256"}
        return frozen_text(table, known, name).encode()
    return plain_text(table, name).encode()


def is_number(value: Any) -> bool:
    """Whether a line's value is a number or a list of them."""
    numbers = value if isinstance(value, list) else [value]
    return bool(numbers) and all(isinstance(n, int | float) and not isinstance(n, bool) for n in numbers)


def _scale(value: Any, factor: float) -> Any:
    if isinstance(value, list):
        return [_scale(number, factor) for number in value]
    return value * factor if value else factor - 1


def _walk(value: Any, place: Place) -> Iterator[tuple[Place, Mapping[str, Any]]]:
    if isinstance(value, Mapping):
        if "value" in value and isinstance(value.get("source"), str):
            yield place, value
            return
        for key, inner in value.items():
            yield from _walk(inner, (*place, key))
    elif isinstance(value, list):
        for index, inner in enumerate(value):
            yield from _walk(inner, (*place, index))


def _read_number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None
