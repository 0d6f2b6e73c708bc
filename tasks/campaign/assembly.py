"""A run on its clock, from a file's signals or from the columns of a campaign, with every problem of it."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tasks.campaign.campaign import LEAST_SAMPLES
from tasks.campaign.channels import COLUMN_UNITS
from tasks.campaign.checks import CheckTable, Violation, apply_checks
from tasks.campaign.measured import STAND_IN, LoggedSignal, MeasuredRun, Stretch
from tasks.campaign.signals import (
    ChannelRule,
    Signal,
    convert_to_channel,
    make_common_clock,
    resample_on_clock,
)
from tasks.campaign.slow_channels import (
    clear_between_samples,
    fill_between_samples,
    mark_samples,
    take_samples,
)


@dataclass(frozen=True, kw_only=True)
class Assembled:
    """One run on a common clock, or its problems.

    Parameters
    ----------
    start : the logger's time of the first sample, delays taken off [s]
    columns : channels by name, each float64 [N], in campaign units, NaN between the samples of a slow channel; empty
        if there are problems
    run : what can be read of it, for the checks that need all runs
    problems : one sentence each
    of_map : one of them is reported for the channels together, so that the map may be wrong for every run
    computed : sentence on an acceleration that the logger computed from the speed; empty where it is none
    """

    start: float
    columns: Mapping[str, NDArray[np.float64]]
    run: MeasuredRun
    problems: tuple[str, ...] = ()
    of_map: bool = False
    computed: str = ""

    def without(self, channel: str) -> "Assembled":
        """Return the run as if a channel was not measured."""
        columns, readable = (
            {name: values for name, values in part.items() if name != channel}
            for part in (self.columns, self.run.columns)
        )
        return replace(self, columns=columns, run=replace(self.run, columns=readable))


def assemble_run(
    signals: Mapping[str, Signal],
    rules: Sequence[ChannelRule],
    start: float,
    end: float,
    rate: float,
    table: CheckTable,
    *,
    about: MeasuredRun | None = None,
) -> Assembled:
    """Bring one stretch of a recording onto a common clock.

    Parameters
    ----------
    signals : logged signals by name
    rules : the channel map
    start, end : limits of the run in the logger's time, delays taken off; infinite for the whole recording [s]
    rate : of the run [Hz]
    table : of checks
    about : run of that name and on that road, without columns; None for one without a name on a dry and flat road
    """
    logged = _log_channels(signals, rules, start, end, table)
    violations = [
        one
        for own in logged.values()
        for signal in own
        for one in apply_checks((*table.times, *table.signal), signal)
    ]
    problems = _join_channels(violations)
    usable = {channel: own for channel, own in logged.items() if not any(_is_unreadable(one) for one in own)}
    run = replace(about or MeasuredRun(interval=1.0 / rate), interval=1.0 / rate, spans=table.spans)
    nothing = Assembled(start=start, columns={}, run=run, problems=tuple(problems))
    if not usable:
        return nothing
    stretch = Stretch(signals=usable, rate=rate)
    of_stretch = apply_checks(table.stretch, stretch)
    problems += [one.sentence for one in of_stretch if one.check.fault == "run"]
    if any(one.check.name == "spare_samples" for one in of_stretch):
        return replace(nothing, problems=tuple(problems))
    converted = {channel: [one.converted for one in own] for channel, own in usable.items()}
    clock = make_common_clock([signal for own in converted.values() for signal in own], rate)
    columns = {
        channel: np.mean([resample_on_clock(signal, clock) for signal in own], axis=0)
        for channel, own in converted.items()
    }
    broken = {one.channel for one in violations}
    whole = {channel: values for channel, values in columns.items() if channel not in broken}
    stands_in = any(rule.channel == "brake_pressure" and rule.gain is not None for rule in rules)
    run = replace(
        run, columns=_name_brake(whole, stands_in), units={rule.channel: rule.unit for rule in rules}
    )
    of_run = apply_checks(table.run, run)
    problems += [one.sentence for one in of_run]
    if not problems:
        columns = {
            name: clear_between_samples(name, values, converted[name], clock)
            for name, values in columns.items()
        }
    return Assembled(
        start=float(clock[0]),
        columns={} if problems else columns,
        run=run,
        problems=tuple(problems),
        of_map=any(one.check.fault == "map" for one in of_run),
        computed=next((one.sentence for one in of_stretch if one.check.name == "computed_acceleration"), ""),
    )


def judge_columns(
    columns: Mapping[str, NDArray[np.float64]],
    units: Mapping[str, str],
    about: MeasuredRun,
    needed: Collection[str],
    table: CheckTable,
    *,
    brake_stands_in: bool = False,
) -> tuple[MeasuredRun, list[str]]:
    """Return what can be read of a campaign's run, and every problem of it, one sentence each.

    Parameters
    ----------
    columns : measured columns by name, each float64 [N]; NaN between the samples of a slow channel
    units : units from the file's metadata, by column; a column without one counts as correct
    about : the run without its columns, at the declared interval
    needed : columns that there must be
    table : of checks
    brake_stands_in : the brake pressure is another signal in its place, whose scale nobody knows
    """
    problems = [
        f"channel {name} is missing: if nobody measured it, list it under not_measured in campaign.yaml"
        for name in needed
        if name not in columns
    ]
    count = max((len(values) for values in columns.values()), default=0)
    if count < LEAST_SAMPLES:
        return about, [*problems, f"a run needs at least {LEAST_SAMPLES} samples; it has {count}"]
    misread = {name for name in columns if units.get(name, COLUMN_UNITS[name]) != COLUMN_UNITS[name]}
    problems += [
        f"channel {name} must be in {COLUMN_UNITS[name]}; its metadata says {units[name]}"
        for name in COLUMN_UNITS
        if name in misread
    ]
    clock = about.interval * np.arange(count, dtype=np.float64)
    sampled = {name: mark_samples(name, columns[name]) for name in COLUMN_UNITS if name in columns}
    signals = {name: Signal(time=clock[own], values=columns[name][own]) for name, own in sampled.items()}
    violations = [
        one
        for name, signal in signals.items()
        for one in apply_checks(
            (*table.times, *table.signal),
            LoggedSignal(channel=name, logged=signal, converted=signal, speed=signals.get("speed")),
        )
    ]
    broken = {one.channel for one in violations if one.check.name != "frozen"} | misread
    usable = {name: fill_between_samples(name, columns[name]) for name in signals if name not in broken}
    run = replace(about, columns=_name_brake(usable, brake_stands_in), spans=table.spans)
    of_run = [one.sentence for one in apply_checks(table.run, run)]
    return run, problems + _join_channels(violations) + of_run


def _log_channels(
    signals: Mapping[str, Signal], rules: Sequence[ChannelRule], start: float, end: float, table: CheckTable
) -> dict[str, list[LoggedSignal]]:
    """Return the signals of each channel within a run, as logged and converted."""
    logged = {
        rule.channel: {
            name: take_samples(rule.channel, signals[name]).cut_window(start + rule.delay, end + rule.delay)
            for name in rule.sources
        }
        for rule in rules
    }
    converted = {
        rule.channel: {
            name: convert_to_channel(signal, rule) for name, signal in logged[rule.channel].items()
        }
        for rule in rules
    }
    speed = next(iter(converted.get("speed", {}).values()), None)
    return {
        rule.channel: [
            LoggedSignal(
                channel=rule.channel, source=name, logged=signal, converted=converted[rule.channel][name],
                others=converted[rule.channel], speed=speed, span=table.spans[rule.channel], unit=rule.unit,
                stands_in=rule.gain is not None,
            )
            for name, signal in logged[rule.channel].items()
        ]
        for rule in rules
    }  # fmt: skip


def _name_brake(
    columns: Mapping[str, NDArray[np.float64]], stands_in: bool
) -> dict[str, NDArray[np.float64]]:
    """Return channels in which a brake pressure whose scale nobody knows has a name of its own."""
    return {
        STAND_IN if stands_in and name == "brake_pressure" else name: values
        for name, values in columns.items()
    }


def _join_channels(violations: Iterable[Violation]) -> list[str]:
    """Write one sentence per problem; channels of one clock share its faults, so they share the sentence."""
    channels: dict[str, list[str]] = {}
    for one in violations:
        if one.channel not in channels.setdefault(one.sentence, []):
            channels[one.sentence].append(one.channel)
    return [
        f"channel{'s' if len(names) > 1 else ''} {', '.join(names)}: {sentence}"
        for sentence, names in channels.items()
    ]


def _is_unreadable(signal: LoggedSignal) -> bool:
    time, values = signal.converted.time, signal.converted.values
    return len(time) < 2 or not np.isfinite(values).all() or bool((np.diff(time) <= 0).any())
