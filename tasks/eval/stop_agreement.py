"""Agreement of a stop's duration and of the way that it slides: the paper's development MAEs (Appendix C.2)."""

from collections.abc import Mapping

import numpy as np

from tasks.eval.state_agreement import STOP_SPEED, WHEELS, CaseFacts, Floats, find_brake_onset, find_stop

STOP_FIGURES = ("braking_time_error_s", "slip_distance_error_m")
"""Errors of a stop: of the time from brake onset to it [s]; of the way that the wheels slide [m], the mean over wheels
of the integral of slip times speed over that time: declared, the paper does not define its slip distance."""


def stop_agreement(
    reference: Mapping[str, Floats], model: Mapping[str, Floats], facts: CaseFacts
) -> dict[str, float] | None:
    """Return `STOP_FIGURES` by name; None for a case that is no flat-road stop or a trace in which nothing stops.

    A reference whose last sample is as slow as twice the stopping speed has stopped at its end.

    Parameters
    ----------
    reference, model : columns as `tasks.eval.state_agreement.case_agreement` takes them
    facts : of the case
    """
    if facts.kind != "flat":
        return None
    slips = {wheel: f"slip_{wheel}" for wheel in WHEELS}
    measured = _describe_stop(reference["time"], reference, slips, facts, ends=True)
    axles = {wheel: f"braking_slip_{axle}" for wheel, axle in WHEELS.items()}
    computed = _describe_stop(model["t_ns"] * 1e-9, model, axles, facts, ends=False)
    if measured is None or computed is None:
        return None
    errors = (abs(ours - theirs) for ours, theirs in zip(computed, measured, strict=True))
    return dict(zip(STOP_FIGURES, errors, strict=True))


def _describe_stop(
    time: Floats, columns: Mapping[str, Floats], slips: Mapping[str, str], facts: CaseFacts, *, ends: bool
) -> tuple[float, float] | None:
    """Braking time [s] and slip distance [m] of a trace; None where it does not stop."""
    onset = find_brake_onset(time, columns["station"], facts)
    stop = find_stop(time, columns["speed"], onset)
    if stop is None and ends and columns["speed"][-1] <= 2 * STOP_SPEED:
        stop = float(time[-1])
    if stop is None:
        return None
    inside = (time >= onset - 1e-9) & (time <= stop + 1e-9)
    slid = np.mean([columns[name][inside] for name in slips.values()], axis=0) * columns["speed"][inside]
    return stop - onset, float(np.trapezoid(slid, time[inside]))
