"""Runs that no fit has seen: predicted from what precedes the brake, to judge numbers and to report errors."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tasks.campaign.campaign import CHANNEL_UNITS, CHANNELS
from tasks.campaign.manoeuvres import MANOEUVRE_UNITS, measure_manoeuvre_errors
from tasks.identification.decision.answer import ChannelError
from tasks.identification.decision.held_out import is_noticed, summarise_errors
from tasks.identification.decision.words import join_phrases
from tasks.identification.joint.elimination import eliminate_uncertain_numbers, refit_numbers
from tasks.identification.joint.fit import JointFit, lead_offsets
from tasks.identification.joint.stops import Stop, predict_stop
from tasks.identification.joint.substitutes import Substitute
from tasks.identification.joint.uncertainty import measure_certainty
from tasks.identification.rules import DecisionRules, JointRules


def drop_what_predicts_worse(
    train: Sequence[Stop], held_out: Sequence[Stop], fitted: JointFit, rules: JointRules, reasons: list[str]
) -> JointFit:
    """Return the fit without the numbers whose absence predicts the speed of held-out runs better, and say so.

    A fit that prediction contradicts holds what its few runs had in common, and no property of the car.

    Parameters
    ----------
    train, held_out : the runs
    fitted : after elimination
    rules : of the joint fit
    reasons : is added to
    """
    there = _held_out_misfit(held_out, fitted)
    trials = []
    for number in (n for n in fitted.numbers if n.may_go):
        without = refit_numbers(train, fitted, tuple(n for n in fitted.numbers if n.name != number.name))
        gone = _held_out_misfit(held_out, without)
        # a number earns its name by what it does to any channel, and not against the speed
        better = gone[0] < rules.better_prediction_share * there[0]
        if better or (number.removable and gone[1] < rules.equal_prediction_share * there[1]):
            trials.append((gone, number, without))
    if not trials:
        return fitted
    gone, number, without = min(trials, key=lambda trial: trial[0][0] / there[0] + trial[0][1] / there[1])
    reasons.append(
        f"the training runs suggest that {number.say(fitted.by_name[number.name])}, but the held-out runs are predicted"
        f" as well or better without that (speed {gone[0]:.3g} against {there[0]:.3g} m/s, all channels {gone[1]:.3g}"
        f" against {there[1]:.3g}): not named"
    )
    return drop_what_predicts_worse(
        train, held_out, eliminate_uncertain_numbers(train, without, rules), rules, reasons
    )


def makes_difference(
    fitted: JointFit,
    error: Mapping[str, ChannelError],
    rules: JointRules,
    reasons: list[str],
    over_noise: float,
) -> bool:
    """Whether what is named lowers the error of some channel of the held-out runs beside re-tuning; else say so.

    The equations of another car differ a little everywhere, and some number takes up a part of that. Where stops are
    missed with it, too, the car lacks more, and what takes up little of that is most often something else.

    Parameters
    ----------
    fitted : with what is named
    error : of the held-out runs, by channel
    rules : of the joint fit
    reasons : is added to
    over_noise : error of the speed over its noise [1]
    """
    named = [n.say(fitted.by_name[n.name]) for n in fitted.numbers if n.removable]
    retuned = {name: replace(e, after=e.retuned) for name, e in error.items()}
    share = rules.missed_share if over_noise > rules.foreign_misfit else rules.noticed_share
    if not named or is_noticed(error, retuned, share):
        return True
    reasons.append(
        f"the training runs suggest that {join_phrases(named)}, but beside re-tuning that makes no difference of"
        f" {1.0 - share:.0%} to the error of any channel of the held-out runs: not named"
    )
    return False


def drop_contradicted_rivals(
    held_out: Sequence[Stop], fitted: JointFit, rivals: Sequence[Substitute], rules: JointRules
) -> tuple[Substitute, ...]:
    """Return the rivals without those that predict the speed of held-out runs much worse than what they stand in for.

    Parameters
    ----------
    held_out : the runs
    fitted : with what is named
    rivals : what explains the training runs nearly as well
    rules : of the joint fit
    """
    named = _held_out_misfit(held_out, fitted)[0]
    return tuple(
        rival
        for rival in rivals
        if named >= rules.better_prediction_share * _held_out_misfit(held_out, rival.fitted)[0]
    )


def find_better_substitute(
    held_out: Sequence[Stop], fitted: JointFit, rivals: Sequence[Substitute], rules: JointRules
) -> Substitute | None:
    """Return the rival that explains most, if that is more than the named number does; None without such a one.

    It must be certain itself, and predict the speed of the held-out runs no worse: elimination takes away one of two
    that stand in for each other while both are free, and may keep the wrong one.

    Parameters
    ----------
    held_out : the runs
    fitted : with what is named
    rivals : what explains the training runs nearly as well
    rules : of the joint fit
    """
    best = min(rivals, key=lambda rival: rival.fitted.cost, default=None)
    if best is None or best.fitted.cost >= fitted.cost:
        return None
    place = [number.name for number in best.fitted.numbers].index(best.name)
    number, value = best.fitted.numbers[place], best.fitted.by_name[best.name]
    certain = measure_certainty(best.fitted, rules)[place] >= 1.0 and not number.is_at_bound(value)
    if not certain or _held_out_misfit(held_out, best.fitted)[0] > _held_out_misfit(held_out, fitted)[0]:
        return None
    return best


def _held_out_misfit(held_out: Sequence[Stop], fitted: JointFit) -> tuple[float, float]:
    """Return the RMSE on held-out runs of speed [m/s], and of all channels over their scales [1], each run alike."""
    place = CHANNELS.index("speed")
    speeds, channels = [], []
    for stop in held_out:
        y = predict_stop(stop, fitted.by_name, lead_offsets(stop, fitted.by_name, fitted.scales))
        left = stop.model.compute_square_error(y)
        speeds.append(float(left[place]))
        channels.append(float(np.mean(left[stop.channels] / fitted.scales[stop.channels] ** 2)))
    return float(np.sqrt(np.mean(speeds))), float(np.sqrt(np.mean(channels)))


def predict_held_out(
    held_out: Sequence[Stop], retuned: JointFit, fitted: JointFit
) -> tuple[NDArray[np.float64], ...]:
    """Return the readings of each held-out run by the frozen, the re-tuned and the grown model, float64 [3, N, 7].

    Parameters
    ----------
    held_out : the runs
    retuned, fitted : the fits
    """
    models: tuple[Mapping[str, float], ...] = ({}, retuned.by_name, fitted.by_name)
    return tuple(
        np.array([predict_stop(stop, m, lead_offsets(stop, m, fitted.scales)) for m in models])
        for stop in held_out
    )


def summarise_held_out(
    held_out: Sequence[Stop], predicted: Sequence[NDArray[np.float64]], rules: DecisionRules
) -> tuple[dict[str, ChannelError], dict[str, ChannelError]]:
    """Return errors by channel, and of the stopping distance where runs brake.

    Parameters
    ----------
    held_out : the runs
    predicted : by `predict_held_out`
    rules : number of resamples
    """
    names = [stop.model.run.name for stop in held_out]
    places = held_out[0].channels
    square = np.array(
        [stop.model.compute_square_error(y)[:, places] for stop, y in zip(held_out, predicted, strict=True)]
    )
    units = {CHANNELS[c]: CHANNEL_UNITS[c] for c in places}
    channels = summarise_errors(square, names, units, rules.error_resamples)
    braked, distances = [], []
    for stop, y in zip(held_out, predicted, strict=True):
        figures = measure_manoeuvre_errors(
            stop.model.measured, y, stop.model.pressure, stop.model.run.interval
        )
        if figures is not None:
            braked.append(stop.model.run.name)
            distances.append(figures[:, :1] ** 2)
    if not braked:
        return channels, {}
    unit = {"stopping_distance": MANOEUVRE_UNITS["stopping_distance"]}
    return channels, summarise_errors(np.array(distances), braked, unit, rules.error_resamples)
