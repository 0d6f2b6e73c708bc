"""Errors on held-out runs: of the model as delivered, re-tuned without any new effect, and with the effects.

They are those of the channels, and of stopping distance and peak pitch.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from tasks.campaign.campaign import BRAKING_PRESSURE, CHANNEL_UNITS, CHANNELS
from tasks.identification.decision.answer import ChannelError
from tasks.identification.decision.search import Finding
from tasks.identification.inference.fit import Fit, fit_hypotheses
from tasks.identification.inference.forward import predict_channels
from tasks.identification.inference.hypothesis import compose_parameters
from tasks.identification.rules import DecisionRules
from tasks.vehicle.effects.table import EFFECT_TABLE

FELL = 2.0
"""Least decrease of speed of a braked run [m/s]."""
SMOOTHED = 0.1
"""Time over which pitch is averaged before its peak is taken, since the peak would otherwise be that of noise [s]."""
MANOEUVRE_UNITS = {"stopping_distance": "m", "peak_pitch": "deg"}
HeldOutErrors = tuple[dict[str, ChannelError], dict[str, ChannelError]]
"""Errors by channel; and of stopping distance and peak pitch, over the runs that brake."""
HALF = 0.5
"""Share of an error below which it is lowered, whatever resamples of few runs say [1]."""


def measure_manoeuvre_errors(
    measured: NDArray[np.float64],
    predictions: NDArray[np.float64],
    pressure: NDArray[np.float64],
    interval: float,
) -> NDArray[np.float64] | None:
    """Return model minus measured stopping distance and peak pitch, for several models of one run.

    The distance counts from the first brake pressure to the lowest speed that the measurement and every model reach
    by the last one, so that all distances end at one speed although the record ends at walking pace. Once the brake is
    released a car hardly slows: a few cm/s then decide where, metres later, it reaches a speed.

    Parameters
    ----------
    measured : float64 [N, 7] channels
    predictions : float64 [P, N, 7] the same of each model
    pressure : float64 [N] brake pressure [MPa]
    interval : time between samples [s]

    Returns
    -------
    float64 [P, 2] errors of stopping distance [m] and peak pitch [deg]; None where the run does not brake.
    """
    pressed = np.flatnonzero(pressure > BRAKING_PRESSURE)
    if not pressed.size:
        return None
    both = np.concatenate((measured[None], predictions))[:, pressed[0] :]
    braked = both[:, : pressed[-1] - pressed[0] + 1, CHANNELS.index("speed")]
    lowest = np.minimum.accumulate(braked, axis=1)
    reached = float(np.max(lowest[:, -1]))
    if float(np.min(lowest[:, 0])) - reached < FELL:
        return None
    distance = np.array([_distance_until(speed, reached, interval) for speed in lowest])
    width = min(max(round(SMOOTHED / interval), 1), both.shape[1])
    window = np.full(width, 1.0 / width)
    peak = np.array([np.convolve(p, window, mode="valid").max() for p in both[:, :, CHANNELS.index("pitch")]])
    figures = np.column_stack((distance, peak))
    return np.asarray(figures[1:] - figures[0], dtype=np.float64)


def _distance_until(speed: NDArray[np.float64], reached: float, interval: float) -> float:
    """Return the distance until a falling speed (float64 [N]) first reaches a value, by trapezia [m]."""
    end = int(np.argmax(speed <= reached))
    whole = float(np.sum(0.5 * (speed[1:end] + speed[: end - 1]))) * interval if end > 1 else 0.0
    if end == 0:
        return 0.0
    step = speed[end - 1] - speed[end]
    share = (speed[end - 1] - reached) / step if step > 0.0 else 1.0
    return whole + 0.5 * (speed[end - 1] + reached) * share * interval


def compute_held_out_errors(finding: Finding, fitted: Fit, rules: DecisionRules) -> HeldOutErrors:
    """Return the RMSE on held-out runs under the frozen, the re-tuned and the grown model.

    Parameters
    ----------
    finding : the runs; re-tuning starts from the fit without candidates
    fitted : fit of what is named
    rules : how far re-tuning may go, and resamples
    """
    evidence = finding.evidence
    retuned = fit_hypotheses(
        evidence.train,
        (),
        rules.retune_widening * evidence.session_sigma,
        session=finding.null.session,
        iterations=8,
    )
    models = (
        (np.zeros(len(EFFECT_TABLE)), ()),
        compose_parameters((), np.empty(0), retuned.session),
        fitted.compose(),
    )
    names, square, braked, manoeuvres = [], [], [], []
    measured = np.isfinite(evidence.train[0].sigma)
    for model in evidence.held_out:
        y = np.array([predict_channels(model, theta, slots=slots) for theta, slots in models])
        names.append(model.run.name)
        square.append(model.compute_square_error(y))
        errors = measure_manoeuvre_errors(model.measured, y, model.pressure, model.run.interval)
        if errors is not None:
            braked.append(model.run.name)
            manoeuvres.append(errors**2)
    units = {n: u for n, u, there in zip(CHANNELS, CHANNEL_UNITS, measured, strict=True) if there}
    channels = summarise_errors(np.array(square)[:, :, measured], names, units, rules.error_resamples)
    if not braked:
        return channels, {}
    seen = [figure for figure in MANOEUVRE_UNITS if figure != "peak_pitch" or "pitch" in units]
    figures = np.array(manoeuvres)[:, :, [list(MANOEUVRE_UNITS).index(figure) for figure in seen]]
    return channels, summarise_errors(
        figures, braked, {f: MANOEUVRE_UNITS[f] for f in seen}, rules.error_resamples
    )


def summarise_errors(
    square: NDArray[np.float64], runs: list[str], units: Mapping[str, str], resamples: int
) -> dict[str, ChannelError]:
    """Return RMSE and bootstrap intervals by channel.

    Parameters
    ----------
    square : float64 [R, 3, C] mean squared errors by run, model (frozen, re-tuned, grown) and channel [unit^2]
    runs : names of the R runs
    units : unit of each of the C channels, by name
    resamples : number of bootstrap resamples [1]
    """
    draws = np.random.Generator(np.random.Philox(0)).integers(0, len(runs), (resamples, len(runs)))
    errors = {}
    for c, (name, unit) in enumerate(units.items()):
        frozen, tuned, after = np.sqrt(square[:, :, c].mean(axis=0))
        resampled = np.sqrt(square[draws, :, c].mean(axis=1))
        low, high = np.percentile(resampled[:, 2], (2.5, 97.5))
        change = np.percentile(resampled[:, 2] - resampled[:, 0], (2.5, 97.5))
        errors[name] = ChannelError(
            frozen=float(frozen), retuned=float(tuned), after=float(after), ci_low=float(low), ci_high=float(high),
            change_low=float(change[0]), change_high=float(change[1]),
            wins=int(np.sum(square[:, 2, c] < square[:, 0, c])),
            worst_run=runs[int(np.argmax(square[:, 2, c]))], unit=unit,
        )  # fmt: skip
    return errors


def is_lowered(error: ChannelError) -> bool:
    """Whether an error of held-out runs is smaller than under the vehicle file: in 95 % of resamples, or by half.

    Of two or three runs one that was right before decides a resample alone.

    Parameters
    ----------
    error : of a channel or figure
    """
    return error.change_high < 0.0 or error.after < HALF * error.frozen
