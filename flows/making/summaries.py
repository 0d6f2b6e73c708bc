"""The tables that follow from the records of the clips: one row a clip, and one row a pair of clips.

Sealing writes them, repair makes them again, and an audit compares them: all three take them from here.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import chain, islice
from typing import Any, TypeVar

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from catalogs.variants import Variant
from flows.making.plan import ClipPlan, Plan
from flows.store.telemetry import labelled_table
from manifests.manifest import is_quarantined
from manifests.records import Receipt
from manifests.siblings import FIGURES, iterate_pairs
from tasks.conventions import PAIR_CHANNELS

CLIPS, PAIRS = SUMMARIES = ("telemetry/clips.parquet", "telemetry/pairs.parquet")
BATCH = 200
"""Rows and files that are held at once where there is one a clip or a pair [1]."""

Item = TypeVar("Item")


def summarise_clips(plan: Plan, receipts: Iterable[Receipt]) -> Iterator[tuple[str, Iterator[pa.Table]]]:
    """Yield the path of each summary in the dataset, and the tables that are its rows together.

    Parameters
    ----------
    plan : of the dataset
    receipts : of its clips, in its order, each read once
    """
    clips = clips_table(receipts, plan.settings.variant)
    yield CLIPS, iter([clips])
    outcomes = Outcomes(plan.clips, clips)
    del clips
    yield PAIRS, pairs_tables(outcomes)


def clips_table(receipts: Iterable[Receipt], variant: Variant) -> pa.Table:
    """One row a clip: controls, surface, outcome and verdict; where a coupling is cut, also which.

    Parameters
    ----------
    receipts : of the clips
    variant : of the dataset
    """
    columns: dict[str, list[Any]] = {}
    for batch in batched(receipts):
        rows = [_clip_row(receipt) for receipt in batch]
        for name in rows[0]:
            columns.setdefault(name, []).append(_pack([row[name] for row in rows]))
    # each column's parts go when it is whole
    cut = {} if variant == "full" else {"variant": variant}
    return labelled_table({name: _join(columns.pop(name)) for name in list(columns)}, cut)


def _clip_row(r: Receipt) -> dict[str, Any]:
    return (
        {name: r[name] for name in ("clip_id", "index", "label", "seed", "split", "calibration")}
        | r["scenario"]
        | r["figures"]
        | {"quarantined": is_quarantined(r)}
        | {f"check_{key}": value for key, value in r["verdict"].items() if key != "reasons"}
    )


def _pack(values: list[Any]) -> Any:
    """Values of some rows: floats, with NaN for None, where one is, an array where all are text, else as they are."""
    if any(isinstance(value, float) for value in values):
        return _as_floats(values)
    return pa.array(values) if all(isinstance(value, str) for value in values) else values


def _join(parts: list[Any]) -> Any:
    """The packed parts of one column: floats where any part is, or where nothing is represented."""
    if any(isinstance(part, np.ndarray) for part in parts) or all(v is None for part in parts for v in part):
        return np.concatenate([part if isinstance(part, np.ndarray) else _as_floats(part) for part in parts])
    if all(isinstance(part, pa.Array) for part in parts):
        return pa.concat_arrays(parts)
    return [value for part in parts for value in (part.to_pylist() if isinstance(part, pa.Array) else part)]


def _as_floats(values: list[Any]) -> NDArray[np.float64]:
    return np.array([np.nan if value is None else value for value in values], float)


class Outcomes(Sequence[Mapping[str, Any]]):
    """Records of clips as `manifests.siblings` reads them, each made when it is read.

    Parameters
    ----------
    clips : of the plan
    table : of the same clips
    """

    def __init__(self, clips: Sequence[ClipPlan], table: pa.Table):
        self.clips = clips
        self.figures = {name: table[name].to_numpy() for name in FIGURES}

    def __len__(self) -> int:
        return len(self.clips)

    def __getitem__(self, place: Any) -> Any:
        clip = self.clips[place]
        figures = {name: values[place] for name, values in self.figures.items()}
        return {
            "clip_id": clip.clip_id,
            "label": clip.label,
            "scenario": clip.scenario.as_row(),
            "figures": figures,
        }


def pairs_tables(receipts: Sequence[Mapping[str, Any]]) -> Iterator[pa.Table]:
    """Yield tables of some rows each, the first without any: what one control changes between two clips."""
    kinds = {channel.name: float if channel.name.endswith("_change") else str for channel in PAIR_CHANNELS}
    for rows in chain([[]], batched(iterate_pairs(receipts))):
        yield labelled_table(
            {name: np.array([row[name] for row in rows], kind) for name, kind in kinds.items()}
        )


def batched(items: Iterable[Item], size: int | None = None) -> Iterator[list[Item]]:
    """Yield the items in lists of at most ``size`` [1], by default `BATCH`."""
    left = iter(items)
    while batch := list(islice(left, size or BATCH)):
        yield batch
