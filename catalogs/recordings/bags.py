"""ROS recordings, read by rosbags: ROS 1 bags, ROS 2 bags (folder, .db3) and MCAP files of ROS 2 messages.

A signal is ``/topic.field.subfield[index]``; its time is that of the message's header, where it has one, else that of
the log, counted from the recording's first message [s].
"""

import re
import sqlite3
from array import array
from collections.abc import Collection, Iterator
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass
from math import inf, isfinite, isnan
from pathlib import Path
from typing import Any

import numpy as np

from catalogs.campaign_files import MOST_SAMPLES
from catalogs.channel_maps import ChannelMap
from catalogs.recordings.forms import (
    MOST_COLUMNS,
    MOST_NAMES,
    Form,
    SignalSummary,
    describe_missing,
    import_package,
    number_names,
    signal_names,
)
from catalogs.sentences import shorten
from tasks.campaign.signals import Signal
from tasks.errors import InputError

STORAGE_SUFFIXES = (".db3", ".mcap")
_STEP = re.compile(r"\.([A-Za-z]\w*)|\[(\d{1,4})\]", re.ASCII)
_PROGRAM = re.compile(r"\b(AS|VIRTUAL)\b", re.IGNORECASE)
"""In a table's definition: a view, a computed column, or a table of a module."""
Steps = tuple[str | int, ...]
"""Fields and indices that lead from a message to a number."""


@dataclass(frozen=True, kw_only=True)
class _Sample:
    """A decoded message, its topic, its time since the recording's start [s], and the types that it is made of."""

    topic: str
    time: float
    message: Any
    store: Any


def is_bag_folder(path: Path) -> bool:
    """Return whether a path is the folder of a ROS 2 bag, which is read as one recording."""
    return path.is_dir() and (path / "metadata.yaml").is_file() and bool(list_storage_files(path))


def list_storage_files(folder: Path) -> tuple[Path, ...]:
    """Return the files of a bag folder that hold messages; what else its metadata names is not looked for."""
    return tuple(sorted(path for path in folder.iterdir() if path.suffix.lower() in STORAGE_SUFFIXES))


def read_bag(path: Path, channel_map: ChannelMap) -> dict[str, Signal]:
    """Return the signals of a bag that a map names.

    Raises
    ------
    InputError
        With one sentence per problem: a damaged bag, or a signal that no message holds.
    """
    names = signal_names(channel_map)
    columns = {name: (array("d"), array("d")) for name in names}
    with _open_readers(path) as readers:
        topics = {name for reader in readers for pair in _number_writers(reader).values() for name in pair}
        wanted = _group_by_topic(names, topics)
        for sample in _decode_messages(path, readers, wanted):
            for name, steps in wanted[sample.topic]:
                if (value := _follow_steps(sample.message, steps)) is not None:
                    times, values = columns[name]
                    times.append(sample.time)
                    values.append(value)
                    if len(values) > MOST_SAMPLES:
                        raise InputError(
                            f"{path.name}: signal {name} must have at most {MOST_SAMPLES} samples"
                        )
        found = [name for name, (_, values) in columns.items() if values]
        if len(found) < len(names):
            plain = {connection.topic for reader in readers for connection in reader.connections}
            raise InputError(describe_missing(path, names, found, _list_first_names(path, readers, plain)))
    return {
        name: Signal(time=np.array(times), values=np.array(values))
        for name, (times, values) in columns.items()
    }


def summarise_bag(path: Path, _: ChannelMap | None) -> list[SignalSummary]:
    """Return a row for each number that the messages hold; lists of more than `MOST_COLUMNS` elements are left out.

    Raises
    ------
    InputError
        If the bag cannot be read.
    """
    tallies: dict[str, _Tally] = {}
    with _open_readers(path) as readers:
        for sample in _decode_messages(path, readers, None):
            for name, value in _list_numbers(sample):
                tallies.setdefault(name, _Tally(sample.time)).add(sample.time, value)
            if len(tallies) > MOST_NAMES:
                raise InputError(f"{path.name}: must have at most {MOST_NAMES} signals; it has more")
    return [tally.summarise(name) for name, tally in sorted(tallies.items())]


class _Tally:
    """Count, times and range of a signal whose values are not kept."""

    __slots__ = ("first", "high", "last", "low", "samples")

    def __init__(self, first: float):
        self.first, self.last, self.samples = first, first, 0
        self.low, self.high = inf, -inf

    def add(self, time: float, value: float) -> None:
        """Count a value at a time [s]; one that is not a number is no sample."""
        if isnan(value):
            return
        self.samples, self.last = self.samples + 1, time
        if isfinite(value):
            self.low, self.high = min(self.low, value), max(self.high, value)

    def summarise(self, name: str) -> SignalSummary:
        """Return the row of the signal."""
        span, ranged = self.last - self.first, self.low <= self.high
        return SignalSummary(
            signal=name, unit="", samples=self.samples, rate_hz=(self.samples - 1) / span if span > 0.0 else None,
            start_s=self.first, end_s=self.last, lowest=self.low if ranged else None,
            highest=self.high if ranged else None,
        )  # fmt: skip


@contextmanager
def _open_readers(path: Path) -> Iterator[list[Any]]:
    """Open a recording's files; whatever is raised while they are read becomes a sentence."""
    import_package("rosbags", "ROS bags and MCAP", "ros")
    from rosbags import rosbag1, rosbag2

    from catalogs.recordings.bag_types import bound_unpacking

    bound_unpacking()
    files = list_storage_files(path) if path.is_dir() else (path,)
    try:
        for file in files:
            _check_file(file)
        with ExitStack() as stack:
            make = [rosbag1.Reader(f) if f.suffix.lower() == ".bag" else rosbag2.Reader(f) for f in files]
            readers: list[Any] = [stack.enter_context(reader) for reader in make]
            yield sorted(readers, key=lambda reader: reader.start_time)
    except InputError as error:
        start = f"{path.name}: "
        raise InputError([p if p.startswith(start) else f"{start}{p}" for p in error.problems]) from None
    except Exception as error:  # whatever a damaged bag makes the library raise
        raise InputError(f"{path}: must be a readable bag of ROS messages; {shorten(error)}") from None


def _check_file(file: Path) -> None:
    """Refuse what is no regular file, and a database with more than tables in it: a view is a program."""
    if not file.is_file():
        raise InputError("must be a regular file; it is a folder, pipe or device")
    if file.suffix.lower() != ".db3":
        return
    with closing(sqlite3.connect(f"{file.resolve().as_uri()}?mode=ro&immutable=1", uri=True)) as database:
        entries = database.execute("SELECT type, sql FROM sqlite_master").fetchall()
    for kind, text in entries:
        if kind not in ("table", "index") or _PROGRAM.search(text or ""):
            raise InputError(
                "must be a database of plain tables; it holds a view, a trigger or a computed column"
            )


def _decode_messages(path: Path, readers: list[Any], topics: Collection[str] | None) -> Iterator[_Sample]:
    """Yield the messages of some topics in the order of the log; of all whose types are known where topics is None."""
    from catalogs.recordings.bag_types import make_type_store

    start = min(reader.start_time for reader in readers)
    stores: dict[Any, Any] = {}
    stamped: dict[str, bool] = {}
    for reader in readers:
        kept = []
        writers, turns = _number_writers(reader), dict[str, list[int]]()
        for connection in reader.connections:
            if topics is not None and not {*writers[connection.id]} & {*topics}:
                continue
            key = connection.msgtype, connection.msgdef
            if key not in stores:
                stores[key] = make_type_store(connection.msgdef, connection.msgtype)
            if connection.msgtype in stores[key].fielddefs:
                kept.append(connection)
            elif topics is not None:
                raise InputError(
                    f"{path.name}: topic {connection.topic} has messages of {connection.msgtype}, which neither the bag"
                    " nor ROS 2 defines: convert the bag to MCAP where the type is known"
                )
        for connection, log_time, content in reader.messages(connections=kept) if kept else ():
            topic, numbered = writers[connection.id]
            if topics is not None and topic not in topics:
                topic = numbered
            order = turns.setdefault(topic, [])
            if topics is not None and connection.id in order[:-1]:
                raise InputError(
                    f"{path.name}: topic {topic} is written by several publishers in turns: name one of them in the"
                    f" source, as {numbered}"
                )
            order += [] if order[-1:] == [connection.id] else [connection.id]
            store = stores[connection.msgtype, connection.msgdef]
            decode = store.deserialize_ros1 if path.suffix.lower() == ".bag" else store.deserialize_cdr
            message = decode(content, connection.msgtype)
            stamp = _read_stamp(message)
            # a driver that does not fill in the header leaves a stamp of 0
            time = stamp if stamped.setdefault(topic, bool(stamp)) else log_time
            yield _Sample(topic=topic, time=(time - start) * 1e-9, message=message, store=store)


def _number_writers(reader: Any) -> dict[int, tuple[str, str]]:
    """Return the topic of each connection by its id, and its name where several publishers have it: /topic#2."""
    connections = list(reader.connections)
    names = number_names([connection.topic for connection in connections])
    return {
        connection.id: (connection.topic, name) for connection, name in zip(connections, names, strict=True)
    }


def _read_stamp(message: Any) -> int:
    """Return the time of a message's header [ns]; 0 where it has none."""
    stamp = getattr(getattr(message, "header", None), "stamp", None)
    seconds, rest = getattr(stamp, "sec", 0), getattr(stamp, "nanosec", 0)
    return int(seconds) * 10**9 + int(rest)


def _group_by_topic(names: tuple[str, ...], topics: Collection[str]) -> dict[str, list[tuple[str, Steps]]]:
    """Return the signals of each topic, with the way to each in a message; names that cannot be one are left out."""
    groups: dict[str, list[tuple[str, Steps]]] = {}
    for name in names:
        topic = max((topic for topic in topics if name.startswith(f"{topic}.")), key=len, default="")
        rest = name[len(topic) :]
        found = list(_STEP.finditer(rest))
        if topic and "".join(match.group() for match in found) == rest:
            steps = tuple(match.group(1) or int(match.group(2)) for match in found)
            groups.setdefault(topic, []).append((name, steps))
    return groups


def _follow_steps(message: Any, steps: Steps) -> float | None:
    """Return the number that the steps lead to; None where there is none."""
    value = message
    for step in steps:
        if isinstance(step, int):
            if not isinstance(value, list | np.ndarray) or step >= len(value):
                return None
            value = value[step]
        elif step in getattr(value, "__dataclass_fields__", ()):
            value = getattr(value, step)
        else:
            return None
    return _convert_number(value)


def _convert_number(value: Any) -> float | None:
    return float(value) if isinstance(value, int | float | np.number | np.bool_) else None


def _list_numbers(sample: _Sample) -> Iterator[tuple[str, float]]:
    """Yield the numbers of a message by name; its header is its time and no signal."""

    def visit(name: str, value: Any) -> Iterator[tuple[str, float]]:
        if isinstance(value, list | np.ndarray):
            if len(value) <= MOST_COLUMNS:
                for k, element in enumerate(value):
                    yield from visit(f"{name}[{k}]", element)
        elif hasattr(value, "__msgtype__"):
            for field, _ in sample.store.get_msgdef(value.__msgtype__).fields:
                if value is not sample.message or field != "header":
                    yield from visit(f"{name}.{field}", getattr(value, field))
        elif (number := _convert_number(value)) is not None:
            yield name, number

    return visit(sample.topic, sample.message)


def _list_first_names(path: Path, readers: list[Any], topics: Collection[str]) -> list[str]:
    """Return the signals of each topic's first message."""
    samples = (next(_decode_messages(path, readers, {t}), None) for t in sorted(topics))
    return [name for sample in samples if sample is not None for name, _ in _list_numbers(sample)]


BAG = Form(read=read_bag, summarise=summarise_bag)
