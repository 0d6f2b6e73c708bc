"""Single effects by all channels, and by speed and accelerometer alone where the runs disagree with the model."""

from collections.abc import Callable
from dataclasses import replace

from tasks.campaign.campaign import Campaign
from tasks.identification.decision.disputes import ForeignCarError, moves_body_alone
from tasks.identification.decision.held_out import (
    compute_held_out_errors,
    find_missed_channels,
    find_worse_channels,
    is_better_retuned,
)
from tasks.identification.decision.screening import compute_inflation
from tasks.identification.decision.verdict import SearchOutcome
from tasks.identification.decision.words import join_phrases
from tasks.identification.inference.fit import fit_hypotheses
from tasks.identification.inference.hypothesis import moves_speed
from tasks.identification.inference.linearisation import observe_channels
from tasks.identification.joint.numbers import JointNumber
from tasks.identification.joint.single_effects import find_single_effects
from tasks.identification.rules import DecisionRules
from tasks.surface.state import SurfaceParameters
from tasks.vehicle.effects.library import Effect
from tasks.vehicle.parameters import Vehicle

ALONG_ROAD = ("speed", "longitudinal_acceleration")
"""Channels of the motion along the road, which every effect that changes a stop moves."""
ITERATIONS = 6
"""Steps of the fit without effects."""


def find_effects_in_two_looks(
    campaign: Campaign,
    vehicle: Vehicle,
    surface: SurfaceParameters,
    effects: tuple[Effect, ...],
    numbers: tuple[JointNumber, ...],
    rules: DecisionRules,
) -> SearchOutcome:
    """Look for single effects by all channels; where they name nothing and the runs disagree, along the road alone.

    A car whose tyres, anti-lock brake or suspension are not the model's moves its wheels and its body as no effect of
    the library does. The runs then disagree about every effect, also about one that the speed alone shows plainly.
    Whether runs disagree is told from four training runs on.

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
        If single effects can be told by neither; `judge_jointly` can.
    """

    def search(runs: Campaign) -> SearchOutcome:
        return find_single_effects(runs, vehicle, surface, effects, numbers, rules)

    try:
        first = search(campaign)
    except ForeignCarError as error:
        second = _look_along_road(campaign, search, rules, str(error))
        if second is None:
            raise
        return second
    if first.verdict.effects:
        return first
    disagreement = compute_inflation(first.start.evidence, first.start.base, None)
    if disagreement > rules.disagreement:
        why = f"the runs disagree with the model by a factor of {disagreement:.1f} (noise alone gives 1)"
        if second := _look_along_road(campaign, search, rules, why):
            return second
    return first


def _look_along_road(
    campaign: Campaign, search: Callable[[Campaign], SearchOutcome], rules: DecisionRules, why: str
) -> SearchOutcome | None:
    """Return the verdict by speed and accelerometer, with errors of all channels; None if it names nothing that holds.

    A name must not act on the body alone, because the channels that show that were not asked, and must not predict
    the held-out runs worse than the vehicle file, or much worse than the re-tuned model, with all channels counted. A
    brake gain that is wrong and nothing else is left to the first look or the joint fit.
    """
    kept = tuple(name for name in ALONG_ROAD if name in campaign.channels)
    if kept == campaign.channels:
        return None
    try:
        second = search(replace(campaign, channels=kept))
    except ForeignCarError:
        return None
    found = second.end.base
    if not found.parts or any(moves_body_alone(part) for part in found.parts):
        return None
    whole = observe_channels(second.start.evidence, campaign, second.start.base)
    null = fit_hypotheses(
        whole.train, (), whole.session_sigma, session=second.start.base.session, iterations=ITERATIONS
    )
    error, manoeuvres = compute_held_out_errors(whole, null, found)
    moved = any(moves_speed(part.effect_class, part.variable) for part in found.parts)
    if (
        find_worse_channels(error, rules.worse_limit, speed_decides=moved)
        or find_missed_channels(error, rules.retuned_limit)
        or is_better_retuned(error, rules)
    ):
        return None
    alone = join_phrases(name.replace("_", " ") for name in kept)
    reason = (
        f"all channels together name nothing, and {why}; this verdict is by {alone} alone, its errors by all"
    )
    verdict = replace(
        second.verdict, error=error, manoeuvre_error=manoeuvres, reasons=(reason, *second.verdict.reasons)
    )
    return replace(second, verdict=verdict)
