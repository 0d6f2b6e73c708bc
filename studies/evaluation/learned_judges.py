"""Learned judges that a user has: a YAML file of local TorchScript checkpoints. Nothing is ever downloaded.

::

    clip: {checkpoint: ViT-B-32.pt, text_features: prompts.npy, source: openai/CLIP}
    dover: {checkpoint: dover.pt, source: VQAssessment/DOVER}

`text_features` is float [N, D]: the mean features of the prompts in clip_prompts.yaml (paper, Appendix D: dry, rain and
snow), a row a kind of weather in the file's order.

A checkpoint is a program: what it may call is looked through before any of it runs. Loading alone runs it, where a
class brings its own ``__setstate__``.
"""

import ast
import os
import re
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from catalogs.quantities import CatalogueEntry, Text, read_entry
from catalogs.sentences import shorten
from studies.evaluation.clip_prompts import load_prompts
from tasks.errors import InputError

JUDGES = ("clip", "dover", "fast_vqa", "lpips")
REACHES_FILES = {"from_file", "save"}
"""Operators that open files, whose names no checkpoint may hold: ``x.save(name)`` calls them too."""
NAMESPACES = {"aten", "prim", "quantized"}
"""Operators that compute; others talk to other processes, or come with a library."""
CLASSES = re.compile(rb"torch[.\n]classes[.\n](?!(?:quantized|rnn)\.)[\w.]{0,60}")
"""Classes of C++ but for those of quantised networks: some open files, or load libraries."""
DEBUG = ".debug_pkl"


class Checkpoint(CatalogueEntry):
    """One judge's file."""

    checkpoint: Text
    source: Text


class ClipCheckpoint(Checkpoint):
    """CLIP's file, and the features of the prompts."""

    text_features: Text


class JudgeFile(CatalogueEntry):
    """Content of the YAML file."""

    clip: ClipCheckpoint | None = None
    dover: Checkpoint | None = None
    fast_vqa: Checkpoint | None = None
    lpips: Checkpoint | None = None


@dataclass(frozen=True, kw_only=True)
class LoadedJudge:
    """A judge, or the reason why it is missing.

    Parameters
    ----------
    network : TorchScript module; None where it is missing
    text_features : float [N, D], a row a kind of weather in the order of the prompts; None but for CLIP
    note : where the weights come from, or why there are none
    """

    network: Any
    text_features: NDArray[np.floating] | None
    note: str


def load_judges(path: str | Path | None) -> dict[str, LoadedJudge]:
    """Return every judge by its name; a missing judge has the reason.

    Parameters
    ----------
    path : the YAML file; paths in it are relative to its folder. None has no judge

    Raises
    ------
    InputError
        The YAML is wrong, or a file that is there is no TorchScript module, or one that reaches files, or holds no such
        features.
    """
    if path is None:
        return {name: _make_missing("not run: checkpoint missing") for name in JUDGES}
    file = read_entry(JudgeFile, Path(path), "list of learned judges")
    judges: dict[str, LoadedJudge] = {}
    problems: list[str] = []
    for name in JUDGES:
        entry: Checkpoint | None = getattr(file, name)
        try:
            judges[name] = (
                _make_missing("not run: checkpoint missing")
                if entry is None
                else _load_judge(Path(path), entry)
            )
        except InputError as error:
            problems += [f"{path}: {name}: {problem}" for problem in error.problems]
    if problems:
        raise InputError(problems)
    return judges


def _load_judge(path: Path, entry: Checkpoint) -> LoadedJudge:
    if find_spec("torch") is None:
        raise InputError("a learned judge needs the package torch: install it")
    needed = [entry.checkpoint, *([entry.text_features] if isinstance(entry, ClipCheckpoint) else [])]
    for name in needed:
        if not os.path.isfile(path.parent / name):
            return _make_missing(f"not run: checkpoint missing: {name}")
    network = load_network(path.parent / entry.checkpoint, shorten(entry.checkpoint))
    features = None
    if isinstance(entry, ClipCheckpoint):
        try:
            features = np.load(path.parent / entry.text_features, allow_pickle=False)
        except (ValueError, OSError, EOFError, zipfile.BadZipFile) as error:
            raise InputError(
                f"{shorten(entry.text_features)} must be a NumPy array; {shorten(error)}"
            ) from None
        if not isinstance(features, np.ndarray) or not np.issubdtype(features.dtype, np.floating):
            raise InputError(f"{shorten(entry.text_features)} must be one array of floats; it is not")
        kinds = list(load_prompts())
        if features.ndim != 2 or len(features) != len(kinds) or not np.isfinite(features).all():
            raise InputError(
                f"{shorten(entry.text_features)} must hold finite features [{len(kinds)}, D] of"
                f" {', '.join(kinds[:-1])} and {kinds[-1]}; it is {features.shape}"
            )
    return LoadedJudge(network=network, text_features=features, note=entry.source)


def _make_missing(note: str) -> LoadedJudge:
    return LoadedJudge(network=None, text_features=None, note=note)


def load_network(path: Path, name: str) -> Any:
    """Return the network of a TorchScript file that reaches no file, library or process.

    Parameters
    ----------
    path : of the file
    name : what messages call it

    Raises
    ------
    InputError
        If it is none, or its code calls what it must not.
    """
    import torch

    try:
        reader = torch._C.PyTorchFileReader(str(path))  # the one that loads it, so that both see the same
        programs = {record: reader.get_record(record) for record in _list_programs(reader.get_all_records())}
        calls = [call for record, content in programs.items() for call in _find_calls(record, content)]
        network = None if calls else torch.jit.load(path, map_location="cpu").eval()
    except (RuntimeError, ValueError, OSError, EOFError) as error:
        raise InputError(f"{name} must be a TorchScript module; {shorten(error)}") from None
    if calls:
        found = ", ".join(dict.fromkeys(calls))
        raise InputError(
            f"{name} must be a network that only computes; its program has {shorten(found)}, with which it can reach"
            " files or other programs: do not use it"
        )
    return network


def _list_programs(records: list[str]) -> list[str]:
    """The records of a file that hold code, and those that name classes; one of an old form is all of it."""
    if "model.json" in records:
        raise ValueError("it has the form of PyTorch before 1.4: save it again")
    return [name for name in records if not name.endswith(DEBUG) and not re.fullmatch(r"\w+/\d+", name)]


def _find_calls(record: str, content: bytes) -> Iterator[str]:
    yield from (found.decode().replace("\n", ".") for found in CLASSES.findall(content))
    if not record.lower().startswith("code/"):
        return
    try:
        tree = ast.parse(content)
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        yield f"code that cannot be looked through ({shorten(record)})"
        return
    for node in ast.walk(tree):
        words = (getattr(node, name, None) for name in ("id", "attr", "value"))  # a name, x.name or "name"
        yield from (word for word in words if isinstance(word, str) and word in REACHES_FILES)
        if (
            isinstance(node, ast.Attribute)
            and ast.unparse(node.value) == "ops"
            and node.attr not in NAMESPACES
        ):
            yield f"ops.{shorten(node.attr)}"
