"""Objections of the held-out runs to a name that the training runs bought."""

from collections.abc import Mapping

import numpy as np

from tasks.campaign.campaign import SESSION
from tasks.identification.decision.answer import ChannelError
from tasks.identification.decision.held_out import (
    compare_with_retuned,
    compute_held_out_errors,
    find_missed_channels,
    find_worse_channels,
    is_better_retuned,
    is_noticed,
)
from tasks.identification.decision.search import SearchState
from tasks.identification.inference.hypothesis import moves_speed


def object_to_last(
    found: SearchState, start: SearchState, error: Mapping[str, ChannelError], least: float | None
) -> str | None:
    """Return why held-out runs contradict what was named last; None if they do not.

    The marginal likelihood can buy a fit with disturbances; prediction of unseen runs cannot be bought. A number that
    re-tuning does not move must do better than the numbers that it moves, and be off by more than such a number is
    known to: a tyre that is 1 % stiffer takes up the slip that another anti-lock brake holds.

    Parameters
    ----------
    found, start : what is named, and the model as it stands
    error : of what is named, by channel
    least : share of the error of some channel that a name must leave at most; None takes that of forms, for forms
    """
    rules, last = found.evidence.rules, found.rounds[-1]
    named = [r.accepted.hypothesis for r in found.rounds]
    moved = any(moves_speed(h.effect_class, h.variable) for h in named)
    beside, hypothesis = compare_with_retuned(error), last.accepted.hypothesis
    number = hypothesis.effect_class == "retune" and not set(hypothesis.names) <= set(SESSION)
    if missed := find_missed_channels(error, rules.retuned_limit):
        ratio = max(error[name].after / error[name].retuned for name in missed)
        return (
            f"{', '.join(h.name for h in named)} would fit, but predicts {', '.join(missed)} of the held-out runs with"
            f" {ratio:.3g} times the error of re-tuning alone: not named"
        )
    if is_better_retuned(error, rules) or (number and beside >= 1.0):
        return (
            f"{', '.join(h.name for h in named)} would fit, but re-tuning alone predicts the held-out runs better, with"
            f" {1.0 / beside:.3g} of the error: not named"
        )
    off = float(np.max(np.abs(found.base.values[-len(hypothesis.names) :])))
    if number and off < rules.negligible_share:
        return (
            f"{hypothesis.name} would fit with {off:.2g}, which is less than such a number is known to"
            f" ({rules.negligible_share:g}): not named"
        )
    worse = find_worse_channels(error, rules.worse_limit, speed_decides=moved)
    if worse:
        return (
            f"{', '.join(h.name for h in named)} would fit, but predicts"
            f" {', '.join(worse)} of the held-out runs worse than the frozen model: not named"
        )
    if least is not None or last.accepted.hypothesis.effect_class == "form":
        share = rules.noticed_share if least is None else least
        without, _ = compute_held_out_errors(start.evidence, start.base, last.base)
        if not is_noticed(error, without, share):
            return (
                f"{last.accepted.hypothesis.name} would fit, but makes no difference of"
                f" {1.0 - share:.0%} to the error of any channel of the held-out runs: not named"
            )
    return None
