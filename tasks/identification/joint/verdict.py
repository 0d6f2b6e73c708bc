"""The verdict on a car that the vehicle file hardly knows: calibrated, then named what earns its place."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tasks.campaign.campaign import CHANNELS, SESSION, Campaign
from tasks.identification.decision.answer import (
    ChannelError,
    NamedEffect,
    Parameter,
    Verdict,
    find_kind,
    is_within_tolerance,
    make_estimate,
)
from tasks.identification.decision.held_out import find_worse_channels, is_lowered
from tasks.identification.decision.log_faults import tell_log_faults
from tasks.identification.decision.missed import compare_with_noise, tell_miss
from tasks.identification.inference.disturbance import Disturbance
from tasks.identification.joint.calibration import fit_first_numbers, is_gain_unknown
from tasks.identification.joint.elimination import (
    Substitute,
    add_certain_numbers,
    drop_at_bounds,
    eliminate_uncertain_numbers,
    find_substitutes,
    refit_numbers,
    vary_grip,
)
from tasks.identification.joint.fit import (
    JointFit,
    choose_misfit_scales,
    fit_jointly,
    measure_misfit,
    suggest_starts,
)
from tasks.identification.joint.held_out import (
    drop_contradicted_rivals,
    drop_what_predicts_worse,
    makes_difference,
    predict_held_out,
    summarise_held_out,
)
from tasks.identification.joint.instruments import (
    drop_contradicted_instruments,
    drop_contradicted_readings,
)
from tasks.identification.joint.numbers import (
    CALIBRATED,
    FRICTION,
    GAIN,
    JointNumber,
    choose_numbers,
    free_numbers,
)
from tasks.identification.joint.stops import FITTED, Stop, complete_numbers, make_stop
from tasks.identification.joint.uncertainty import (
    compute_interval_reach,
    compute_standard_errors,
    compute_told_errors,
)
from tasks.identification.joint.words import (
    tell_guessed_lift,
    tell_lumped_resistance,
    tell_rivals,
    tell_what_was_used,
)
from tasks.identification.rules import DecisionRules, JointRules
from tasks.surface.state import SurfaceParameters
from tasks.vehicle.effects.table import PARAMETERS, build_parameter_vector
from tasks.vehicle.parameters import Vehicle

Predicted = tuple[NDArray[np.float64], ...]
"""Readings of each held-out run by the frozen, the re-tuned and the grown model, float64 [3, N, 7]."""
Errors = dict[str, ChannelError]
"""Errors of the three models, by channel or figure."""
BENDS_RESISTANCE = "pad_speed"
"""Pad friction that depends on speed: with it a constant resistance may stand for air drag, and air drag for it."""


@dataclass(frozen=True, kw_only=True)
class JointTrace:
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
    *,
    disagreement: str = "",
    names_numbers: bool = True,
) -> JointTrace:
    """Calibrate a car on its training runs, take away what does not earn its place, and name what is left.

    Parameters
    ----------
    campaign : measured runs with their split; nothing is fitted to a held-out run but its own start
    vehicle, surface : the model that is judged
    numbers : that a fit may move
    rules : of the decision
    disagreement : why single effects could not be told; empty where they were not looked for
    names_numbers : whether numbers of the vehicle's file may be named without any other name; else they are calibrated
    """
    joint = rules.joint
    stops = [make_stop(run, vehicle, surface, campaign.channels, joint) for run in campaign.runs]
    train = tuple(stop for stop in stops if not stop.model.run.held_out)
    held_out = tuple(stop for stop in stops if stop.model.run.held_out)
    shown = choose_numbers(numbers, campaign, [stop.model for stop in train], joint)
    starts = suggest_starts(train) if is_gain_unknown(campaign, joint) else [{}]
    everything = _fit_everything(train, starts, free_numbers(shown, [stop.model for stop in train], joint))
    settled, agreeing = _settle(train, eliminate_uncertain_numbers(train, everything, joint), starts, joint)
    # at a better fit a number may be no longer certain
    reasons = [disagreement] if disagreement else []
    fitted = eliminate_uncertain_numbers(train, settled, joint)
    fitted = add_certain_numbers(train, fitted, everything.numbers, joint)
    fitted = drop_contradicted_instruments(train, fitted, joint, reasons)
    fitted = drop_at_bounds(train, fitted, joint, reasons)
    fitted = drop_what_predicts_worse(train, held_out, fitted, joint, reasons)
    fitted = drop_at_bounds(train, fitted, joint, reasons)
    retuned = refit_numbers(train, fitted, tuple(n for n in fitted.numbers if n.group in CALIBRATED))
    retuned = drop_at_bounds(train, retuned, joint, [])

    def predict_with(grown: JointFit) -> tuple[Predicted, Errors, Errors]:
        predicted = predict_held_out(held_out, retuned, grown)
        return predicted, *summarise_held_out(held_out, predicted, rules)

    def measure_follows(fit: JointFit) -> float:
        return float(measure_misfit(fit, train)[CHANNELS.index("speed")])

    predicted, error, manoeuvres = predict_with(fitted)
    over_noise = compare_with_noise(campaign, error, measure_follows(fitted))
    if not makes_difference(fitted, error, joint, reasons, over_noise):
        fitted = retuned
        predicted, error, manoeuvres = predict_with(fitted)
    tolerances = _tolerances(campaign, shown)
    named = _name_effects(fitted, joint)
    calibrated = tuple(e for e in named if is_within_tolerance(e, tolerances, joint.wrong_number_tolerances))
    effects = [e for e in named if e not in calibrated]
    if effects and (worse := find_worse_channels(error, rules.worse_limit, speed_decides=False)):
        reasons.append(
            f"the vehicle's file predicts {', '.join(worse)} of the held-out runs better than what was fitted: nothing"
            " is named"
        )
        effects, calibrated, fitted = [], (), retuned
        predicted, error, manoeuvres = predict_with(fitted)
    # a number that the file claims to know may stand for what the model lacks
    claimed = [name for name, tolerance in tolerances.items() if tolerance < joint.unknown_gain_tolerance]
    doubted = {e.parameters[0].name for e in effects} & set(claimed)
    as_good = find_substitutes(train, fitted, shown, rules.rival_gain_share, doubted)
    as_good = drop_contradicted_readings(train, as_good)
    substitutes = drop_contradicted_rivals(held_out, fitted, as_good, joint)
    # what other physics explains as well is no number of the file alone
    disputed = {substitute.of for substitute in substitutes}
    effects += [e for e in calibrated if e.parameters[0].name in disputed]
    calibrated = tuple(e for e in calibrated if e not in effects)
    if not names_numbers and all(e.effect_class == "retune" for e in effects):
        reasons += [
            f"{effect.name} is told as a number of the vehicle's own: other physics may stand behind it"
            for effect in effects
        ]
        effects, calibrated, substitutes = [], (*effects, *calibrated), ()
    rivals = _name_rivals(fitted, substitutes, effects, joint)
    kind = find_kind(effects, rivals)
    reasons += tell_what_was_used(campaign, train, agreeing, joint)
    reasons += tell_rivals(effects, rivals, shown)
    reasons += tell_log_faults(campaign, effects, [rival.name for _, rival in rivals])
    reasons += tell_lumped_resistance(fitted.numbers, [stop.model for stop in train], joint)
    reasons += tell_guessed_lift(fitted.numbers, fitted.delay_doubt)
    verdict = Verdict(
        verdict=kind,
        effects=tuple(effects),
        rivals=tuple(rivals),
        tried=(),
        error=error,
        manoeuvre_error=manoeuvres,
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
        disagreement=disagreement,
    )  # fmt: skip
    verdict = tell_miss(verdict, campaign, joint.foreign_misfit, measure_follows(fitted))
    return JointTrace(
        verdict=verdict,
        calibrated=calibrated if effects or is_lowered(error["speed"]) else (),
        fitted=fitted,
        errors=compute_told_errors(fitted, joint),
        train=train,
        held_out=held_out,
        predicted=predicted,
        substitutes=substitutes,
        agreeing=agreeing,
    )


def _fit_everything(
    train: Sequence[Stop], starts: Sequence[Mapping[str, float]], sets: Sequence[tuple[JointNumber, ...]]
) -> JointFit:
    """Return the fit of every number of the set that explains most: from the best of several starts of the first few.

    Sets are compared without `BENDS_RESISTANCE`, which makes a resistance of one shape look like that of another.
    """
    best = fit_first_numbers(train, {n.name: n for numbers in sets for n in numbers}.values(), starts)
    scales = choose_misfit_scales(best, train)

    def fit_set(numbers: Sequence[JointNumber], start: JointFit) -> JointFit:
        return fit_jointly(train, tuple(numbers), [start.by_name], scales=scales, offsets=start.offsets)[0]

    if len(sets) == 1:
        return fit_set(sets[0], best)
    plain = [fit_set([n for n in numbers if n.name != BENDS_RESISTANCE], best) for numbers in sets]
    place = min(range(len(sets)), key=lambda i: plain[i].cost)
    return fit_set(sets[place], plain[place])


def _settle(
    train: Sequence[Stop], fitted: JointFit, starts: Sequence[Mapping[str, float]], rules: JointRules
) -> tuple[JointFit, tuple[int, int]]:
    """Return the best fit of the numbers left, from several starts too, and how many of these reach it."""
    grips = vary_grip(fitted) or [{}]
    begins = [fitted.by_name, *({**starts[0], **grip} for grip in grips), *starts[1:]]
    fits = fit_jointly(train, fitted.numbers, begins, scales=fitted.scales)
    # runs whose own numbers start anew may end in a worse minimum than where they are
    best = min((fitted, *fits), key=lambda fit: fit.cost)
    near = rules.same_fit_errors * compute_standard_errors(best, rules)
    same = sum(bool(np.all(np.abs(f.values - best.values) < near)) for f in fits)
    return best, (same, len(fits))


def _name_effects(fitted: JointFit, rules: JointRules) -> list[NamedEffect]:
    """Return what is named, new physics first."""
    # what every car needs anew is told whatever its size: the prediction rests on it
    named = [*fitted.removable_numbers]
    named += [n for n in fitted.numbers if not n.removable and not n.is_at_bound(fitted.by_name[n.name])]
    order = {"effect": 0, "sensor": 1, "retune": 2}
    return sorted((_named_effect(fitted, n, rules) for n in named), key=lambda e: order[e.effect_class])


def _name_rivals(
    fitted: JointFit, substitutes: Sequence[Substitute], effects: Sequence[NamedEffect], rules: JointRules
) -> list[tuple[str, NamedEffect]]:
    """Return the rivals of what is named, each with the name that it stands in for."""
    effect_of = {n.name: n.effect.name for n in fitted.numbers}
    rivals = []
    for other in substitutes:
        number = next(n for n in other.fitted.numbers if n.name == other.name)
        rivals.append((effect_of[other.of], _named_effect(other.fitted, number, rules)))
    grips = [_named_effect(fitted, n, rules) for n in fitted.numbers if n.group == FRICTION]
    curve = {n.effect.name for n in fitted.numbers if n.group == "curve"}
    # tyres at their limit bend the brake's curve too
    return rivals + [(effect.name, grip) for effect in effects if effect.name in curve for grip in grips]


def _named_effect(fitted: JointFit, number: JointNumber, rules: JointRules) -> NamedEffect:
    place = fitted.numbers.index(number)
    value, error = float(fitted.values[place]), float(compute_told_errors(fitted, rules)[place])
    reach = float(compute_interval_reach(fitted, rules)[place])
    estimate = Parameter(
        name=number.name, value=value, ci_low=max(value - reach, number.lower),
        ci_high=min(value + reach, number.upper), lower=number.lower, upper=number.upper,
        unit=PARAMETERS[number.name].unit,
    )  # fmt: skip
    return make_estimate(number.effect, estimate, error)


def _tolerances(campaign: Campaign, shown: Sequence[JointNumber]) -> dict[str, float]:
    """Return the declared tolerance of each number that re-tuning moves."""
    session = dict(zip(SESSION, campaign.tolerances.session, strict=True))
    frictions = [n.name for n in shown if n.group == FRICTION]
    return {name: session[name] for name in (GAIN, "wheel_radius", "mass", "slope")} | dict.fromkeys(
        frictions, campaign.tolerances.friction
    )
