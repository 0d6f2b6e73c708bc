"""The decision: what is missing, how sure, and what it does to the error on runs that no fit has seen."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from tasks.campaign.campaign import CHANNELS, SESSION, Campaign
from tasks.identification.decision.alternatives import find_pairs, find_pulled_numbers
from tasks.identification.decision.answer import (
    NamedEffect,
    Verdict,
    VerdictName,
    find_kind,
    make_named_effect,
)
from tasks.identification.decision.attribution import Candidate
from tasks.identification.decision.calibrated import tell_calibrated
from tasks.identification.decision.correlation import correlate_residual_with_pressure
from tasks.identification.decision.discovery import search_library_and_forms
from tasks.identification.decision.disputes import settle_disputes
from tasks.identification.decision.experiment import plan_next_experiment
from tasks.identification.decision.held_out import HeldOutErrors, compute_held_out_errors, is_lowered
from tasks.identification.decision.intervals import (
    compute_curvature_interval,
    compute_profile_interval,
    refit_named,
)
from tasks.identification.decision.log_faults import tell_log_faults
from tasks.identification.decision.objection import object_to_last
from tasks.identification.decision.rivals import RivalComparison, compare_with_rivals
from tasks.identification.decision.screening import can_show, find_detectable_sizes
from tasks.identification.decision.search import SearchState
from tasks.identification.decision.superseded import drop_superseded, is_named
from tasks.identification.decision.words import say_confirmation, say_rejection, tell_present_effects
from tasks.identification.inference.evidence import RunEvidence
from tasks.identification.inference.fit import Fit
from tasks.identification.inference.forward import predict_channels
from tasks.identification.inference.hypothesis import compose_parameters
from tasks.identification.inference.linearisation import prepare_evidence
from tasks.identification.rules import DecisionRules
from tasks.surface.state import SurfaceParameters
from tasks.vehicle.effects.library import Effect
from tasks.vehicle.parameters import Vehicle


@dataclass(frozen=True, kw_only=True)
class SearchOutcome:
    """A verdict with what it stands on.

    Parameters
    ----------
    verdict : the answer
    start : the model as it stands, with the runs differentiated about it
    end : the grown model, with the runs differentiated about it; ``start`` where nothing is named
    compared : every named effect beside its alternatives
    calibrated : numbers that the prediction rests on and that differ from the file by no more than its tolerances
    """

    verdict: Verdict
    start: SearchState
    end: SearchState
    compared: tuple[RivalComparison, ...]
    calibrated: tuple[NamedEffect, ...] = ()

    def predict_readings(self, runs: Sequence[RunEvidence]) -> list[NDArray[np.float64]]:
        """Return the readings of runs by the grown model, float64 [N, 7] each [units of the channels].

        Parameters
        ----------
        runs : training or held-out runs
        """
        theta, slots = self.end.base.compose()
        return [predict_channels(run.model, theta, slots=slots) for run in runs]


def find_missing_effects(
    campaign: Campaign,
    vehicle: Vehicle,
    surface: SurfaceParameters,
    effects: tuple[Effect, ...],
    rules: DecisionRules,
    *,
    hardly_known: Mapping[str, tuple[float, float]] = MappingProxyType({}),
) -> SearchOutcome:
    """Trace the residual of a campaign to what the model lacks.

    Parameters
    ----------
    campaign : measured runs with their split
    vehicle, surface : the model that is judged
    effects : the library of candidates
    rules : by which it is decided
    hardly_known : numbers of the session that the vehicle's file hardly knows: a first value, and the prior's sigma

    Returns
    -------
    The verdict and what it stands on; nothing in it has been fitted to a held-out run.

    Raises
    ------
    ForeignCarError
        If the car's equations are not the model's, so that single effects cannot be told; `judge_jointly` can.
    """
    shown = [effect for effect in effects if can_show(effect, vehicle, campaign.channels)]
    evidence, null = prepare_evidence(
        campaign,
        vehicle,
        surface,
        tuple(e for e in shown if e.parameters[0].name not in hardly_known),
        rules,
        hardly_known,
    )
    reasons: list[str] = []
    start, found, near_form = search_library_and_forms(evidence, null, reasons)
    found, compared, near_form = _settle_names(found, near_form, reasons)
    kept, errors = _keep_what_predicts(
        found, start, rules.joint.noticed_share if hardly_known else None, reasons
    )
    tried = [*(r.accepted for r in found.rounds[len(kept.rounds) :]), *found.tried]
    if kept is not found:
        found, compared, near_form = kept, compare_with_rivals(kept.evidence, kept.base, kept.rounds), None
    # before derivatives are taken anew: gains compare only about the same ones
    others = (*find_pairs(found, compared), *find_pulled_numbers(found)) if compared else ()
    if compared:
        here, settled, refitted = refit_named(found.evidence, found.base, [c.own for c in compared])
        found = replace(found, evidence=here, base=settled)
        compared = [replace(c, own=own) for c, own in zip(compared, refitted, strict=True)]
        errors = compute_held_out_errors(start.evidence, start.base, found.base)
    named = [
        make_named_effect(c.own, c.share, compute_profile_interval(c.own, found.evidence)) for c in compared
    ]
    near = _name_rivals(compared, [other.candidate for other in others], near_form)
    reasons += dict.fromkeys(other.reason for other in others)
    calibrated, wrong = tell_calibrated(found.base, effects, hardly_known, campaign.tolerances, rules)
    named += wrong
    kind = _choose_verdict_name(named, near)
    if kind == "SET" and len(near) > len(others):
        reasons.append(
            f"{len(near) - len(others)} other explanation(s) lie within {rules.rival_span:g} units, make good"
            f" {rules.rival_gain_share:.0%} of the gain, win too many resamples or look the same to these runs, and the"
            " held-out runs do not tell them apart"
        )
    reasons += filter(None, (say_confirmation(c.own) for c in compared))
    if not named and not reasons:
        reasons.append(say_rejection(tried))
    reasons += tell_log_faults(campaign, named, [rival.name for _, rival in near])
    reasons += tell_present_effects(vehicle)
    experiment = None
    pair = _to_tell_apart(compared, near_form, start) if compared else find_pair_to_confirm(tried, start.base)
    if pair is not None:
        experiment = plan_next_experiment(start.evidence, *pair, vehicle, surface)
    theta, slots = compose_parameters(found.base.parts, found.base.values, np.zeros(len(SESSION)))
    sigma, sensors = np.array(campaign.tolerances.session), zip(CHANNELS, *evidence.sensors, strict=True)
    pulls = zip(SESSION, start.base.session / sigma, found.base.session / sigma, strict=True)
    verdict = Verdict(
        verdict=kind,
        effects=tuple(named),
        rivals=tuple(near),
        tried=tuple(make_named_effect(c, 0.0, compute_curvature_interval(c)) for c in tried[:6]),
        error=errors[0],
        manoeuvre_error=errors[1],
        correlation=correlate_residual_with_pressure(
            start.evidence.held_out, *found.base.compose(), rules.longest_lag
        ),
        session_pulls={name: (float(a), float(b)) for name, a, b in pulls},
        noise={name: (float(r), float(s)) for name, r, s in sensors if np.isfinite(s)},
        disturbance=start.evidence.disturbance,
        detectable=find_detectable_sizes(start.evidence, start.base),
        campaign=campaign.name,
        content_hash=campaign.content_hash,
        split_hash=campaign.split_hash,
        theta=theta,
        slots=slots,
        experiment=experiment,
        step_sensitive=evidence.step_sensitive,
        reasons=tuple(reasons),
    )
    told = named or is_lowered(errors[0]["speed"])
    return SearchOutcome(
        verdict=verdict,
        start=start,
        end=found,
        compared=tuple(compared),
        calibrated=calibrated if told else (),
    )


def _settle_names(
    found: SearchState, near_form: Candidate | None, reasons: list[str]
) -> tuple[SearchState, list[RivalComparison], Candidate | None]:
    """Take back names that later ones explain and about which the runs disagree, and compare the rest with its rivals.

    Returns
    -------
    What is named, each name beside its alternatives, and the single form that still cannot be told from the first.
    """
    compared = compare_with_rivals(found.evidence, found.base, found.rounds)
    while again := drop_superseded(found, compared):
        found = again
        compared = compare_with_rivals(found.evidence, found.base, found.rounds)
    near_form = None if near_form is None or is_named(near_form, compared) else near_form
    agreed = settle_disputes(found, reasons)
    if agreed is found:
        return found, compared, near_form
    return agreed, compare_with_rivals(agreed.evidence, agreed.base, agreed.rounds), None


def _keep_what_predicts(
    found: SearchState, start: SearchState, least: float | None, reasons: list[str]
) -> tuple[SearchState, HeldOutErrors]:
    """Take back the last name for as long as the held-out runs object to it; return what is left and its errors."""
    errors = compute_held_out_errors(start.evidence, start.base, found.base)
    while found.rounds and (objection := object_to_last(found, start, errors[0], least)):
        reasons.append(objection)
        *left, last = found.rounds
        evidence = left[-1].evidence if left else start.evidence
        found = replace(start, base=last.base, rounds=tuple(left), evidence=evidence)
        errors = compute_held_out_errors(start.evidence, start.base, found.base)
    return found, errors


def _name_rivals(
    compared: Sequence[RivalComparison], others: Sequence[Candidate], near_form: Candidate | None
) -> list[tuple[str, NamedEffect]]:
    """Return what the runs cannot tell from the names, each with the name that it stands in for."""
    near = [(c.own.hypothesis.name, rival, wins) for c in compared for rival, wins in c.near]
    beside_first = [*others, *([] if near_form is None else [near_form])]
    near += [(compared[0].own.hypothesis.name, rival, 0.0) for rival in beside_first]
    return [
        (of, make_named_effect(rival, wins, compute_curvature_interval(rival))) for of, rival, wins in near
    ]


def find_pair_to_confirm(tried: Sequence[Candidate], null: Fit) -> tuple[Fit, Fit] | None:
    """Return the best candidate that further runs could confirm, and the plain model; None if there is none.

    Parameters
    ----------
    tried : candidates of which none was accepted
    null : fit without them
    """
    best = max((c for c in tried if c.is_open), key=lambda c: c.score, default=None)
    return None if best is None else (best.fitted, null)


def _to_tell_apart(
    compared: Sequence[RivalComparison], near_form: Candidate | None, start: SearchState
) -> tuple[Fit, Fit]:
    """The two explanations to tell apart next: rivals first, else the best of the others, else the plain model."""
    first = compared[0].own.fitted
    if near_form is not None:
        return first, near_form.fitted
    near = [(c.own, other) for c in compared for other, _ in c.near]
    others = [(compared[0].own, other) for other, _ in compared[0].others]
    if not (near or others):
        return first, start.base
    own, other = max(near or others, key=lambda pair: pair[1].score)
    return own.fitted, other.fitted


def _choose_verdict_name(named: list[NamedEffect], near: list[tuple[str, NamedEffect]]) -> VerdictName:
    forms = {(e.name, e.port, e.variable) for e in named if e.effect_class == "form"}
    if forms:
        # an effect of the library that explains as much at the same port by the same variable is not unknown
        known = {(of, e.port, e.variable) for of, e in near if e.effect_class == "effect"}
        return "SET" if forms & known else "UNKNOWN_FORM"
    return find_kind(named, near)
