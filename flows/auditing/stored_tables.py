"""The Parquet tables of a dataset as every reader meets them: their bytes are what our writer makes of the values."""

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from catalogs.sentences import cap_problems, shorten
from flows.auditing.footers import find_footer_lies, find_label_lies, find_writer_differences
from flows.making.clip import collect_motion_figures
from flows.making.gathering import table_parts
from flows.making.plan import TICK_RATE_HZ, Plan, frame_ticks
from flows.making.summaries import summarise_clips
from flows.store.layout import Layout
from flows.store.links import require_file
from flows.store.telemetry import content_hash, encode_tables, labelled_table, table_columns
from manifests.compare import find_row_difference
from manifests.explain import format_value
from manifests.records import Manifest, Receipt
from tasks.conventions import FRAME_CHANNELS, TICK_CHANNELS
from tasks.errors import InputError

Columns = Mapping[str, NDArray[Any]]
Difference = tuple[str, list[str]]
"""Path of a file with other bytes than our writer makes, and what it says otherwise than the records."""
WORDS = ("clip_id", "label", "weather")
"""Columns by which every row names its clip."""
_TICKS = [channel.name for channel in TICK_CHANNELS]
_COLUMNS = {"frames": {*_TICKS, *(channel.name for channel in FRAME_CHANNELS)}, "ticks": {*_TICKS}}
"""Columns with a value of its own in every row; frames come first, because ticks are held against them."""
_SHOWN = 4
"""Sentences about one file."""


def compare_tables(
    layout: Layout, manifest: Manifest, plan: Plan, damaged: Collection[str], is_same_writer: bool
) -> Iterator[Difference]:
    """Yield each table whose bytes are not those that our writer makes of its values, or whose values contradict.

    The number of rows, the names and the figures come from the records, all other values from the file itself.

    Parameters
    ----------
    layout, manifest, plan : of a sealed dataset
    damaged : paths that are not read
    is_same_writer : whether code and libraries are those that wrote the dataset, so that every difference counts
    """
    clips = {clip["clip_id"]: clip for clip in manifest["clips"]}
    for parts in zip(*(table_parts(plan, table).items() for table in _COLUMNS), strict=True):
        shown: dict[str, Columns] = {}
        for table, (path, ids) in zip(_COLUMNS, parts, strict=True):
            part = _Part(table, plan, [clips[clip_id] for clip_id in ids], shown, is_same_writer)
            if path not in damaged:
                yield from _compare_file(layout, path, part.remake, part.lies, part.names, is_same_writer)
    for path, tables in summarise_clips(plan, manifest["clips"]):
        if path not in damaged:
            held = list(tables)
            yield from _compare_file(layout, path, partial(_take_held, held), [], (), is_same_writer)


def _take_held(held: list[pa.Table], _: pq.ParquetFile) -> list[pa.Table]:
    return held


def _compare_file(
    layout: Layout,
    path: str,
    remake: Callable[[pq.ParquetFile], Iterable[pa.Table]],
    lies: list[str],
    names: Collection[str],
    is_same_writer: bool,
) -> Iterator[Difference]:
    """Compare a table with what ``remake`` yields of it: ``names`` as recorded, and in ``lies`` what contradicts it."""
    try:
        file_path = require_file(layout.root / path)
        with pq.ParquetFile(file_path, pre_buffer=False, page_checksum_verification=True) as file:
            present = [name for name in file.schema_arrow.names if name in names]
            if _holds_bytes(file_path, encode_tables(remake(file))) and not lies:
                return
            lies.clear()
            schemas, words = zip(
                *((table.schema, table.select(present)) for table in remake(file)), strict=True
            )
            found = [*find_label_lies(file, schemas[0], is_same_writer), *lies, *find_footer_lies(file)]
            found += _find_word_lies(file.read(present), pa.concat_tables(words).unify_dictionaries())
            if not found and is_same_writer:
                found = find_writer_differences(file, b"".join(encode_tables(remake(file))))
    except InputError as error:
        found = list(error.problems)
    except (pa.ArrowException, OSError, ValueError, KeyError) as error:
        found = [f"must be a table as muSync writes it; {shorten(error)}"]
    yield path, [f"{path}: {lie}" for lie in cap_problems(list(dict.fromkeys(found)), _SHOWN)]


def _find_word_lies(found: pa.Table, wanted: pa.Table) -> list[str]:
    row = find_row_difference(table_columns(found), table_columns(wanted), wanted.column_names)
    return [] if row is None else [
        f"{row['channel']} in row {row['tick']} must be {format_value(row['remade'])}, as manifest.json says; it is"
        f" {format_value(row['recorded'])}"
    ]  # fmt: skip


def _holds_bytes(file_path: Path, pieces: Iterable[bytes]) -> bool:
    with file_path.open("rb") as stream:
        return all(stream.read(len(piece)) == piece for piece in pieces) and not stream.read(1)


class _Part:
    """One table of up to a hundred clips, made again from its values and the records of the clips.

    Parameters
    ----------
    table : frames or ticks
    plan : of the dataset
    clips : records, in the order of their rows
    shown : rows of frames by clip, noted when frames are read and held against the ticks
    is_same_writer : as of `compare_tables`
    """

    def __init__(
        self,
        table: str,
        plan: Plan,
        clips: Sequence[Receipt],
        shown: dict[str, Columns],
        is_same_writer: bool,
    ):
        self.table, self.plan, self.clips, self.shown = table, plan, clips, shown
        self.is_same_writer = is_same_writer
        self.names = {*WORDS, *(() if table == "ticks" else clips[0]["figures"])}
        self.lies: list[str] = []

    def remake(self, file: pq.ParquetFile) -> Iterator[pa.Table]:
        """Yield the table again, a row group of the file at a time."""
        rows = self.plan.ticks_per_clip if self.table == "ticks" else self.plan.settings.frames
        if file.metadata.num_rows != rows * len(self.clips):
            raise InputError(
                f"must have {rows} rows of each of its {len(self.clips)} clips; it has {file.metadata.num_rows} in all"
            )
        names = file.schema_arrow.names
        figures = [name for name in names if name in self.names and name not in WORDS]
        stored = [name for name in names if name not in self.names]
        strange = [name for name in stored if name not in _COLUMNS[self.table]]
        lost = sorted(_COLUMNS[self.table] - {*stored}) if self.is_same_writer else []
        self.lies += [f"must have no column {name}, which muSync does not write there" for name in strange]
        self.lies += [f"must have the column {name}, which muSync writes there" for name in lost]
        constants = {
            name: np.array([_as_float(clip["figures"][name]) for clip in self.clips]) for name in figures
        }
        words = {name: _number_words([_name_clip(clip)[name] for clip in self.clips]) for name in WORDS}
        done, clips, begun = 0, iter(self.clips), _BegunClip(rows)
        for group in range(file.num_row_groups):
            values = file.read_row_group(group, columns=stored)
            columns: dict[str, Any] = table_columns(values)
            for whole in begun.complete(columns, len(values)):
                self.lies += self._find_lies(next(clips), whole)
            owners = np.arange(done, done + len(values)) // rows
            done += len(values)
            # as gathering reads it, whose name for the elements is another than that of a new column
            columns |= {name: values[name].combine_chunks() for name in stored if columns[name].ndim > 1}
            columns |= {name: column[owners] for name, column in constants.items()}
            for name, (known, codes) in words.items():
                columns[name] = pa.DictionaryArray.from_arrays(pa.array(codes[owners]), pa.array(known))
            yield labelled_table({name: columns[name] for name in names})

    def _find_lies(self, clip: Receipt, columns: Columns) -> list[str]:
        """Where the rows of a clip contradict its record, their own count, or the rows of the other table."""
        settings, of_clip = self.plan.settings, f"of clip {clip['label']}"
        lies: list[str] = []
        ticks = frame_ticks(settings.frames, settings.frame_rate_hz)
        if self.table == "frames":
            self.shown[clip["clip_id"]] = columns
            names, counted = sorted(columns), {"frame": np.arange(settings.frames), "tick": ticks}
        else:
            names = [name for name in _TICKS if name in columns]
            counted = {"t_ns": np.arange(self.plan.ticks_per_clip) * (10**9 // TICK_RATE_HZ)}
            shown = self.shown.get(clip["clip_id"], {})
            lies = [
                f"{name} {of_clip} must be, at the ticks that frames show, that of the frames; it is another"
                for name in names
                if name in shown and columns[name][ticks].tobytes() != shown[name].tobytes()
            ]
            lies += _compare_figures(clip, collect_motion_figures(columns))
        lies += [
            f"{name} {of_clip} must count the rows from 0 on; it does not"
            for name, values in counted.items()
            if not np.array_equal(columns[name], values)
        ]
        if content_hash(self.table, columns) != clip["content"][self.table]:
            lies.append(
                f"the rows {of_clip} must have the hash that manifest.json records; they have another"
            )
        return lies


class _BegunClip:
    """Rows that come in pieces of any length, put together to those of one clip after the other.

    Parameters
    ----------
    rows : of a clip [1]
    """

    def __init__(self, rows: int):
        self.rows = rows
        self.held: list[Columns] = []
        self.count = 0

    def complete(self, columns: Columns, length: int) -> Iterator[Columns]:
        """Yield the columns of each clip that ends in this piece; whole ones are views of it."""
        start = 0
        while start < length:
            stop = min(length, start + self.rows - self.count)
            self.held.append({name: values[start:stop] for name, values in columns.items()})
            self.count, start = self.count + stop - start, stop
            if self.count == self.rows:
                pieces, self.held, self.count = self.held, [], 0
                yield (
                    pieces[0]
                    if len(pieces) == 1
                    else {name: np.concatenate([piece[name] for piece in pieces]) for name in columns}
                )


def _compare_figures(clip: Receipt, found: Mapping[str, float]) -> list[str]:
    return [
        f"{name} of clip {clip['label']} must be {format_value(clip['figures'][name])}, as manifest.json says; by its"
        f" ticks it is {format_value(value)}"
        for name, value in found.items()
        if name in clip["figures"]
        and not np.array_equal(_as_float(clip["figures"][name]), value, equal_nan=True)
    ]


def _number_words(words: Sequence[str]) -> tuple[list[str], NDArray[np.int32]]:
    """Return the distinct words in the order of their first rows, and the number of each row's word."""
    known = {word: number for number, word in enumerate(dict.fromkeys(words))}
    return list(known), np.array([known[word] for word in words], np.int32)


def _name_clip(clip: Receipt) -> dict[str, str]:
    return {"clip_id": clip["clip_id"], "label": clip["label"], "weather": clip["scenario"]["weather"]}


def _as_float(value: float | None) -> float:
    return float("nan") if value is None else value
