"""Single effects of a car that its file knows but for its brake gain, and of one whose driver held his speed."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from tasks.campaign.campaign import Campaign
from tasks.identification.decision.disputes import ForeignCarError
from tasks.identification.decision.held_out import compute_held_out_errors
from tasks.identification.decision.missed import compare_with_noise
from tasks.identification.decision.verdict import SearchOutcome, find_missing_effects
from tasks.identification.inference.driver import begin_at_brake, measure_drive
from tasks.identification.inference.forward import prepare_run
from tasks.identification.joint.calibration import calibrate_gain
from tasks.identification.joint.numbers import JointNumber
from tasks.identification.rules import DecisionRules, JointRules
from tasks.surface.state import SurfaceParameters
from tasks.vehicle.effects.library import Effect
from tasks.vehicle.effects.table import EFFECT_TABLE
from tasks.vehicle.parameters import Vehicle


def find_single_effects(
    campaign: Campaign,
    vehicle: Vehicle,
    surface: SurfaceParameters,
    effects: tuple[Effect, ...],
    numbers: Sequence[JointNumber],
    rules: DecisionRules,
) -> SearchOutcome:
    """Look for one effect at a time; where a driver held his speed until he braked, from the brake on.

    That he did is seen beside the file's model, or only beside the resistance that a search finds. Taken for coasting,
    such runs agree about nothing; from the brake on they may.

    Parameters
    ----------
    campaign : measured runs with their split
    vehicle, surface : the model that is judged
    effects : library of candidates
    numbers : that a joint fit may move
    rules : of the decision

    Raises
    ------
    ForeignCarError
        If single effects cannot be told; `judge_jointly` can.
    """
    share = rules.joint.brake_onset_share
    train = [prepare_run(run, vehicle, surface) for run in campaign.train]

    def search(runs: Campaign) -> SearchOutcome:
        gain = calibrate_gain(runs, vehicle, surface, numbers, rules.joint)
        return find_missing_effects(runs, vehicle, surface, effects, rules, hardly_known=gain)

    def measure_drive_beside(outcome: SearchOutcome) -> float:
        found = outcome.end.base
        return measure_drive(train, *found.compose(), share)

    drive = measure_drive(train, np.zeros(len(EFFECT_TABLE)), (), share)
    whole, foreign = None, ForeignCarError()
    if drive <= rules.joint.driven_acceleration:
        try:
            whole = search(campaign)
            drive = measure_drive_beside(whole)
        except ForeignCarError as error:
            foreign = error
    if whole is not None and drive <= rules.joint.driven_acceleration:
        return (
            _prefer_from_brake(whole, campaign, vehicle, surface, search, rules.joint)
            if drive >= 0.0
            else whole
        )
    outcome = search(begin_at_brake(campaign, vehicle, surface, share))
    drive = max(drive, measure_drive_beside(outcome))
    if drive <= rules.joint.driven_acceleration:
        raise foreign
    return replace(
        outcome, verdict=replace(outcome.verdict, reasons=(*outcome.verdict.reasons, tell_driven(drive)))
    )


def _prefer_from_brake(
    whole: SearchOutcome,
    campaign: Campaign,
    vehicle: Vehicle,
    surface: SurfaceParameters,
    search: Callable[[Campaign], SearchOutcome],
    rules: JointRules,
) -> SearchOutcome:
    """Return the verdict from the brake on where whole runs, which lose no speed before it, are missed without it.

    A speed that is held looks like that of a car which nothing holds back, and hides all resistance from a model that
    has none either. A log of throttle or engine would say so.
    """
    logged = any(run.drive_torque is not None for run in campaign.runs)
    if logged or compare_with_noise(campaign, whole.verdict.error) <= rules.foreign_misfit:
        return whole
    try:
        begun = search(begin_at_brake(campaign, vehicle, surface, rules.brake_onset_share))
    except ForeignCarError:
        return whole
    left, _ = compute_held_out_errors(begun.start.evidence, begun.start.base, whole.end.base)
    now, before = begun.verdict.error["speed"].after, left["speed"].after
    if now >= rules.better_prediction_share * before:
        return whole
    reason = (
        f"taken for coasting before the brake, the runs leave an error of {before:.3g} m/s in the speed of held-out"
        f" stops, and from the brake on one of {now:.3g} m/s: each stop on a flat road is judged from its brake on; log"
        " the throttle or the engine's torque, or coast for a second before it"
    )
    return replace(begun, verdict=replace(begun.verdict, reasons=(*begun.verdict.reasons, reason)))


def tell_driven(drive: float) -> str:
    """Return the sentence on runs that begin at their brake.

    Parameters
    ----------
    drive : acceleration before the brake that the model leaves open [m/s2]
    """
    return (
        f"before the brake the car was driven with {drive:.2f} m/s2, and no channel says by what: each stop on a flat"
        " road is judged from its brake on; log the throttle or the engine's torque, or coast for a second before it"
    )
