"""The decision: what is missing, how sure, and what it does to the error on runs that no fit has seen."""

from collections.abc import Callable

import numpy as np

from tasks.closure.answer import NamedEffect, Verdict, VerdictName, named_effect
from tasks.closure.attribution import RIVAL_SPAN
from tasks.closure.campaign import CHANNELS, SESSION, Campaign
from tasks.closure.derivation import prepare
from tasks.closure.fit import compose, fit
from tasks.closure.held_out import held_out_error
from tasks.closure.rivals import detectable, rivals
from tasks.closure.search import search_all
from tasks.surface.state import SurfaceParameters
from tasks.vehicle.effects.library import Effect
from tasks.vehicle.parameters import Vehicle

WORSE_LIMIT = 1.05


def attribute(
    campaign: Campaign,
    vehicle: Vehicle,
    surface: SurfaceParameters,
    effects: tuple[Effect, ...],
    *,
    progress: Callable[[str], None] = lambda stage: None,
) -> Verdict:
    """Trace the residual of a campaign to what the model lacks.

    Parameters
    ----------
    campaign : measured runs with their split
    vehicle, surface : the model that is judged
    effects : the library of candidates
    progress : called with the name of each stage as it begins

    Returns
    -------
    The verdict; nothing in it has been fitted to a held-out run.
    """
    progress("derivatives")
    evidence = prepare(campaign, vehicle, surface, effects)
    reasons: list[str] = []
    progress("search")
    null = fit(evidence.train, (), evidence.session_sigma, iterations=6)
    start, found, near_form = search_all(evidence, null, reasons)
    progress("rivals")
    named, near = rivals(found.evidence, found.base, list(found.rounds)) if found.rounds else ([], [])
    if near_form is not None and named:
        near.append((named[0].name, named_effect(near_form, 0.0)))
    null, base, tried = start.base, found.base, list(found.tried)
    error = held_out_error(start.evidence, null, base)
    kind = _kind(named, near)
    worse = [name for name, e in error.items() if e.after > WORSE_LIMIT * e.frozen and e.change_low > 0.0]
    if named and worse:
        # the marginal likelihood can buy a fit with disturbances; prediction of unseen runs cannot be bought
        reasons.append(
            f"{', '.join(e.name for e in named)} would fit, but predicts {', '.join(worse)} of the held-out runs"
            " worse than the frozen model: not named"
        )
        kind, base = "NOTHING", null
        tried, named, near = [r.accepted for r in found.rounds], [], []
        error = held_out_error(start.evidence, null, null)
    if kind == "SET":
        reasons.append(
            f"{len(near)} other explanation(s) lie within {RIVAL_SPAN:g} units or win too many resamples"
        )
    if kind == "NOTHING" and not found.rounds:
        reasons.append("no candidate passes the score, held-out and bound gates together")
    theta, slots = compose(base.parts, base.values, np.zeros(len(SESSION)))
    sigma = evidence.session_sigma
    first = evidence.train[0]
    return Verdict(
        verdict=kind,
        effects=tuple(named),
        rivals=tuple(near),
        tried=tuple(named_effect(c, 0.0) for c in tried[:6]),
        error=error,
        session_pulls={
            name: (float(a), float(b))
            for name, a, b in zip(SESSION, null.session / sigma, base.session / sigma, strict=True)
        },
        noise={
            name: (float(r), float(s)) for name, r, s in zip(CHANNELS, first.rho, first.sigma, strict=True)
        },
        disturbance=start.evidence.disturbance,
        detectable=detectable(start.evidence, null),
        campaign=campaign.name,
        content_hash=campaign.content_hash,
        split_hash=campaign.split_hash,
        theta=theta,
        slots=slots,
        torn=evidence.torn,
        reasons=tuple(reasons),
    )


def _kind(named: list[NamedEffect], near: list[tuple[str, NamedEffect]]) -> VerdictName:
    if not named:
        return "NOTHING"
    classes = {effect.effect_class for effect in named}
    if "form" in classes:
        return "UNKNOWN_FORM"
    if near:
        return "SET"
    if classes == {"retune"}:
        return "RETUNE"
    if classes == {"sensor"}:
        return "SENSOR"
    return "FOUND"
