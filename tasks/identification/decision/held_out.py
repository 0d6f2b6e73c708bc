"""Errors on held-out runs: of the model as delivered, re-tuned without any new effect, and with the effects."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from tasks.campaign.campaign import CHANNEL_UNITS, CHANNELS
from tasks.campaign.manoeuvres import MANOEUVRE_UNITS, measure_manoeuvre_errors
from tasks.identification.decision.answer import ChannelError
from tasks.identification.decision.search import Finding
from tasks.identification.inference.fit import Fit, fit_hypotheses
from tasks.identification.inference.forward import predict_channels
from tasks.identification.inference.hypothesis import compose_parameters
from tasks.identification.rules import DecisionRules
from tasks.vehicle.effects.table import EFFECT_TABLE

HeldOutErrors = tuple[dict[str, ChannelError], dict[str, ChannelError]]
"""Errors by channel; and of stopping distance and peak pitch, over the runs that brake."""
HALF = 0.5
"""Share of an error below which it is lowered, whatever resamples of few runs say [1]."""


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
