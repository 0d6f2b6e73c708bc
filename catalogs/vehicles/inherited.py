"""A vehicle that extends another one: what its file does not give is that of the other vehicle."""

import hashlib
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from catalogs.documents import LARGEST_YAML, parse_yaml, read_content
from catalogs.entries import YAML, find_entry
from catalogs.names import find_name_problem
from catalogs.sentences import shorten, shorten_value
from catalogs.vehicles.frozen import check_seal, frozen_text, plain_text
from tasks.errors import InputError

EXTENDS = "extends"
NESTED = {"families": 2, "effects": 1}
"""Groups that are inherited key by key, and how many tables lie inside each other there."""
MOST_GENERATIONS = 8
"""Files that may extend each other [1]: more is no car that a reader can follow."""


@dataclass(frozen=True, kw_only=True)
class Generation:
    """One file of a vehicle: its own, that of the vehicle which it extends, and so on.

    Parameters
    ----------
    source : the file
    content : its bytes
    """

    source: Path
    content: bytes

    @cached_property
    def table(self) -> dict[str, Any]:
        """Keys and values that the file gives itself, ``extends`` among them."""
        return parse_yaml(self.content, self.source, "vehicle", finite=False)


def read_generations(content: bytes, source: Path) -> list[Generation]:
    """Return the files that make a vehicle, the vehicle's own first.

    Parameters
    ----------
    content, source : of the vehicle's file

    Raises
    ------
    InputError
        If a file cannot be read, was frozen and changed, extends no vehicle that exists, or leads back to itself.
    """
    line: list[Generation] = []
    seen: list[str] = []
    while True:
        seen.append(os.path.realpath(source))
        check_seal(content, source)
        line.append(Generation(source=source, content=content))
        # most files extend nothing and are parsed once, by the model that checks them
        if EXTENDS.encode() not in content or EXTENDS not in (table := line[-1].table):
            return line
        if "provenance" in table:
            raise InputError(
                f"{shorten(source)}: a frozen vehicle must be whole; it has provenance and extends: remove one of them"
            )
        source = _find_parent(table[EXTENDS], source)
        chain = " -> ".join(shorten(one.source.name, 60) for one in line) + f" -> {shorten(source.name, 60)}"
        if os.path.realpath(source) in seen:
            raise InputError(
                f"{shorten(line[0].source)}: extends must end at a vehicle that extends none; {chain} leads back to"
                " itself: remove one extends"
            )
        if len(line) == MOST_GENERATIONS:
            raise InputError(
                f"{shorten(line[0].source)}: at most {MOST_GENERATIONS} files may extend each other; there are more:"
                f" {chain}"
            )
        content = read_content(source, "vehicle", LARGEST_YAML)


def join_generations(line: Sequence[Generation]) -> bytes:
    """Return the file of a vehicle with everything in it that it inherits; of a single file its own bytes.

    Its first line has the hash of the vehicle's own file and of the whole vehicle that this one extends. What a
    frozen vehicle leaves in it keeps the mode and the bounds that it was fitted in.

    Parameters
    ----------
    line : of `read_generations`, parents that are sound
    """
    *younger, oldest = line
    content, table, parent = oldest.content, oldest.table if younger else {}, oldest
    for young in reversed(younger):
        table = inherit_entry(table, young.table)
        before = table.pop("provenance", None)
        parent_hash, own_hash = (hashlib.sha256(c).hexdigest() for c in (content, young.content))
        title = (
            f"{shorten(young.source.name, 60)} (SHA-256 {own_hash}) over {shorten(parent.source.name, 60)}"
            f" (SHA-256 {parent_hash}), whole"
        )
        if before is None:
            text = plain_text(table, title)
        else:
            provenance = {key: value for key, value in before.items() if key != "sha256"} | {
                "base": parent.source.stem,
                "base_sha256": parent_hash,
                "procedure": f"numbers of its own over those of {parent.source.stem}: {before['procedure']}",
                "procedure_sha256": own_hash,
            }
            text = frozen_text(table, provenance, title)
            table = {**table, "provenance": provenance}
        content, parent = text.encode(), young
    return content


def inherit_entry(parent: Mapping[str, Any], own: Mapping[str, Any]) -> dict[str, Any]:
    """Return the content of a vehicle file over that of the vehicle which it extends.

    A number is inherited or given whole; families, their tables and effects are inherited one by one; the list of
    forms as a whole.

    Parameters
    ----------
    parent : content of the vehicle that is extended, itself whole
    own : content of the file that extends it
    """
    table = {**parent, **own}
    table.pop(EXTENDS, None)
    for group, depth in NESTED.items():
        if group in own and group in parent:
            table[group] = _merge(parent[group], own[group], depth)
    return table


def _merge(parent: Any, own: Any, depth: int) -> Any:
    if depth == 0 or not isinstance(parent, dict) or not isinstance(own, dict):
        return own
    return {**parent, **{key: _merge(parent.get(key), value, depth - 1) for key, value in own.items()}}


def _find_parent(name: object, child: Path) -> Path:
    """The file of the vehicle that a file extends: one of the catalogue, or beside it where the name has a suffix."""
    where = shorten(child)
    if not isinstance(name, str):
        raise InputError(f"{where}: extends must be the name of a vehicle; it is {shorten_value(name)}")
    if problem := find_name_problem(name):
        raise InputError(f"{where}: the name of the vehicle that it extends must {problem}")
    try:
        return find_entry("vehicle", child.with_name(name) if Path(name).suffix in YAML else name)
    except InputError as error:
        raise InputError(
            f"{where}: extends must be a vehicle of the catalogue or a file beside this one; {error}"
        ) from None
