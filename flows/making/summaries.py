"""The tables that follow from the records of the clips: one row a clip, and one row a pair of clips.

Sealing writes them, repair makes them again, and an audit compares them: all three take them from here.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import chain, islice
from typing import Any, TypeVar

import numpy as np
import pyarrow as pa

from catalogs.scenario import OPTIONAL_FIELDS
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
    clips = clips_table(receipts, plan)
    yield CLIPS, iter([clips])
    outcomes = Outcomes(plan.clips, clips)
    del clips
    yield PAIRS, pairs_tables(outcomes)


def clips_table(receipts: Iterable[Receipt], plan: Plan) -> pa.Table:
    """One row a clip: controls, surface, outcome and verdict; where a coupling is cut, also which.

    Parameters
    ----------
    receipts : of the clips
    plan : of the dataset
    """
    named = {name for clip in plan.clips for name in clip.scenario.as_row()}
    usual = {name: value for name, value in OPTIONAL_FIELDS.items() if name in named}
    columns: dict[str, list[pa.Array]] = {}
    for batch in batched(receipts):
        rows = [_clip_row(receipt, usual) for receipt in batch]
        for name in columns or rows[0]:
            columns.setdefault(name, []).append(_pack([row.get(name) for row in rows]))
    # each column's parts go when it is whole
    variant = plan.settings.variant
    cut = {} if variant == "full" else {"variant": variant}
    return labelled_table({name: _join(columns.pop(name)) for name in list(columns)}, cut)


def _clip_row(r: Receipt, usual: Mapping[str, Any]) -> dict[str, Any]:
    """The row of a clip; ``usual`` has what its scenario does not name where another clip's does."""
    named = {name: r["scenario"].get(name, value) for name, value in usual.items()}
    return (
        {name: r[name] for name in ("clip_id", "index", "label", "seed", "split", "calibration")}
        | {name: value for name, value in r["scenario"].items() if name not in {"objects", *named}}
        | named
        | r["figures"]
        | {"quarantined": is_quarantined(r)}
        | {f"check_{key}": value for key, value in r["verdict"].items() if key != "reasons"}
    )


def _pack(values: list[Any]) -> pa.Array:
    """Values of some rows, NULL for None; floats where one of them is a float."""
    return pa.array(values, pa.float64() if any(isinstance(value, float) for value in values) else None)


def _join(parts: list[pa.Array]) -> pa.Array:
    """The packed parts of one column: floats where any part is, or where nothing is represented."""
    kinds = [part.type for part in parts if not pa.types.is_null(part.type)]
    kind = pa.float64() if not kinds or pa.float64() in kinds else kinds[0]
    return pa.concat_arrays([part.cast(kind, safe=False) for part in parts])


class Outcomes(Sequence[Mapping[str, Any]]):
    """Records of clips as `manifests.siblings` reads them, each made when it is read.

    Parameters
    ----------
    clips : of the plan
    table : of the same clips
    """

    def __init__(self, clips: Sequence[ClipPlan], table: pa.Table):
        self.clips = clips
        self.figures = {name: table[name].to_numpy() for name in FIGURES if name in table.column_names}

    def __len__(self) -> int:
        return len(self.clips)

    def __getitem__(self, index: Any) -> Any:
        clip = self.clips[index]
        figures = {name: values[index] for name, values in self.figures.items()}
        return {
            "clip_id": clip.clip_id,
            "label": clip.label,
            "scenario": clip.scenario.as_record(),
            "figures": figures,
        }


def pairs_tables(receipts: Sequence[Mapping[str, Any]]) -> Iterator[pa.Table]:
    """Yield tables of some rows each, the first without any: what one control changes between two clips."""
    kinds = {channel.name: float if channel.name.endswith("_change") else str for channel in PAIR_CHANNELS}
    for rows in chain([[]], batched(iterate_pairs(receipts))):
        yield labelled_table(
            {name: np.array([row[name] for row in rows], kind) for name, kind in kinds.items()}
        )


def batched(items: Iterable[Item]) -> Iterator[list[Item]]:
    """Yield the items in lists of at most `BATCH` [1]."""
    left = iter(items)
    while batch := list(islice(left, BATCH)):
        yield batch
