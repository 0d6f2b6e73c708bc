"""Frozen vehicles: a catalogue file that says where its numbers come from and carries a hash over itself."""

import hashlib
from collections.abc import Mapping
from typing import Annotated, Any, Literal

import yaml
from pydantic import Field

from catalogs.quantities import CatalogueEntry, Number, Text
from catalogs.sentences import shorten
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
    body = plain_text({**entry, "provenance": dict(provenance)}, title)
    return f"{body}{SEAL}{hashlib.sha256(body.encode()).hexdigest()}\n"


def plain_text(entry: Mapping[str, Any], title: str) -> str:
    """The text of a vehicle file that is not frozen.

    Parameters
    ----------
    entry : the vehicle's catalogue entry, as plain values
    title : first line, a comment
    """
    return f"# {title}\n" + yaml.safe_dump(dict(entry), sort_keys=False, width=110, default_flow_style=None)


def check_seal(content: bytes, origin: object) -> None:
    """Make sure that a frozen file still is what was frozen; a file without provenance has no seal to check.

    Parameters
    ----------
    content : of a vehicle file
    origin : where it comes from, for the sentence

    Raises
    ------
    InputError
        If its content has another hash than its last line says.
    """
    content = content.replace(b"\r\n", b"\n")
    if b"\nprovenance:" not in content:
        return
    body, found, seal = content.rpartition(f"\n{SEAL}".encode())
    digest = hashlib.sha256(body + b"\n").hexdigest()
    stated = seal.decode("utf-8", "replace").strip() if found else ""
    if stated != digest:
        raise InputError(
            f"{shorten(origin)}: a frozen vehicle must be as it was frozen; its content has the hash {digest}, its"
            f" last line says {shorten(stated, 64) or 'none'}: restore the file, or remove its provenance to make it"
            " a vehicle of your own"
        )
