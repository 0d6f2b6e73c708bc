"""Helpers shared by the readers of all forms: names, clocks, summaries, limits and optional packages."""

from collections import Counter
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from importlib import import_module
from pathlib import Path
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from catalogs.channel_maps import ChannelMap, TimeEntry
from catalogs.sentences import shorten
from tasks.campaign.channels import UNITS
from tasks.campaign.clocks import TIME_OF_DAY, has_digits_of_day
from tasks.campaign.signals import Signal
from tasks.campaign.stated_units import parse_unit, read_unit_of_name
from tasks.errors import InputError

LARGEST_FILE = 2**30
"""Bytes of a recording that is read whole, also when unpacked [1]: a day of twenty channels at 100 Hz as text."""
MOST_COLUMNS = 64
"""Elements of a list, or columns of a matrix, that become signals [1]; longer ones are pictures and clouds."""
MOST_NAMES = 20_000
"""Signals of one file [1]."""


@dataclass(frozen=True, kw_only=True)
class SignalSummary:
    """A signal as one row of a list.

    Parameters
    ----------
    signal : name by which a channel map takes it
    unit : unit that the file states; empty if it states none
    samples : number of values [1]
    rate_hz : mean rate; None without a clock [Hz]
    start_s, end_s : times of the first and the last sample; None without a clock [s]
    lowest, highest : range of the finite values; None without any [the unit]
    note : why its values are no numbers, and what to do; empty where they are
    """

    signal: str
    unit: str
    samples: int
    rate_hz: float | None
    start_s: float | None
    end_s: float | None
    lowest: float | None
    highest: float | None
    note: str = ""


@dataclass(frozen=True, kw_only=True)
class Form:
    """A form of recordings.

    Parameters
    ----------
    read : returns the signals of a file that a map names
    summarise : returns a row for each signal of a file; a map, if there is one, gives the clock and the form of text
    """

    read: Callable[[Path, ChannelMap], dict[str, Signal]]
    summarise: Callable[[Path, ChannelMap | None], list[SignalSummary]]


def signal_names(channel_map: ChannelMap) -> tuple[str, ...]:
    """Return the signals that a map reads, each once."""
    return tuple(dict.fromkeys(name for rule in channel_map.rules for name in rule.sources))


def require_clock(path: Path, channel_map: ChannelMap) -> TimeEntry:
    """Return the map's clock for a file whose signals have none of their own.

    Raises
    ------
    InputError
        If the map names none.
    """
    if channel_map.time is None:
        raise InputError(f"{path}: a file without its own clock needs time: {{source: COLUMN}} in the map")
    return channel_map.time


def find_clock_problem(path: Path, clock: TimeEntry, stated: str, stamps: NDArray[np.float64] | None) -> str:
    """Return the problem of a clock whose unit in the map is not that of the file; empty if there is none.

    Parameters
    ----------
    path : of the recording
    clock : from the channel map
    stated : unit that the file states; empty if it states none
    stamps : float64 [N] [the clock's unit]; None where the file has dates
    """
    if clock.unit == TIME_OF_DAY:
        if stamps is None or has_digits_of_day(stamps):
            return ""
        return (
            f"{path.name}: clock {clock.source} must be in {TIME_OF_DAY}, with minutes and seconds below 60; it reads"
            f" {np.nanmin(stamps):g} to {np.nanmax(stamps):g}: correct its unit in the map"
        )
    for unit in (parse_unit(stated), read_unit_of_name(clock.source, "time")):
        if unit and UNITS[unit][0] == "time" and unit != clock.unit and stamps is not None:
            return (
                f"{path.name}: clock {clock.source} is in {unit} by its file, in {clock.unit} by the map: correct the"
                " map"
            )
    return ""


def sample_column(
    time: NDArray[np.float64], values: NDArray[np.float64], clock: TimeEntry, unit: str = ""
) -> Signal:
    """Return a column on its clock, without the rows that hold no time or no value.

    Parameters
    ----------
    time : float64 [N] [s]
    values : float64 [N] [unit]; NaN where a table of several rates has no sample
    clock : from the channel map
    unit : unit that the file states
    """
    usable = np.isfinite(time) & ~np.isnan(values)
    time, values = time[usable], values[usable]
    if clock.repeats == "keep_first":
        # among its own samples: a bus log has a row for each message, and most of its cells are empty
        first = np.concatenate(([True], np.diff(time) != 0.0))[: len(time)]
        time, values = time[first], values[first]
    return Signal(time=time, values=values, unit=unit)


def summarise_signal(name: str, signal: Signal, note: str = "") -> SignalSummary:
    """Return the row of a signal.

    Parameters
    ----------
    name : in its file
    signal : on its clock; without times if its clock is not known
    note : why its values are no numbers
    """
    values = signal.values[~np.isnan(signal.values)]
    finite = values[np.isfinite(values)]
    times = signal.time[np.isfinite(signal.time)]
    span = float(times[-1] - times[0]) if len(times) > 1 else 0.0
    return SignalSummary(
        signal=name,
        unit=signal.unit,
        samples=len(values),
        rate_hz=(len(times) - 1) / span if span > 0.0 else None,
        start_s=float(times[0]) if len(times) else None,
        end_s=float(times[-1]) if len(times) else None,
        lowest=float(finite.min()) if len(finite) else None,
        highest=float(finite.max()) if len(finite) else None,
        note=note,
    )


def number_names(names: Sequence[str]) -> list[str]:
    """Return names by which a map takes columns: as they stand, and numbered, such as speed#2, where one stands twice.

    Parameters
    ----------
    names : of all columns
    """
    seen: dict[str, int] = {}
    numbered = []
    twice = {name for name, count in Counter(names).items() if count > 1}
    for name in names:
        seen[name] = seen.get(name, 0) + 1
        numbered.append(f"{name}#{seen[name]}" if name in twice else name)
    return numbered


def describe_twice(path: Path, name: str, choices: Mapping[str, str]) -> str:
    """Return the problem of a name that several columns have, with the name of each in a map.

    Parameters
    ----------
    path : of the recording
    name : in the map
    choices : name by which a map takes a column, and where it stands; two or more
    """
    listed = ", ".join(f"{choice} ({where})" if where else choice for choice, where in choices.items())
    return (
        f"{path.name}: signal {shorten(name, 60)} stands {len(choices)} times: in the map name one of them as its"
        f" source: {shorten(listed)}"
    )


def describe_missing(
    path: Path, names: tuple[str, ...], there: Collection[str], known: Iterable[str]
) -> list[str]:
    """Return a sentence for each missing name, with similar names of the file."""
    listed = [str(name) for name in known]
    problems = []
    for name in names:
        if name not in there:
            near = get_close_matches(name, listed, n=3) or listed[:12]
            problems.append(f"{path.name}: signal {name} is missing; there are: {shorten(', '.join(near))}")
    return problems


def import_package(package: str, kind: str, extra: str) -> ModuleType:
    """Return an optional package.

    Parameters
    ----------
    package : its name
    kind : files that it reads, for the sentence
    extra : muSync's extra that installs it

    Raises
    ------
    InputError
        If it is not installed, or something that it needs is not.
    """
    try:
        return import_module(package)
    except ImportError as error:
        needs = f"reading {kind} needs the package {package}"
        if isinstance(error, ModuleNotFoundError) and error.name == package:
            raise InputError(f'{needs}: install it with pip install "musync-gs[{extra}]"') from None
        raise InputError(
            f"{needs}, which is installed and does not load ({shorten(error)}): install what it lacks, or all of it"
            f" again with pip install --force-reinstall {package}"
        ) from None
