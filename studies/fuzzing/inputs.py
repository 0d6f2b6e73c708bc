"""Input N of a parser: always the same bytes, whatever was made before it."""

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from random import Random
from typing import Any

import yaml

from studies.fuzzing import payloads, trees
from studies.fuzzing.parser import Parser
from studies.fuzzing.rules import Rule, format_place
from studies.fuzzing.seals import Files

KNOWINGLY = 0.35
"""Share of inputs that break a rule knowingly, where there is one to break."""
RESEALED = 0.8
"""Share of inputs whose seals are made again."""
TWICE, WHOLE, SEALED = "no key stands twice", "a file is whole", "seals fit"
LOST_BY_SEALING = (TWICE, WHOLE)
"""Rules that a JSON document keeps again once it was read and written."""
TREES = (".yaml", ".json", ".musync-written")
"""Forms that are read as trees."""
WHOLE_FILES = (".json", ".parquet", ".npy", ".ply", ".spz", ".png")
"""Forms of which no beginning is whole."""


@dataclass(frozen=True, kw_only=True)
class Input:
    """A mutated document.

    Parameters
    ----------
    document : name of the sound one that it comes from
    changed : files that differ from it
    what : what was done, in words
    broken : the rule that it breaks knowingly; None where it may be accepted
    """

    document: str
    changed: Mapping[str, bytes]
    what: str
    broken: str | None


class Documents:
    """The sound documents of one parser, read once.

    Parameters
    ----------
    parser : whose
    folder : where `Parser.write` wrote them
    """

    def __init__(self, parser: Parser, folder: Path):
        self.parser = parser
        self.files: dict[str, Files] = {
            document.name: {
                path.relative_to(document).as_posix(): path.read_bytes()
                for path in sorted(document.rglob("*"))
                if path.is_file()
            }
            for document in sorted(folder.iterdir())
        }
        self._trees: dict[tuple[str, str], Any] = {}

    def tree(self, document: str, file: str) -> Any:
        """A YAML or JSON file as plain values."""
        key = document, file
        if key not in self._trees:
            load = yaml.safe_load if file.endswith(".yaml") else json.loads
            self._trees[key] = load(self.files[document][file])
        return self._trees[key]


def make_input(documents: Documents, seed: int, number: int) -> Input:
    """Input ``number`` of the parser under a seed."""
    parser = documents.parser
    rng = Random(f"{seed}/{parser.name}/{number}")
    document = rng.choice(list(documents.files))
    files = documents.files[document]
    file = rng.choice([name for name in files if parser.mutates(name)])
    knowing = _break_knowingly(rng, documents, document, file) if rng.random() < KNOWINGLY else None
    content, what, rule = knowing or (*_change_content(rng, documents, document, file), None)
    changed: Files = {file: content}
    if rule is None and content != files[file] and re.fullmatch(parser.sealed or "", file):
        rule = SEALED
    if parser.reseal is not None and not (
        knowing and not file.endswith(".yaml") and knowing[2] in LOST_BY_SEALING
    ):
        try:
            whole = parser.reseal(files | changed, file) if rng.random() < RESEALED else None
        except (ValueError, TypeError, KeyError, AttributeError, RecursionError):
            whole = None
        if whole is not None:
            changed = {name: data for name, data in whole.items() if files.get(name) != data}
            rule = knowing[2] if knowing else None
    return Input(document=document, changed=changed, what=f"{document}/{file}: {what}", broken=rule)


def _break_knowingly(
    rng: Random, documents: Documents, document: str, file: str
) -> tuple[bytes, str, str] | None:
    """Content that breaks a rule, how, and which; None where the file is under no rule."""
    parser, content = documents.parser, documents.files[document][file]
    rules = list(parser.rules)
    if file.endswith(TREES):
        yaml_form = file.endswith(".yaml")
        tree = documents.tree(document, file)

        def known(path: tuple[Any, ...]) -> bool:
            return (
                parser.known_keys is not None
                and re.fullmatch(parser.known_keys, format_place(path)) is not None
            )

        match rng.randrange(5):
            case 0:
                made, rule = trees.with_key_twice(rng, tree), TWICE
            case 1:
                if parser.known_keys is None:
                    return None
                made, rule = trees.with_unknown_key(rng, tree, known), "no key is unknown"
            case 2:
                text = trees.format_tree(tree, yaml_form).encode()
                return payloads.truncate_content(rng, text) or b"{", "truncated", WHOLE
            case _:
                if not rules:
                    return None
                picked = rng.choice(rules)
                made, rule = trees.break_rule(rng, tree, picked), picked.name
        return (
            None
            if made is None
            else (trees.format_tree(made, yaml_form).encode(errors="surrogatepass"), rule, rule)
        )
    if file.endswith(WHOLE_FILES) and rng.random() < 0.4:
        return payloads.truncate_content(rng, content), "truncated", WHOLE
    picked = rng.choice(rules) if rules else None
    made_bytes = None if picked is None else _broken_payload(rng, file, content, picked)
    return None if made_bytes is None or picked is None else (made_bytes, picked.name, picked.name)


def _broken_payload(rng: Random, file: str, content: bytes, rule: Rule) -> bytes | None:
    if file.endswith(".csv"):
        return payloads.broken_cell(rng, content.decode(), rule)
    if file.endswith(".txt"):
        return payloads.broken_word(rng, content.decode(), rule)
    return payloads.broken_column(rng, content, rule) if file.endswith(".parquet") else None


def _change_content(rng: Random, documents: Documents, document: str, file: str) -> tuple[bytes, str]:
    """Content that may or may not break a rule, and what was done to it."""
    content = documents.files[document][file]
    if rng.random() < 0.1:
        return payloads.odd_bytes(rng, content), "bytes changed"
    if file.endswith(TREES):
        if rng.random() < 0.25:
            return payloads.odd_text(rng, content.decode()), "text changed"
        yaml_form, tree = file.endswith(".yaml"), documents.tree(document, file)
        text = trees.format_tree(trees.change_oddly(rng, tree, yaml_form), yaml_form)
        return text.encode(errors="surrogatepass"), "a value changed"
    if file.endswith((".csv", ".txt")):
        return payloads.odd_text(rng, content.decode()), "text changed"
    if file.endswith(".parquet") and rng.random() < 0.7:
        return payloads.odd_table(rng, content), "a column changed"
    if file.endswith(".npy") and rng.random() < 0.8:
        return payloads.odd_array(rng, content), "an array changed"
    if file.endswith(".ply") and rng.random() < 0.5:
        return payloads.odd_header(rng, content, b"end_header"), "a header changed"
    if file.endswith((".ply", ".splat")) and rng.random() < 0.5:
        return payloads.odd_numbers(rng, content), "numbers changed"
    return payloads.odd_bytes(rng, content), "bytes changed"
