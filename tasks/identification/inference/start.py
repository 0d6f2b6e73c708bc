"""The brake's gain before anything is linearised, for a car whose file hardly knows it."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tasks.campaign.campaign import CHANNELS, FILE_NUMBERS, Campaign, Tolerances
from tasks.campaign.channels import BRAKE_SIGNALS
from tasks.identification.inference.driver import FEWEST_SAMPLES, find_brake_onset
from tasks.identification.inference.forward import RunModel, prepare_run
from tasks.identification.inference.tyre_limit import reaches_limit, saturates_tyres
from tasks.identification.rules import DecisionRules
from tasks.surface.state import SurfaceParameters
from tasks.vehicle.effects.table import PARAMETERS
from tasks.vehicle.parameters import Vehicle

GAIN = FILE_NUMBERS.index("pressure_gain")
"""Place of the brake's gain among the numbers of the session."""
GRIP = FILE_NUMBERS[-1]
"""Name of the grip that all runs share."""


def widen_tolerances(
    campaign: Campaign, vehicle: Vehicle, surface: SurfaceParameters, rules: DecisionRules
) -> Campaign:
    """Return a campaign with the tolerances of a car that its file hardly knows, if it is one.

    A signal that is no pressure may stand for any torque. A file that hardly knows its brakes knows no tyres: their
    grip is free where a training run slows down harder than they allow, or is at their limit with the weakest brakes.

    Parameters
    ----------
    campaign : measured runs
    vehicle, surface : the model as it stands
    rules : those tolerances
    """
    known = campaign.tolerances
    if BRAKE_SIGNALS.get(campaign.brake_signal, 1.0) != 1.0:
        known = known.with_session({FILE_NUMBERS[GAIN]: rules.command_tolerance})
    if known.session[GAIN] >= rules.hardly_known_tolerance:
        weakest = max(-known.session[GAIN], PARAMETERS[FILE_NUMBERS[GAIN]].lower)
        models = [prepare_run(run, vehicle, surface) for run in campaign.train]
        if any(saturates_tyres(m, rules) or reaches_limit(m, weakest, rules) for m in models):
            known = replace(known, grip=rules.hardly_known_grip)
    return replace(campaign, tolerances=known)


def is_grip_free(campaign: Campaign) -> bool:
    """Return whether the grip of all runs is one of the numbers that a file hardly knows.

    Parameters
    ----------
    campaign : measured runs with their tolerances
    """
    return campaign.tolerances.grip > Tolerances.grip


def estimate_session(
    campaign: Campaign, models: Sequence[RunModel], rules: DecisionRules
) -> NDArray[np.float64]:
    """Return where a fit of the session begins, float64 [8]: at 0, but for a gain that is hardly known.

    That is taken from what the runs' speed loses for the impulse of their pressure.

    Parameters
    ----------
    campaign : measured runs with their tolerances
    models : training runs
    rules : from which tolerance on a gain is hardly known, and when a driver brakes
    """
    start = np.zeros(len(FILE_NUMBERS))
    ratios = []
    for model in models:
        onset, vehicle = find_brake_onset(model, rules.brake_onset_share), model.vehicle
        if onset + FEWEST_SAMPLES >= model.samples:
            continue
        speed = model.measured[onset:, CHANNELS.index("speed")]
        impulse = float(model.pressure[onset:].sum()) * model.run.interval
        expected = vehicle.brake_gain / (vehicle.wheel_radius * vehicle.mass) * impulse
        ratios.append(float(speed[0] - speed[-1]) / max(expected, 1e-9))
    if ratios and campaign.tolerances.session[GAIN] >= rules.hardly_known_tolerance:
        start[GAIN] = float(np.median(ratios)) - 1.0
    return start
