"""Conjunctive selection of braking events: quantities of the rules, a verdict on each event, and its attrition."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import isnan, nan

import numpy as np

from studies.measured_drives.events import Event, Protocol, RecordedRun, Rule, Window, find_events


@dataclass(frozen=True, kw_only=True)
class Quantity:
    """A quantity that a rule limits.

    Parameters
    ----------
    unit : of the result
    channels : channels that it needs
    measure : its function of an event
    """

    unit: str
    channels: tuple[str, ...]
    measure: Callable[[Event], float]


def _find_percentile_95(event: Event, channel: str, window: Window) -> float:
    return float(np.percentile(np.abs(event.columns[channel][event.mask_window(window)]), 95))


def _find_largest_rise(event: Event, channel: str, sign: float) -> float:
    inside = event.mask_window(event.protocol.evaluation)
    return max(float(np.max(sign * event.subtract_baseline(channel)[inside])), 0.0)


def _compute_onset_residual(event: Event) -> float:
    return float(abs(event.dive[int(np.argmin(np.abs(event.time)))]))


def _measure_pitch_deviation(event: Event) -> float:
    return float(np.std(event.columns["pitch"][event.mask_window(event.protocol.baseline)]))


def _percentile_quantity(channel: str, unit: str) -> Quantity:
    return Quantity(
        unit=unit,
        channels=(channel,),
        measure=lambda event: _find_percentile_95(event, channel, event.protocol.quality),
    )


QUANTITIES: dict[str, Quantity] = {
    "pressure_duration": Quantity(unit="s", channels=(), measure=lambda event: event.duration),
    "start_speed": Quantity(unit="m/s", channels=("speed",), measure=lambda event: event.start_speed),
    "pressure_increase": Quantity(
        unit="MPa", channels=(), measure=lambda event: _find_largest_rise(event, "brake_pressure", 1.0)
    ),
    "deceleration_increase": Quantity(
        unit="m/s^2",
        channels=("longitudinal_acceleration",),
        measure=lambda event: _find_largest_rise(event, "longitudinal_acceleration", -1.0),
    ),
    "steering_p95": _percentile_quantity("steering_angle", "deg"),
    "yaw_rate_p95": _percentile_quantity("yaw_rate", "deg/s"),
    "pitch_slope": Quantity(
        unit="deg/s", channels=("pitch",), measure=lambda event: abs(event.pitch_baseline[0])
    ),
    "pitch_deviation": Quantity(unit="deg", channels=("pitch",), measure=_measure_pitch_deviation),
    "onset_residual": Quantity(unit="deg", channels=("pitch",), measure=_compute_onset_residual),
    "vertical_acceleration_p95": _percentile_quantity("vertical_acceleration", "m/s^2"),
    "roll_rate_p95": _percentile_quantity("roll_rate", "deg/s"),
    "pressure_before_p95": Quantity(
        unit="MPa",
        channels=(),
        measure=lambda event: _find_percentile_95(event, "brake_pressure", event.protocol.baseline),
    ),
}
"""Quantities that selection rules may limit (paper, Appendix C.5)."""


@dataclass(frozen=True, kw_only=True)
class Judged:
    """One event with its result for every rule.

    Parameters
    ----------
    event : the event
    values : measured quantity by rule; NaN where its channel was not measured
    failed : names of the rules that it violates
    """

    event: Event
    values: dict[str, float]
    failed: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class Selection:
    """The events of a campaign and the verdict on each.

    Parameters
    ----------
    episodes : detected pressure episodes
    judged : events that cover the analysis window, in order of drive and time
    unassessed : rules whose channel no run has
    """

    episodes: int
    judged: tuple[Judged, ...]
    unassessed: tuple[str, ...]

    @property
    def retained(self) -> tuple[Event, ...]:
        """Events that satisfy every rule that could be assessed."""
        return tuple(judged.event for judged in self.judged if not judged.failed)


def select_events(drives: Sequence[RecordedRun], protocol: Protocol) -> Selection:
    """Detect, cut and judge the braking events of all drives.

    Parameters
    ----------
    drives : with at least brake_pressure, speed and pitch
    protocol : windows and rules
    """
    episodes, events = 0, []
    for drive in drives:
        found = find_events(drive, protocol)
        episodes += found[0]
        events += found[1]
    judged = tuple(judge_event(event, protocol.rules) for event in events)
    unassessed = tuple(
        rule.name for rule in protocol.rules if judged and all(isnan(one.values[rule.name]) for one in judged)
    )
    return Selection(episodes=episodes, judged=judged, unassessed=unassessed)


def judge_event(event: Event, rules: Sequence[Rule]) -> Judged:
    """Judge one event by every rule; a rule whose channel is missing is neither satisfied nor violated.

    Parameters
    ----------
    event : the event
    rules : all are evaluated, also after a violation
    """
    values = {
        rule.name: QUANTITIES[rule.name].measure(event)
        if all(channel in event.columns for channel in QUANTITIES[rule.name].channels)
        else nan
        for rule in rules
    }
    failed = tuple(
        rule.name for rule in rules if not isnan(values[rule.name]) and not rule.holds(values[rule.name])
    )
    return Judged(event=event, values=values, failed=failed)


@dataclass(frozen=True, kw_only=True)
class AttritionRow:
    """Events that one rule removes from a selection.

    Parameters
    ----------
    rule, criterion : its name, and its words
    threshold : for people, with unit
    fails : candidates that break it; None where its channel was not measured
    fails_only_here : candidates that break it and no other
    left : candidates that keep this rule and all before it
    paper_fails : failures the paper counts among its own candidates
    """

    rule: str
    criterion: str
    threshold: str
    fails: int | None
    fails_only_here: int | None
    left: int
    paper_fails: int | None


def tabulate_attrition(selection: Selection, protocol: Protocol) -> tuple[AttritionRow, ...]:
    """Return one row per rule, in the protocol's order; failure counts overlap, as in the paper's table.

    Parameters
    ----------
    selection : judged candidates
    protocol : the rules
    """
    rows = []
    left = list(selection.judged)
    for rule in protocol.rules:
        left = [judged for judged in left if rule.name not in judged.failed]
        assessed = rule.name not in selection.unassessed
        sign = ">=" if rule.is_minimum else "<="
        rows.append(
            AttritionRow(
                rule=rule.name,
                criterion=rule.criterion,
                threshold=f"{sign} {rule.limit:.4g} {QUANTITIES[rule.name].unit}",
                fails=sum(rule.name in one.failed for one in selection.judged) if assessed else None,
                fails_only_here=sum(one.failed == (rule.name,) for one in selection.judged)
                if assessed
                else None,
                left=len(left),
                paper_fails=rule.paper_fails,
            )
        )
    return tuple(rows)
