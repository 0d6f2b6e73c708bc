"""A second look by speed and accelerometer alone, where the runs disagree about the wheels and the body."""

from dataclasses import replace

from tasks.campaign.campaign import Campaign
from tasks.identification.decision.disputes import ForeignCarError, moves_body_alone
from tasks.identification.decision.held_out import compute_held_out_errors, find_worse_channels
from tasks.identification.decision.screening import compute_inflation
from tasks.identification.decision.verdict import Trace
from tasks.identification.decision.words import join_phrases
from tasks.identification.joint.numbers import JointNumber
from tasks.identification.joint.single_effects import find_single_effects
from tasks.identification.rules import DecisionRules
from tasks.surface.state import SurfaceParameters
from tasks.vehicle.effects.library import Effect
from tasks.vehicle.parameters import Vehicle

ALONG_ROAD = ("speed", "longitudinal_acceleration")
"""Channels of the motion along the road, which every effect that changes a stop moves."""


def look_along_road(
    first: Trace,
    campaign: Campaign,
    vehicle: Vehicle,
    surface: SurfaceParameters,
    effects: tuple[Effect, ...],
    numbers: tuple[JointNumber, ...],
    rules: DecisionRules,
) -> Trace:
    """Judge a campaign again by its motion along the road, where all its channels name nothing and disagree.

    A car whose tyres, anti-lock brake or suspension are not the model's moves its wheels and its body as no effect of
    the library does. The runs then disagree about every effect, also about one that the speed alone shows plainly. A
    name of the second look must not predict any channel worse than the first allows, and must not act on the body
    alone: the channels that show it were not asked.

    Parameters
    ----------
    first : verdict by all channels
    campaign : measured runs with their split
    vehicle, surface : the model that is judged
    effects : library of candidates
    numbers : that a joint fit may move
    rules : of the decision

    Returns
    -------
    The second verdict where it names something, with errors of all channels; else the first.
    """
    kept = tuple(name for name in ALONG_ROAD if name in campaign.channels)
    before = compute_inflation(first.start.evidence, first.start.base, None)
    if first.verdict.effects or kept == campaign.channels or before <= rules.disagreement:
        return first
    alone = join_phrases(name.replace("_", " ") for name in kept)
    try:
        second = find_single_effects(
            replace(campaign, channels=kept), vehicle, surface, effects, numbers, rules
        )
    except ForeignCarError:
        return first
    named = second.end.base.parts
    if not named or any(moves_body_alone(part) for part in named):
        return first
    error, manoeuvres = compute_held_out_errors(first.start.evidence, first.start.base, second.end.base)
    names = join_phrases(effect.name for effect in second.verdict.effects)
    if worse := find_worse_channels(error, rules.worse_limit):
        return _add_reason(
            first,
            f"by {alone} alone {names} would be named, but it predicts {join_phrases(worse)} of the held-out runs worse"
            " than the frozen model: not named",
        )
    return _add_reason(
        replace(second, verdict=replace(second.verdict, error=error, manoeuvre_error=manoeuvres)),
        f"all channels together name nothing, because the runs disagree about the wheels and the body by a factor of"
        f" {before:.1f} (noise alone gives 1): this verdict is by {alone} alone; the errors are of all channels",
    )


def _add_reason(trace: Trace, reason: str) -> Trace:
    return replace(trace, verdict=replace(trace.verdict, reasons=(reason, *trace.verdict.reasons)))
