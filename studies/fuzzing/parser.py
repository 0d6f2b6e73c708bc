"""A parser of what a stranger may have written: sound documents, the loader, and the rules that it keeps."""

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from studies.fuzzing import seals, sound
from studies.fuzzing.rules import FINITE, UNITS, Rule


@dataclass(frozen=True, kw_only=True)
class Parser:
    """One parser.

    Parameters
    ----------
    name : of the parser
    write : writes its sound documents
    read : calls the real loader on a folder with one document
    targets : names of the files that are mutated, as regular expressions
    share : of all inputs, by weight [1]
    rules : that mutations break knowingly
    known_keys : places of mappings, as a regular expression, that take no unknown key; None where all are taken
    reseal : makes seals fit again; None without seals
    sealed : names, as a regular expression, of files that must be refused when they changed and the seals did not
    writes : the loader changes the document's folder
    """

    name: str
    write: sound.Writer
    read: Callable[[Path], object]
    targets: tuple[str, ...] = (r".*",)
    share: float = 1.0
    rules: tuple[Rule, ...] = ()
    known_keys: str | None = None
    reseal: seals.Resealing | None = None
    sealed: str | None = None
    writes: bool = False

    def mutates(self, file: str) -> bool:
        """Whether a file of the document is mutated."""
        return any(re.fullmatch(target, file) for target in self.targets)


def parse_entries(
    name: str,
    pattern: str,
    load: Callable[[Path], object],
    *,
    share: float = 1.0,
    reseal: seals.Resealing | None = None,
    rules: tuple[Rule, ...] = (),
) -> Parser:
    """A parser of catalogue files: everything has a unit and nothing is unknown or infinite."""
    return Parser(
        name=name, write=sound.copy_entries(pattern), read=lambda folder: load(folder / "entry.yaml"), share=share,
        rules=(FINITE, UNITS, *rules), known_keys=".*", reseal=reseal,
    )  # fmt: skip
