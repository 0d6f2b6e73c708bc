"""Frozen vehicles: a catalogue file that says where its numbers come from and carries a hash over itself."""

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

import yaml
from pydantic import Field

from catalogs.quantities import CatalogueEntry, Number, Text
from tasks.errors import InputError

Digest = Annotated[str, Field(pattern="^[0-9a-f]{64}$")]
SEAL = "  sha256: "
"""How the last line of a frozen file begins; the hash covers all bytes before it."""


class StageSummary(CatalogueEntry):
    """One stage as it was run."""

    name: Text
    groups: tuple[Text, ...]
    responses: tuple[Text, ...]
    kinds: tuple[Text, ...]
    phase: Text


class Limits(CatalogueEntry):
    """Bounds of one group."""

    unit: Text
    lower: Number
    upper: Number


class Provenance(CatalogueEntry):
    """Where the numbers of a frozen vehicle come from.

    ``mode`` is the model they were fitted in: with the other one they mean something else.
    """

    mode: Literal["paper", "coupled"]
    base: Text
    base_sha256: Digest
    procedure: Text
    procedure_sha256: Digest
    version: Text
    split: Text
    data_sha256: dict[Text, Digest]
    stages: tuple[StageSummary, ...]
    bounds: dict[Text, Limits]
    sha256: Digest


def frozen_text(entry: Mapping[str, Any], provenance: Mapping[str, Any], title: str) -> str:
    """The text of a frozen vehicle file.

    Parameters
    ----------
    entry : the vehicle's catalogue entry, as plain values
    provenance : all of ``Provenance`` but its hash
    title : first line, a comment
    """
    content = {**entry, "provenance": dict(provenance)}
    body = f"# {title}\n" + yaml.safe_dump(content, sort_keys=False, width=110, default_flow_style=None)
    return f"{body}{SEAL}{hashlib.sha256(body.encode()).hexdigest()}\n"


def check_seal(source: Path) -> None:
    """Make sure that a frozen file still is what was frozen; a file without provenance has no seal to check.

    Parameters
    ----------
    source : vehicle file

    Raises
    ------
    InputError
        If its content has another hash than its last line says.
    """
    text = source.read_text(encoding="utf-8")
    if "\nprovenance:" not in text:
        return
    body, found, seal = text.rpartition(f"\n{SEAL}")
    digest = hashlib.sha256(f"{body}\n".encode()).hexdigest()
    if not found or seal.strip() != digest:
        raise InputError(
            f"{source}: a frozen vehicle must be as it was frozen; its content has the hash {digest}, its last line"
            f" says {seal.strip() or 'none'}: restore the file, or remove its provenance to make it a vehicle of"
            " your own"
        )
