"""Two searches for what a model lacks: which of them judges a campaign, and where both do, the better prediction."""

from collections.abc import Sequence
from dataclasses import replace
from math import inf

import numpy as np
from numpy.typing import NDArray

from tasks.campaign.campaign import Campaign
from tasks.identification.decision.disputes import ForeignCarError
from tasks.identification.decision.missed import compare_with_noise, tell_miss
from tasks.identification.decision.verdict import SearchOutcome
from tasks.identification.decision.words import join_phrases
from tasks.identification.inference.driver import LIFT, SPEED, find_brake_onset
from tasks.identification.inference.forward import RunModel
from tasks.identification.joint.calibration import needs_joint_fit
from tasks.identification.joint.numbers import JointNumber
from tasks.identification.joint.second_look import find_effects_in_two_looks
from tasks.identification.joint.verdict import JointOutcome, judge_jointly
from tasks.identification.rules import DecisionRules
from tasks.surface.state import SurfaceParameters
from tasks.vehicle.effects.library import Effect
from tasks.vehicle.parameters import Vehicle


def judge_by_two_searches(
    campaign: Campaign,
    vehicle: Vehicle,
    surface: SurfaceParameters,
    effects: tuple[Effect, ...],
    numbers: tuple[JointNumber, ...],
    rules: DecisionRules,
) -> SearchOutcome | JointOutcome:
    """Look for one effect at a time where the car is the model's but for its brake gain; else fit all numbers at once.

    Where the first misses the held-out stops and names nothing, or names something beside numbers of the session that
    are far off their tolerances, or names something and misses them by much more, both judge, and the better prediction
    counts. Numbers of the vehicle's file alone are no discovery then: the whole library was held against the runs, and
    what it does not hold may stand behind them.

    Parameters
    ----------
    campaign : measured runs with their split
    vehicle, surface : the model that is judged
    effects : library of candidates of the search for one effect at a time
    numbers : that a joint fit may move
    rules : of the decision
    """
    joint = rules.joint

    def fit_all(why: str = "", *, names_numbers: bool = True) -> JointOutcome:
        return judge_jointly(
            campaign, vehicle, surface, numbers, rules, disagreement=why, names_numbers=names_numbers
        )

    if needs_joint_fit(campaign, joint):
        return fit_all()
    try:
        found = find_effects_in_two_looks(campaign, vehicle, surface, effects, numbers, rules)
    except ForeignCarError as error:
        return fit_all(str(error))
    single = replace(found, verdict=tell_miss(found.verdict, campaign, joint.foreign_misfit))
    names, left = [effect.name for effect in single.verdict.effects], single.verdict.error
    pulled = any(abs(after) > rules.retune_pull for _, after in single.verdict.session_pulls.values())
    followed = joint.questioned_misfit if names and not pulled else joint.foreign_misfit
    if compare_with_noise(campaign, left) <= followed:
        return single
    fitted = fit_all(names_numbers=False)
    share, judged = joint.brake_onset_share, single.start.evidence.held_out
    before = measure_error_from_brake([run.model for run in judged], single.predict_readings(judged), share)
    now = measure_error_from_brake(
        [stop.model for stop in fitted.held_out], [y[-1] for y in fitted.predicted], share
    )
    if now >= joint.better_prediction_share * before:
        reason = (
            f"a joint fit of all numbers leaves an error of {now:.3g} m/s in the speed of these stops, and counts only"
            f" below {joint.better_prediction_share:.0%} of {before:.3g} m/s"
        )
        return replace(single, verdict=replace(single.verdict, reasons=(*single.verdict.reasons, reason)))
    found_by_one = join_phrases(names or ["nothing"])
    reason = (
        f"a search of single effects names {found_by_one} and leaves an error of {before:.3g} m/s in the speed of"
        f" held-out stops, and a joint fit of all numbers one of {now:.3g} m/s, from the brake on"
    )
    return replace(fitted, verdict=replace(fitted.verdict, reasons=(reason, *fitted.verdict.reasons)))


def measure_error_from_brake(
    models: Sequence[RunModel], readings: Sequence[NDArray[np.float64]], share: float
) -> float:
    """Return the error of the speed of runs from the brake on; infinite without a sample there [m/s].

    A joint fit fits the beginning of each run, and a single search may judge a stop from its brake on alone: what both
    predict is the stop.

    Parameters
    ----------
    models : the runs
    readings : predicted, float64 [N, 7] each
    share : of a run's largest pressure from which its driver brakes [1]
    """
    square = []
    for model, predicted in zip(models, readings, strict=True):
        onset = find_brake_onset(model, share)
        begin = max(onset - round(0.5 * LIFT / model.run.interval), 0) if onset < model.samples else 0
        rows = model.find_samples(SPEED)
        rows = rows[rows >= begin]
        if rows.size:
            square.append(float(np.mean((model.measured[rows, SPEED] - predicted[rows, SPEED]) ** 2)))
    return float(np.sqrt(np.mean(square))) if square else inf
