"""Making labelled campaigns, on as many processes as asked for."""

import json
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from studies.double_track.campaign import make_campaign
from studies.double_track.effects import Truth, list_truths

LABELS = "labels.json"


def make_campaigns(
    folder: Path, asked: Sequence[str], sizes: int, nulls: int, design: str, seed: int, workers: int
) -> dict[str, Any]:
    """Write campaign folders and ``labels.json``; campaigns that labels name already are kept.

    Parameters
    ----------
    folder : to write into
    asked : names of effects.yaml, or of its groups, or null
    sizes, nulls : campaigns of each effect, and of the plain car
    design : of designs.yaml
    seed : of all draws
    workers : processes
    """
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / LABELS
    labels: dict[str, Any] = json.loads(path.read_text(encoding="utf-8")) if path.is_file() else {}
    truths = [truth for truth in list_truths(asked, sizes, nulls, seed) if truth.name not in labels]
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        jobs = {truth.name: pool.submit(_make_one, folder, truth, design, seed) for truth in truths}
        for name, job in jobs.items():
            labels[name] = job.result()
            path.write_text(json.dumps(labels, indent=1), encoding="utf-8")
    return labels


def _make_one(folder: Path, truth: Truth, design: str, seed: int) -> dict[str, Any]:
    return make_campaign(folder / truth.name, truth, design, seed)
