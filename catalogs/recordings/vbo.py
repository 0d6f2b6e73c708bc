"""Text files of RaceLogic's VBOX loggers (.vbo): sections of names, units and rows, with the time of day as a clock.

``[header]`` lists the channels in words, such as ``velocity kmh``; ``[column names]`` gives the names by which a map
takes them; ``[channel units]`` the units of the last of them, which a logger adds to its own.
"""

import io
from pathlib import Path

import numpy as np
import pandas as pd

from catalogs.campaign_files import find_name_bounds
from catalogs.channel_maps import ChannelMap, TimeEntry
from catalogs.documents import read_content
from catalogs.recordings.columns import Spelling, convert_values
from catalogs.recordings.forms import (
    LARGEST_FILE,
    Form,
    SignalSummary,
    describe_missing,
    describe_twice,
    find_clock_problem,
    number_names,
    sample_column,
    signal_names,
    summarise_signal,
)
from catalogs.sentences import shorten
from tasks.campaign.clocks import TIME_OF_DAY, convert_to_seconds
from tasks.campaign.signals import Signal
from tasks.campaign.stated_units import parse_unit
from tasks.errors import InputError

CLOCK = TimeEntry(source="time", unit=TIME_OF_DAY)


def read_vbo(path: Path, channel_map: ChannelMap) -> dict[str, Signal]:
    """Return the signals of a VBOX file that a map names.

    Raises
    ------
    InputError
        With one sentence per problem.
    """
    samples, units = _load_columns(path)
    time = _read_times(path, samples)
    problems, signals = [], {}
    for name in signal_names(channel_map):
        if name not in samples:
            twice = {known: "" for known in samples if known.rpartition("#")[0] == name}
            problems += (
                [describe_twice(path, name, twice)] if twice else describe_missing(path, (name,), (), samples)
            )
            continue
        values, note = convert_values(samples[name], Spelling(meanings=channel_map.meanings_of(name)))
        signals[name] = sample_column(time, values, channel_map.time or CLOCK, units[name])
        if note:
            problems.append(f"{path.name}: signal {name} must be of numbers; {note}")
    if problems:
        raise InputError(problems)
    return signals


def summarise_vbo(path: Path, _: ChannelMap | None) -> list[SignalSummary]:
    """Return a row for each column.

    Raises
    ------
    InputError
        If the file cannot be read.
    """
    samples, units = _load_columns(path)
    time, rows = _read_times(path, samples), []
    for name, column in samples.items():
        values, note = convert_values(column, Spelling())
        rows.append(summarise_signal(name, sample_column(time, values, CLOCK, units[name]), note))
    return rows


def _load_columns(path: Path) -> tuple[dict[str, pd.Series], dict[str, str]]:
    """Return the columns and their units, empty where none is stated, by name."""
    content = read_content(path, "recording", LARGEST_FILE)
    if b"\0" in content:
        raise InputError(f"{path}: must be text; it holds zero bytes")
    head, mark, data = content.decode("latin-1").partition("[data]")
    sections = _split_sections(head)
    words = " ".join(sections.get("column names", [])).split()
    if not mark or not words:
        raise InputError(f"{path}: a VBOX file must have the sections [column names] and [data]")
    if problems := find_name_bounds(words, path.name):
        raise InputError(problems)
    try:
        frame = pd.read_csv(
            io.StringIO(data), sep=r"\s+", header=None, names=range(len(words)), index_col=False
        )
    except (ValueError, OverflowError) as error:
        raise InputError(f"{path}: must be a table of text; {shorten(error)}") from None
    frame.index += 1
    names = number_names(words)
    in_header = [_read_unit(line) for line in sections.get("header", [])][: len(names)]
    extra = sections.get("channel units", [])[: len(names)]
    stated = in_header + [""] * (len(names) - len(in_header))
    stated[len(names) - len(extra) :] = [unit.strip("[]()") or stated[k] for k, unit in enumerate(extra)]
    return {name: frame[k] for k, name in enumerate(names)}, dict(zip(names, stated, strict=True))


def _split_sections(head: str) -> dict[str, list[str]]:
    """Return the lines of each section that are not empty."""
    sections: dict[str, list[str]] = {}
    lines: list[str] = []
    for line in head.splitlines():
        text = line.strip()
        if text.startswith("[") and text.endswith("]"):
            lines = sections.setdefault(text[1:-1].lower(), [])
        elif text:
            lines.append(text)
    return sections


def _read_unit(line: str) -> str:
    """Return the unit at the end of a channel's words; empty without one."""
    last = line.split()[-1]
    return last if len(line.split()) > 1 and parse_unit(last) else ""


def _read_times(path: Path, samples: dict[str, pd.Series]) -> np.ndarray:
    if "time" not in samples:
        raise InputError(
            f"{path.name}: a VBOX file must have the column time; there are: {shorten(', '.join(samples))}"
        )
    stamps, note = convert_values(samples["time"], Spelling())
    problem = find_clock_problem(path, CLOCK, "", stamps)
    if note or problem:
        raise InputError(problem or f"{path.name}: the column time must be of numbers; {note}")
    return convert_to_seconds(stamps, TIME_OF_DAY)


VBO = Form(read=read_vbo, summarise=summarise_vbo)
