"""A check of measured data: a figure, its limits, and the sentence on what breaks them.

The table of checks is ``catalogs/campaign_checks.yaml``; the functions that measure stand in `signal_checks`,
`run_checks` and `session_checks`.
"""

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal, Self

Fault = Literal["run", "map", "warning"]
"""Of the run's own samples, which is then left out; perhaps of the map, which is refused; or none: a warning."""
Channels = tuple[tuple[str, ...], ...]
"""Channels that a check needs: of each group of names one."""
MOST_NAMES = 6
"""Names that a sentence lists [1]."""


@dataclass(frozen=True, kw_only=True)
class Figure:
    """What a check measured, and where.

    Parameters
    ----------
    value : that the limits hold for
    channel : of which it is; empty where it belongs to none, or to several
    places : runs that it is of, as a sentence names them
    words : further figures of the sentence, by name
    """

    value: float
    channel: str = ""
    places: tuple[str, ...] = ()
    words: Mapping[str, object] = field(default_factory=dict)


Measure = Callable[..., Iterable[Figure]]
"""Returns the figures of what a check sees, given the conditions of the check by name."""


@dataclass(frozen=True, kw_only=True)
class Check:
    """A row of the table.

    Parameters
    ----------
    name : of the check
    fault : whose fault it reports
    channels : that it needs
    measure : its function
    conditions : numbers that the function needs, by name
    lowest, highest : limits of its figures
    sentence : with the names of a figure's words, ``value``, ``channel``, ``places``, ``lowest`` and ``highest``
    unless : checks that report the same fault of a channel better
    """

    name: str
    fault: Fault
    channels: Channels
    measure: Measure
    conditions: Mapping[str, float]
    lowest: float
    highest: float
    sentence: str
    unless: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class CheckTable:
    """All checks, by what they look at.

    Parameters
    ----------
    clock : a `Clock`
    recording, recordings : a `Recordings`, of one and of all
    times, signal : a `LoggedSignal`, its times and its values
    stretch : a `Stretch`
    run : a `MeasuredRun`
    session : a `Session`
    spans : lowest and largest value that a channel of a road car has, by name [the channel's unit]
    """

    clock: tuple[Check, ...]
    recording: tuple[Check, ...]
    recordings: tuple[Check, ...]
    times: tuple[Check, ...]
    signal: tuple[Check, ...]
    stretch: tuple[Check, ...]
    run: tuple[Check, ...]
    session: tuple[Check, ...]
    spans: Mapping[str, tuple[float, float]]


@dataclass(frozen=True, kw_only=True)
class Violation:
    """A fault that a check reports.

    Parameters
    ----------
    check : its row
    channel : of which it is; empty where the sentence names it
    sentence : for people
    """

    check: Check
    channel: str
    sentence: str


class Channelled:
    """What checks look at, with its channels; of none as it stands here."""

    @property
    def names(self) -> Collection[str]:
        """Return the names of its channels."""
        return ()

    def having(self, channels: Channels) -> Self | None:
        """Return itself, or its part, with one channel of each group; None where it has not."""
        return self if all(set(group) & {*self.names} for group in channels) else None


def apply_checks(checks: Sequence[Check], view: Channelled) -> list[Violation]:
    """Return what the checks report of a signal, a run or a session.

    Of the figures of one check and channel that break its limits the worst is reported, with the places of all.

    Parameters
    ----------
    checks : rows of the table that suit the view, in the order in which they are reported
    view : what they look at
    """
    violations: list[Violation] = []
    for check in checks:
        seen = view.having(check.channels)
        broken: dict[str, list[Figure]] = {}
        for figure in () if seen is None else check.measure(seen, **check.conditions):
            better = {one.check.name for one in violations if figure.channel in ("", one.channel)}
            if not better & {*check.unless} and not check.lowest <= figure.value <= check.highest:
                broken.setdefault(figure.channel, []).append(figure)
        violations += [_make_violation(check, figures) for figures in broken.values()]
    return violations


def _make_violation(check: Check, figures: Sequence[Figure]) -> Violation:
    worst = max(figures, key=lambda figure: max(check.lowest - figure.value, figure.value - check.highest))
    sentence = check.sentence.format(
        value=worst.value,
        channel=worst.channel,
        places=list_names([place for figure in figures for place in figure.places]),
        lowest=check.lowest,
        highest=check.highest,
        **worst.words,
    )
    return Violation(check=check, channel=worst.channel, sentence=sentence)


def list_names(names: Sequence[str]) -> str:
    """Return names as a sentence lists them, such as "run-01, run-02 and 3 more".

    Parameters
    ----------
    names : of runs, or of places in files
    """
    more = f" and {len(names) - MOST_NAMES} more" if len(names) > MOST_NAMES else ""
    return ", ".join(names[:MOST_NAMES]) + more
