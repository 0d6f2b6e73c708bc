"""The verdict on a car that the vehicle file hardly knows: calibrated, then named what earns its place."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tasks.campaign.campaign import CHANNELS, Campaign
from tasks.identification.decision.answer import (
    ChannelError,
    NamedEffect,
    Verdict,
    find_kind,
)
from tasks.identification.decision.held_out import find_worse_channels, is_lowered
from tasks.identification.decision.log_faults import tell_log_faults
from tasks.identification.decision.missed import compare_with_noise, tell_miss
from tasks.identification.decision.words import tell_present_effects
from tasks.identification.inference.disturbance import Disturbance
from tasks.identification.joint.elimination import drop_at_bounds, refit_numbers
from tasks.identification.joint.fit import JointFit, measure_misfit
from tasks.identification.joint.from_brake import drop_feigned_numbers, make_driver_check
from tasks.identification.joint.held_out import (
    drop_contradicted_rivals,
    find_better_substitute,
    makes_difference,
    predict_held_out,
    summarise_held_out,
)
from tasks.identification.joint.instruments import drop_contradicted_readings
from tasks.identification.joint.names import collect_tolerances, name_numbers, name_rivals
from tasks.identification.joint.numbers import CALIBRATED, JointNumber, choose_numbers
from tasks.identification.joint.selection import select_numbers
from tasks.identification.joint.stops import FITTED, Stop, complete_numbers, make_stop
from tasks.identification.joint.substitutes import Substitute, find_substitutes
from tasks.identification.joint.uncertainty import (
    compute_told_errors,
)
from tasks.identification.joint.words import (
    tell_guessed_lift,
    tell_lumped_resistance,
    tell_rivals,
    tell_unlogged_driver,
    tell_what_was_used,
)
from tasks.identification.rules import DecisionRules
from tasks.surface.state import SurfaceParameters
from tasks.vehicle.effects.table import build_parameter_vector
from tasks.vehicle.parameters import Vehicle


@dataclass(frozen=True, kw_only=True)
class _Prediction:
    """Predictions of the held-out runs by a fit, and their errors.

    Parameters
    ----------
    fitted : the fit
    predicted : readings of each run by the frozen, the re-tuned and the grown model, float64 [3, N, 7]
    error, manoeuvres : errors of the three models, by channel and by figure of a stop
    follows : how far the fit misses the speed of the training runs [m s-1]
    """

    fitted: JointFit
    predicted: tuple[NDArray[np.float64], ...]
    error: dict[str, ChannelError]
    manoeuvres: dict[str, ChannelError]
    follows: float


@dataclass(frozen=True, kw_only=True)
class JointOutcome:
    """A verdict with what it stands on.

    Parameters
    ----------
    verdict : the answer
    calibrated : numbers of the file that the prediction rests on and that are no discovery
    fitted : the fit that it rests on
    errors : float64 [K] standard errors of its numbers
    train, held_out : the runs
    predicted : by held-out run, float64 [3, N, 7] readings of the frozen, the re-tuned and the grown model
    substitutes : what explains nearly as much as a named number
    agreeing : starts that reach the same fit, of all
    """

    verdict: Verdict
    calibrated: tuple[NamedEffect, ...]
    fitted: JointFit
    errors: NDArray[np.float64]
    train: tuple[Stop, ...]
    held_out: tuple[Stop, ...]
    predicted: tuple[NDArray[np.float64], ...]
    substitutes: tuple[Substitute, ...]
    agreeing: tuple[int, int]


def judge_jointly(
    campaign: Campaign,
    vehicle: Vehicle,
    surface: SurfaceParameters,
    numbers: Sequence[JointNumber],
    rules: DecisionRules,
) -> JointOutcome:
    """Calibrate a car on its training runs, take away what does not earn its place, and name what is left.

    Parameters
    ----------
    campaign : measured runs with their split; nothing is fitted to a held-out run but its own start
    vehicle, surface : the model that is judged
    numbers : that a fit may move
    rules : of the decision
    """
    joint = rules.joint
    stops = [make_stop(run, vehicle, surface, campaign.channels, joint) for run in campaign.runs]
    train = tuple(stop for stop in stops if not stop.model.run.held_out)
    held_out = tuple(stop for stop in stops if stop.model.run.held_out)
    shown = choose_numbers(numbers, campaign, [stop.model for stop in train], joint)
    reasons: list[str] = []
    selected, agreeing = select_numbers(campaign, train, held_out, shown, joint, reasons)
    find_feigned = make_driver_check(campaign, vehicle, surface, train, joint)
    selected = drop_feigned_numbers(train, selected, find_feigned, joint, reasons)

    def find_rivals(fitted: JointFit, named: Sequence[JointNumber]) -> list[Substitute]:
        found = find_substitutes(train, fitted, named, shown, joint.rival_gain_share)
        found = drop_contradicted_readings(train, found)
        return [rival for rival in found if rival.name not in {n.name for n in find_feigned(rival.fitted)}]

    as_good = find_rivals(selected, selected.removable_numbers)
    while better := find_better_substitute(held_out, selected, as_good, joint):
        selected = better.fitted
        as_good = find_rivals(selected, selected.removable_numbers)
    retuned = refit_numbers(train, selected, tuple(n for n in selected.numbers if n.group in CALIBRATED))
    retuned = drop_at_bounds(train, retuned, joint, [])

    left = _predict(selected, retuned, train, held_out, rules)
    if not makes_difference(
        selected, left.error, joint, reasons, compare_with_noise(campaign, left.error, left.follows)
    ):
        left = _predict(retuned, retuned, train, held_out, rules)
    tolerances = collect_tolerances(campaign, shown)
    effects, calibrated = name_numbers(left.fitted, tolerances, joint)
    if effects and (worse := find_worse_channels(left.error, joint.worse_limit, speed_decides=False)):
        reasons.append(
            f"the vehicle's file predicts {', '.join(worse)} of the held-out runs better than what was fitted: nothing"
            " is named"
        )
        effects, calibrated = [], []
        left = _predict(retuned, retuned, train, held_out, rules)
    fitted = left.fitted
    # a number that the file claims to know may stand for what the model lacks
    claimed = [name for name, tolerance in tolerances.items() if tolerance < joint.unknown_gain_tolerance]
    named = {e.parameters[0].name for e in effects}
    doubted = [n for n in fitted.numbers if not n.removable and n.name in named.intersection(claimed)]
    as_good = as_good if fitted is selected else []
    as_good += find_rivals(fitted, doubted)
    substitutes = drop_contradicted_rivals(held_out, fitted, as_good, joint)
    # what other physics explains as well is no number of the file alone
    disputed = {substitute.of for substitute in substitutes}
    effects += [e for e in calibrated if e.parameters[0].name in disputed]
    calibrated = [e for e in calibrated if e not in effects]
    rivals = name_rivals(fitted, substitutes, effects, joint)
    reasons += tell_what_was_used(campaign, train, agreeing, joint)
    reasons += tell_rivals(effects, rivals, shown)
    reasons += tell_log_faults(campaign, effects, [rival.name for _, rival in rivals])
    reasons += tell_present_effects(vehicle)
    reasons += tell_lumped_resistance(fitted.numbers, [stop.model for stop in train], joint)
    reasons += tell_guessed_lift(fitted.numbers, fitted.delay_doubt)
    verdict = Verdict(
        verdict=find_kind(effects, rivals),
        effects=tuple(effects),
        rivals=tuple(rivals),
        odds=(),
        tried=(),
        error=left.error,
        manoeuvre_error=left.manoeuvres,
        correlation={},
        session_pulls={},
        noise={name: (0.0, float(fitted.scales[CHANNELS.index(name)])) for name in FITTED if name in campaign.channels},
        disturbance=Disturbance(),
        detectable={},
        campaign=campaign.name,
        content_hash=campaign.content_hash,
        split_hash=campaign.split_hash,
        theta=build_parameter_vector(complete_numbers(fitted.by_name)),
        slots=(),
        experiment=None,
        step_sensitive=(),
        reasons=tuple(reasons),
    )  # fmt: skip
    verdict = tell_miss(verdict, campaign, joint.foreign_misfit, left.follows)
    if verdict.misses:
        verdict = replace(verdict, reasons=(*verdict.reasons, *tell_unlogged_driver(train)))
    return JointOutcome(
        verdict=verdict,
        calibrated=tuple(calibrated) if effects or is_lowered(left.error["speed"]) else (),
        fitted=fitted,
        errors=compute_told_errors(fitted, joint),
        train=train,
        held_out=held_out,
        predicted=left.predicted,
        substitutes=substitutes,
        agreeing=agreeing,
    )


def _predict(
    fitted: JointFit, retuned: JointFit, train: Sequence[Stop], held_out: Sequence[Stop], rules: DecisionRules
) -> _Prediction:
    """Return what a fit makes of the held-out runs, beside the vehicle's file and the re-tuned model."""
    predicted = predict_held_out(held_out, retuned, fitted)
    error, manoeuvres = summarise_held_out(held_out, predicted, rules)
    follows = float(measure_misfit(fitted, train)[CHANNELS.index("speed")])
    return _Prediction(
        fitted=fitted, predicted=predicted, error=error, manoeuvres=manoeuvres, follows=follows
    )
