"""Faults of a log that look exactly like a named effect, so that no search can tell them from it."""

from collections.abc import Collection, Sequence

import numpy as np

from tasks.campaign.campaign import Campaign
from tasks.identification.decision.answer import NamedEffect

RESTING = 1.0
"""Time before a run's largest rate of pressure in which the driver is not on the brake yet [s]."""
LEAST_SHARE, MOST_SHARE = 0.5, 2.0
"""Resting pressure over push-out pressure between which the gauge may be what is off [1]."""


def tell_like_instruments(
    campaign: Campaign, named: Sequence[NamedEffect], rivals: Collection[str]
) -> list[str]:
    """Return a sentence for each named effect that a fault of the log would look exactly like.

    Parameters
    ----------
    campaign : measured runs
    named : effects that are named
    rivals : names of effects that cannot be told from them
    """
    numbers = {effect.name: effect.parameters[0].value for effect in named}
    told = []
    if "brake_dead_time" in numbers and "sensor_speed_delay" not in rivals:
        told.append(
            "brakes that answer late look the same as responses that are all logged late by one time: check that the"
            " brake signal and the others share a clock"
        )
    if "push_out_pressure" in numbers:
        rest, push_out = find_resting_pressure(campaign), numbers["push_out_pressure"]
        if LEAST_SHARE * push_out < rest < MOST_SHARE * push_out:
            told.append(
                f"the brake pressure rests at {rest:.3g} MPa before the brake: a gauge whose zero is off looks the same"
                f" as pads that need {push_out:.3g} MPa to touch; if the foot was off, give the channel offset:"
                f" {-rest:.3g}"
            )
    return told


def find_resting_pressure(campaign: Campaign) -> float:
    """Return the median over the runs of the pressure before the brake [MPa].

    Parameters
    ----------
    campaign : measured runs
    """
    rests = []
    for run in campaign.runs:
        onset = int(np.argmax(np.diff(run.pressure))) if len(run.pressure) > 1 else 0
        before = run.pressure[max(onset - round(RESTING / run.interval), 0) : onset]
        if len(before):
            rests.append(float(np.median(before)))
    return float(np.median(rests)) if rests else 0.0
