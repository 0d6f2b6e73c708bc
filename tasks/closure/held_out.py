"""Error on runs that no fit has seen: as delivered, re-tuned without any new effect, and with the effects."""

import numpy as np

from tasks.closure.answer import ChannelError
from tasks.closure.campaign import CHANNEL_UNITS, CHANNELS
from tasks.closure.fit import Fit, fit
from tasks.closure.forward import predict
from tasks.closure.hypothesis import compose
from tasks.closure.screening import Evidence
from tasks.vehicle.effects.library import ALL_PARAMETERS

RETUNE_WIDENING = 10.0
"""Factor on the session's tolerances when a model is re-tuned without any new effect."""
ERROR_DRAWS = 1000


def held_out_error(evidence: Evidence, null: Fit, base: Fit) -> dict[str, ChannelError]:
    """RMSE by channel on held-out runs under the frozen, the re-tuned and the grown model.

    Parameters
    ----------
    evidence : the runs
    null : fit without effects, where re-tuning starts
    base : fit with the accepted effects
    """
    retuned = fit(
        evidence.train, (), RETUNE_WIDENING * evidence.session_sigma, session=null.session, iterations=8
    )
    square = np.zeros((3, len(evidence.held_out), len(CHANNELS)))
    for i, run in enumerate(evidence.held_out):
        for j, (theta, slots) in enumerate(
            (
                (np.zeros(len(ALL_PARAMETERS)), ()),
                compose((), np.empty(0), retuned.session),
                compose(base.parts, base.values, base.session),
            )
        ):
            square[j, i] = np.mean((run.model.measured - predict(run.model, theta, slots=slots)) ** 2, axis=0)
    draws = np.random.Generator(np.random.Philox(0)).integers(
        0, square.shape[1], (ERROR_DRAWS, square.shape[1])
    )
    errors = {}
    for c, (name, unit) in enumerate(zip(CHANNELS, CHANNEL_UNITS, strict=True)):
        frozen, tuned, after = np.sqrt(square[:, :, c].mean(axis=1))
        resampled = np.sqrt(square[:, draws, c].mean(axis=2))
        low, high = np.percentile(resampled[2], (2.5, 97.5))
        change = np.percentile(resampled[2] - resampled[0], (2.5, 97.5))
        errors[name] = ChannelError(
            frozen=float(frozen), retuned=float(tuned), after=float(after), ci_low=float(low), ci_high=float(high),
            change_low=float(change[0]), change_high=float(change[1]),
            wins=int(np.sum(square[2, :, c] < square[0, :, c])),
            worst_run=evidence.held_out[int(np.argmax(square[2, :, c]))].model.run.name, unit=unit,
        )  # fmt: skip
    return errors
