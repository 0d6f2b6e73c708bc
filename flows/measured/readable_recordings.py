"""Recordings and runs that can be used, and the few among many that cannot, with why."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from catalogs.channel_maps import ChannelMap
from catalogs.entries import load
from catalogs.recordings import read_signals, recording_files
from catalogs.sentences import shorten
from flows.measured.run_plan import PlannedRun
from tasks.campaign.assembly import Assembled
from tasks.campaign.channels import UNITS
from tasks.campaign.checks import apply_checks, list_names
from tasks.campaign.measured import Recordings
from tasks.campaign.signals import Signal
from tasks.campaign.stated_units import choose_unit, find_unit_problems
from tasks.errors import InputError

Signals = dict[Path, dict[str, Signal]]
MOST_FAULTY = 1 / 3
"""Share of recordings, or of runs, that may be left out for their faults; more are a fault of the map [1]."""
SHARED = 3
"""Places from which a fault is reported once for all of them [1]."""
NUMBER = re.compile(r"(?<![\w.^-])-?\d+(?:\.\d+)?(?:e[+-]?\d+)?(?!\w)")
"""A figure of a sentence; no digit of a name (run-01, w_2) or of a unit (m/s^2)."""


def read_recordings(
    files: tuple[Path, ...], channel_map: ChannelMap
) -> tuple[ChannelMap, Signals, list[str], list[str]]:
    """Return the map with every unit, the signals of each recording, and why some are left out, with their names.

    Parameters
    ----------
    files : recordings
    channel_map : names their signals

    Raises
    ------
    InputError
        Listing the problems of all, where more are faulty than may be left out.
    """
    recordings: Signals = {}
    problems: list[RecordingProblem] = []
    for file in files:
        try:
            recordings[file] = read_signals(file, channel_map)
        except InputError as error:
            problems += [split_origin(file, problem) for problem in error.problems]
    if not recordings or len(files) - len(recordings) > MOST_FAULTY * len(files):
        raise InputError(join_shared_problems(problems, len(files), "files", exact=True))
    channel_map = _fill_units(channel_map, recordings)
    for file in list(recordings):
        if found := _find_recording_problems(recordings[file], channel_map):
            problems += [
                RecordingProblem(name=file.name, origin=file.name, sentence=problem) for problem in found
            ]
            del recordings[file]
    joined = join_shared_problems(problems, len(files), "files", exact=True)
    lost = [file.name for file in files if file not in recordings]
    if len(lost) > MOST_FAULTY * len(files):
        raise InputError(joined)
    return channel_map, recordings, joined, lost


def find_signal_problems(source: Path, channel_map: ChannelMap | None) -> list[str]:
    """Return the faults of the signals that a faulty map names, as far as it can be read.

    Parameters
    ----------
    source : recording, or folder of recordings
    channel_map : what can be read of the map; None if nothing
    """
    if channel_map is None:
        return []
    problems: list[RecordingProblem] = []
    try:
        files = recording_files(source, channel_map)
    except InputError as error:
        return list(error.problems)
    for file in files:
        try:
            read_signals(file, channel_map)
        except InputError as error:
            problems += [split_origin(file, problem) for problem in error.problems]
    return join_shared_problems(problems, len(files), "files", exact=True)


def leave_out_faulty(
    made: list[tuple[PlannedRun, Assembled]],
) -> tuple[list[tuple[PlannedRun, Assembled]], list[str]]:
    """Return the runs without those whose own samples are faulty, and the faults of these.

    Parameters
    ----------
    made : runs on their clocks

    Raises
    ------
    InputError
        Listing all problems, where one may be the map's, where more runs are faulty than may be left out, or where a
        part of the split keeps none.
    """
    placed = [
        RecordingProblem(name=run.name, origin=f"{run.name} ({run.file.name})", sentence=problem)
        for run, found in made
        for problem in found.problems
    ]
    joined = join_shared_problems(placed, len(made), "runs")
    faulty = {problem.name for problem in placed}
    kept = [(run, found) for run, found in made if run.name not in faulty]
    parts = {run.part for run, _ in made} - {run.part for run, _ in kept}
    if parts or len(faulty) > MOST_FAULTY * len(made) or any(found.of_map for _, found in made):
        raise InputError(joined)
    return kept, joined


def _fill_units(channel_map: ChannelMap, recordings: Signals) -> ChannelMap:
    """Return a map in which each channel without a unit has that which the recordings state."""
    problems, channels = [], dict(channel_map.channels)
    for name, entry in channel_map.channels.items():
        if entry.unit is not None:
            continue
        unit = choose_unit(entry.rule(name), list(recordings.values()))
        if isinstance(unit, list):
            problems += unit
            continue
        channels[name] = entry.model_copy(update={"unit": unit})
        try:
            _ = channels[name].rule(name).factor
        except InputError as error:
            problems += [f"channel {name}: {problem}" for problem in error.problems]
    if problems:
        raise InputError(problems)
    return channel_map.model_copy(update={"channels": channels})


def _find_recording_problems(signals: dict[str, Signal], channel_map: ChannelMap) -> list[str]:
    """Return units that are not the map's, and a clock whose unit it is not, before runs are looked for."""
    clock = channel_map.time
    taken = clock.unit if clock is not None and clock.unit in UNITS else "s"
    recording = Recordings(signals=[signals], rules=channel_map.rules, clock_unit=taken)
    violations = apply_checks(load("table of checks").recording, recording)
    return [*find_unit_problems(channel_map.rules, signals), *(one.sentence for one in violations)]


@dataclass(frozen=True, kw_only=True)
class RecordingProblem:
    """A fault and where it is.

    Parameters
    ----------
    name : of the run or the file, short
    origin : the same in full; empty where the sentence needs none
    sentence : the fault, without its origin
    """

    name: str
    origin: str
    sentence: str


def split_origin(path: Path, problem: str) -> RecordingProblem:
    """Return a file's fault, whose sentence begins with the file's path or name, without it.

    Parameters
    ----------
    path : of the file
    problem : as its reader reported it
    """
    origin = next((start for start in (str(path), path.name) if problem.startswith(start)), "")
    sentence = problem[len(origin) :].lstrip(": ") if origin else problem
    return RecordingProblem(name=path.name, origin=origin, sentence=sentence)


def join_shared_problems(
    found: Sequence[RecordingProblem], total: int, kind: str, *, exact: bool = False
) -> list[str]:
    """Return one sentence per fault, where three or more recordings that share a fault share its sentence.

    Figures that differ stand as a range, such as 212..250. Of two faults of one recording that differ in figures alone,
    the first is joined with the first of other recordings.

    Parameters
    ----------
    found : in the order in which they are reported
    total : runs or files that were looked at [1]
    kind : what they are, such as runs
    exact : join only what is reported in the same figures, as the names of signals are
    """
    groups: dict[tuple[str, int], list[RecordingProblem]] = {}
    counts: dict[tuple[str, str], int] = {}
    for problem in found:
        form = problem.sentence if exact else NUMBER.sub("#", problem.sentence)
        before = counts.get((problem.origin, form), 0)
        counts[problem.origin, form] = before + 1
        groups.setdefault((form, before), []).append(problem)
    return [
        sentence
        for group in groups.values()
        for sentence in (
            [_join_group(group, total, kind)]
            if len(group) >= SHARED
            else [f"{problem.origin}: {problem.sentence}".removeprefix(": ") for problem in group]
        )
    ]


def _join_group(group: Sequence[RecordingProblem], total: int, kind: str) -> str:
    names = [shorten(problem.name, 60) for problem in group]
    return f"in {len(names)} of {total} {kind} ({list_names(names)}): {_write_ranges(group)}"


def _write_ranges(group: Sequence[RecordingProblem]) -> str:
    """Return the sentence of a group, each figure that differs as a range from the lowest to the highest."""
    if len({problem.sentence for problem in group}) == 1:
        return group[0].sentence
    figures = zip(*(NUMBER.findall(problem.sentence) for problem in group), strict=True)
    ranges = iter([_write_range(values) for values in figures])
    return NUMBER.sub(lambda _: next(ranges), group[0].sentence)


def _write_range(values: Sequence[str]) -> str:
    low, high = min(values, key=float), max(values, key=float)
    return low if float(low) == float(high) else f"{low}..{high}"
