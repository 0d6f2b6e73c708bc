"""What the checks of the catalogue tell of a run, or of all runs, of a test."""

from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

from catalogs.entries import load
from tasks.campaign.checks import apply_checks
from tasks.campaign.measured import LoggedSignal, MeasuredRun, Session
from tasks.campaign.signals import Signal

Columns = Mapping[str, NDArray[np.float64]]
TABLE = load("table of checks")
CONDITIONS = {
    check.name: check.conditions for check in (*TABLE.recording, *TABLE.stretch, *TABLE.run, *TABLE.session)
}
"""Numbers that the functions of the checks need."""


def tell_run(columns: Columns, interval: float = 0.01, **units: str) -> list[str]:
    """Sentences on one run; units are those of the map."""
    run = MeasuredRun(columns=columns, interval=interval, units=units, spans=TABLE.spans)
    return [one.sentence for one in apply_checks(TABLE.run, run)]


def make_runs(
    runs: Mapping[str, Columns], interval: float = 0.01, slippery: Iterable[str] = (), **units: str
) -> list[MeasuredRun]:
    return [
        MeasuredRun(name=name, columns=columns, interval=interval, units=units, slippery=name in slippery)
        for name, columns in runs.items()
    ]


def tell_session(
    runs: Mapping[str, Columns], interval: float = 0.01, slippery: Iterable[str] = (), **units: str
) -> dict[str, str]:
    """Sentences on all runs by the name of their check."""
    session = Session(runs=make_runs(runs, interval, slippery, **units))
    return {one.check.name: one.sentence for one in apply_checks(TABLE.session, session)}


def tell_signal(signal: Signal, channel: str = "speed", speed: Signal | None = None) -> list[str]:
    """Sentences on one signal of a channel."""
    logged = LoggedSignal(
        channel=channel, logged=signal, converted=signal, speed=speed, span=TABLE.spans[channel]
    )
    return [one.sentence for one in apply_checks((*TABLE.times, *TABLE.signal), logged)]
