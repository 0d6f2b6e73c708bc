"""Learned judges that a user has: a YAML file of local TorchScript checkpoints. Nothing is ever downloaded.

::

    clip: {checkpoint: ViT-B-32.pt, text_features: prompts.npy, source: openai/CLIP}
    dover: {checkpoint: dover.pt, source: VQAssessment/DOVER}

`text_features` is float [N, D]: the mean features of the prompts in clip_prompts.yaml (paper, Appendix D: dry, rain and
snow), a row a kind of weather in the file's order.
"""

import os
import zipfile
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from catalogs.clip_prompts import load_prompts
from catalogs.quantities import CatalogueEntry, Text, read_entry
from catalogs.sentences import shorten
from catalogs.torchscript import load_network
from tasks.errors import InputError

JUDGES = ("clip", "dover", "fast_vqa", "lpips")


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
