"""The verdict: what the training runs tell, in odds, and what that does to runs that no fit and no choice has read."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tasks.campaign.campaign import CHANNELS, FILE_NUMBERS, Campaign
from tasks.identification.decision.agreement import measure_disagreement
from tasks.identification.decision.answer import NamedEffect, OpenOdds, Verdict, find_kind
from tasks.identification.decision.comparison import find_odds
from tasks.identification.decision.correlation import correlate_residual_with_pressure
from tasks.identification.decision.experiment import Experiment, plan_next_experiment
from tasks.identification.decision.held_out import compute_held_out_errors
from tasks.identification.decision.log_faults import describe_inputs, describe_log_faults
from tasks.identification.decision.naming import find_detectable_sizes, list_calibrated, name_members
from tasks.identification.decision.open_explanations import (
    OpenExplanation,
    list_open_explanations,
    select_members,
)
from tasks.identification.decision.search import Finding, find_explanations
from tasks.identification.decision.settling import estimate_signature_share, fit_named, settle_named
from tasks.identification.decision.words import (
    describe_driven,
    describe_foreign,
    describe_open_explanations,
    describe_present_effects,
    describe_unnamed,
)
from tasks.identification.inference.driver import leave_out_driving
from tasks.identification.inference.fit import Fit
from tasks.identification.inference.forward import RunModel, predict_channels
from tasks.identification.inference.hypothesis import compose_parameters
from tasks.identification.inference.start import widen_tolerances
from tasks.identification.rules import DecisionRules
from tasks.surface.state import SurfaceParameters
from tasks.vehicle.effects.library import Effect
from tasks.vehicle.parameters import Vehicle

MOST_TRIED = 6
"""Candidates that are reported though they are not named [1]."""


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """A verdict with what it stands on.

    Parameters
    ----------
    verdict : the answer
    finding : the runs, and what they say about every explanation
    opened : the explanations that they leave open, the first being the one that is named
    fitted : fit of what is named
    calibrated : numbers that the file hardly knew and that are no discovery
    """

    verdict: Verdict
    finding: Finding
    opened: tuple[OpenExplanation, ...]
    fitted: Fit
    calibrated: tuple[NamedEffect, ...] = ()

    def predict_readings(self, runs: Sequence[RunModel]) -> list[NDArray[np.float64]]:
        """Return what the model predicts with what is named, float64 [N, 7] a run.

        Parameters
        ----------
        runs : training or held-out runs
        """
        theta, slots = self.fitted.compose()
        return [predict_channels(run, theta, slots=slots) for run in runs]


def judge_runs(
    campaign: Campaign,
    vehicle: Vehicle,
    surface: SurfaceParameters,
    library: tuple[Effect, ...],
    rules: DecisionRules,
) -> Outcome:
    """Return what a model lacks by the training runs, and what that does to the held-out runs.

    Parameters
    ----------
    campaign : measured runs with their split
    vehicle, surface : the model that is judged
    library : effects that may be named
    rules : by which it is decided
    """
    runs, drive = leave_out_driving(
        widen_tolerances(campaign, vehicle, surface, rules), vehicle, surface, rules
    )
    finding = find_explanations(runs, vehicle, surface, library, rules)
    opened = list_open_explanations(finding.grams, finding.explanations, rules)
    disagreement = measure_disagreement(finding.grams, opened[0].explanation)
    foreign = bool(opened[0].named) and disagreement > rules.foreign_disagreement
    if foreign:
        nothing = next(e for e in finding.explanations if not e.members)
        opened = [OpenExplanation(explanation=nothing, named=(), log_odds=0.0)]
    opened, fitted = settle_named(finding, opened, rules)
    first, *others = opened
    evidence = finding.evidence
    share = estimate_signature_share(finding, first, rules)
    named = name_members(first, finding.grams, fitted, share)
    rivals = _list_rivals(first, others, finding, share)
    tried = _list_tried(finding, first)
    reasons = describe_open_explanations(opened, finding.explanations, rules)
    why = describe_foreign(disagreement, rules) if foreign else ""
    if foreign:
        reasons.append(why)
    elif not named:
        reasons += describe_unnamed(
            tried, finding.best, select_members(finding.grams, finding.best, rules), rules
        )
    reasons += describe_inputs(campaign, evidence.train)
    reasons += [describe_driven(drive)] if drive else []
    reasons += describe_log_faults(campaign, named, [rival.name for _, rival in rivals])
    reasons += describe_present_effects(vehicle)
    error, manoeuvres = compute_held_out_errors(finding, fitted, rules)
    theta, slots = compose_parameters(fitted.parts, fitted.values, np.zeros(len(FILE_NUMBERS)))
    pulls = zip(
        FILE_NUMBERS,
        finding.null.session / evidence.session_sigma,
        fitted.session / evidence.session_sigma,
        strict=True,
    )
    sensors = zip(CHANNELS, *evidence.sensors, strict=True)
    verdict = Verdict(
        verdict=find_kind(named, rivals),
        effects=tuple(named),
        rivals=tuple(rivals),
        odds=tuple(OpenOdds(names=tuple(sorted(o.names)), odds=find_odds(o.log_odds)) for o in opened),
        tried=tuple(tried),
        error=error,
        manoeuvre_error=manoeuvres,
        correlation=correlate_residual_with_pressure(
            evidence.held_out, evidence.sensors, *fitted.compose(), rules.longest_lag
        ),
        session_pulls={name: (float(a), float(b)) for name, a, b in pulls},
        noise={name: (float(r), float(s)) for name, r, s in sensors if np.isfinite(s)},
        disturbance=evidence.disturbance,
        detectable=find_detectable_sizes(finding, rules),
        campaign=campaign.name,
        content_hash=campaign.content_hash,
        split_hash=campaign.split_hash,
        theta=theta,
        slots=slots,
        experiment=None
        if foreign
        else _plan(finding, fitted, opened, vehicle, surface, campaign.brake_signal),
        step_sensitive=evidence.step_sensitive,
        reasons=tuple(reasons),
        disagreement=why,
    )
    verdict = report_miss(verdict, rules.foreign_misfit)
    calibrated = list_calibrated(fitted, named, library, rules)
    return Outcome(
        verdict=verdict, finding=finding, opened=tuple(opened), fitted=fitted, calibrated=tuple(calibrated)
    )


def _list_rivals(
    first: OpenExplanation, others: Sequence[OpenExplanation], finding: Finding, share: float
) -> list[tuple[str, NamedEffect]]:
    """Return what the other explanations name instead, each with what it stands in for."""
    rivals: dict[str, tuple[str, NamedEffect]] = {}
    for other in others:
        replaced = [m.name for m in first.named if m.name not in other.names] or ["nothing"]
        for effect in name_members(other, finding.grams, None, share):
            if effect.name not in first.names:
                rivals.setdefault(effect.name, (replaced[0], effect))
    return list(rivals.values())


def _list_tried(finding: Finding, first: OpenExplanation) -> list[NamedEffect]:
    """Return the best candidates beside what is named that are not named themselves."""
    tried: dict[str, NamedEffect] = {}
    for explanation in finding.explanations:
        further = [m for m in explanation.members if m.name not in first.names]
        if (
            len(further) == 1
            and further[0].name not in tried
            and len(explanation.members) == 1 + len(first.named)
        ):
            shown = OpenExplanation(explanation=explanation, named=tuple(further), log_odds=0.0)
            tried |= {effect.name: effect for effect in name_members(shown, finding.grams, None)}
        if len(tried) == MOST_TRIED:
            break
    return sorted(tried.values(), key=lambda effect: -effect.score)


def _plan(
    finding: Finding,
    fitted: Fit,
    opened: Sequence[OpenExplanation],
    vehicle: Vehicle,
    surface: SurfaceParameters,
    brake_signal: str,
) -> Experiment | None:
    """Return the run that tells the first explanation from its closest rival, or what is suggested from nothing."""
    if len(opened) > 1:
        first, other = (explanation.names for explanation in opened[:2])
        between = tuple(" and ".join(sorted(own)) or "nothing" for own in (first - other, other - first))
        pair = (fitted, fit_named(finding, opened[1]))
    elif opened[0].named:
        return None
    else:
        suggested = _find_suggested(finding)
        if suggested is None:
            return None
        between = (suggested.named[0].name, "the model as it stands")
        pair = (fit_named(finding, suggested), finding.null)
    return plan_next_experiment(
        finding.evidence, *pair, (between[0], between[1]), vehicle, surface, brake_signal
    )


def _find_suggested(finding: Finding) -> OpenExplanation | None:
    """Return the best explanation of one member, where it gains something though it is not named."""
    for explanation in finding.explanations:
        if len(explanation.members) == 1 and explanation.log_odds > 0.0:
            return OpenExplanation(explanation=explanation, named=explanation.members, log_odds=0.0)
    return None


def report_miss(verdict: Verdict, limit: float) -> Verdict:
    """Return a verdict that says by how much the speed of held-out runs is missed, where that is more than noise.

    Parameters
    ----------
    verdict : the answer
    limit : error over noise from which a run is missed [1]
    """
    error, (_, noise) = verdict.error["speed"].after, verdict.noise["speed"]
    # a disagreement says that nothing could be named, and not that what is named is not all
    if error <= limit * noise or (verdict.disagreement and not verdict.effects):
        return verdict
    missed = (
        f"the speed of the held-out runs is missed by {error:.3g} m/s, {error / noise:.3g} times its noise (at most"
        f" {limit:g})"
    )
    if not verdict.effects:
        return replace(verdict, misses=True, disagreement=missed, reasons=(missed, *verdict.reasons))
    return replace(
        verdict,
        misses=True,
        reasons=(*verdict.reasons, f"{missed}: what is named is not all that the model lacks"),
    )
