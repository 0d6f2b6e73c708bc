"""95 % intervals of a hypothesis' parameters, by curvature or by profile likelihood, within the bounds."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tasks.campaign.campaign import SESSION
from tasks.identification.decision.attribution import Candidate
from tasks.identification.inference.campaign_evidence import Evidence
from tasks.identification.inference.fit import Fit, fit_hypotheses
from tasks.identification.inference.linearisation import differentiate_about_fit
from tasks.identification.inference.quantiles import compute_student_quantile

Bounds = tuple[NDArray[np.float64], NDArray[np.float64]]


def refit_named(
    evidence: Evidence, base: Fit, candidates: Sequence[Candidate]
) -> tuple[Evidence, Fit, list[Candidate]]:
    """Return the named effects, fitted with derivatives that are taken at their estimates.

    If the derivatives of the nuisances are those of another linearisation point, too little of an effect's derivative
    is projected out, most of all where the vehicle reaches a road feature a moment later, or where a run's own friction
    decides when an anti-lock brake acts. That is accurate enough for the search, but the information is up to 15 times
    too large, and the estimates stop before the optimum. Here derivatives are taken about each run's own offsets too.

    Parameters
    ----------
    evidence : the runs
    base : fit of all that is named
    candidates : each named effect as it was judged, in addition to all others

    Returns
    -------
    The runs with derivatives at ``base``, the base fitted again, and the candidates fitted again.
    """
    here = differentiate_about_fit(evidence, base)

    def refit_here(fitted: Fit) -> Fit:
        return fit_hypotheses(
            here.train,
            fitted.parts,
            here.session_sigma,
            values=fitted.values,
            session=fitted.session,
            offsets=fitted.offsets,
            iterations=8,
        )

    settled = refit_here(base)
    # the only one that is named is the base itself
    refitted = [replace(c, fitted=settled if c.fitted is base else refit_here(c.fitted)) for c in candidates]
    return here, settled, refitted


def compute_widening(candidate: Candidate) -> float:
    """Return the factor on standard errors for what the likelihood does not hold [1].

    The runs' disagreement counts twice. Its root is the scatter between them, which is the part of the model's error
    that differs from run to run. What is common to all runs moves an estimate without any scatter, and is taken to be
    as large beside the noise.

    Parameters
    ----------
    candidate : refined and judged candidate
    """
    return candidate.inflation * candidate.rules.interval_widening


def compute_curvature_interval(candidate: Candidate) -> Bounds:
    """Return intervals from the curvature at the estimate, cut at the bounds and widened by `compute_widening`.

    Parameters
    ----------
    candidate : refined and judged candidate

    Returns
    -------
    Lower and upper ends, float64 [K] each.
    """
    h = candidate.hypothesis
    k = len(h.names)
    values = candidate.fitted.values[-k:]
    variance = np.maximum(np.diag(candidate.fitted.covariance)[-k:], 0.0) * compute_widening(candidate) ** 2
    # the session's tolerance of the same number adds to the uncertainty of the vehicle's
    tolerance = [candidate.fitted.session_sigma[SESSION.index(n)] if n in SESSION else 0.0 for n in h.names]
    reach = np.sqrt(variance + np.square(tolerance)) * compute_student_quantile(candidate.informed)
    return np.clip(values - reach, h.lower, h.upper), np.clip(values + reach, h.lower, h.upper)


def compute_profile_interval(candidate: Candidate, evidence: Evidence) -> Bounds:
    """Return intervals of an effect of several parameters from its profile likelihood.

    A value belongs to the interval if the best fit with that value is worse by less than the square of t times
    `compute_widening` (Venzon and Moolgavkar 1988, doi:10.2307/2347496). Where one parameter acts only together with
    another, the curvature at the estimate does not tell whether there is an effect. The profile does: its deviance at 0
    is twice the gain.

    Parameters
    ----------
    candidate : refined and judged candidate; with one parameter, its curvature is used
    evidence : the runs

    Returns
    -------
    Lower and upper ends, float64 [K] each.
    """
    low, high = compute_curvature_interval(candidate)
    k = len(candidate.hypothesis.names)
    if k == 1:
        return low, high
    fitted = candidate.fitted
    centre = fit_hypotheses(
        evidence.train, fitted.parts, evidence.session_sigma, values=fitted.values, session=fitted.session,
        iterations=4,
    )  # fmt: skip
    for j in range(k):
        low[j] = _find_limit(candidate, centre, evidence, j, low[j], candidate.hypothesis.lower[j])
        high[j] = _find_limit(candidate, centre, evidence, j, high[j], candidate.hypothesis.upper[j])
    values = fitted.values[-k:]
    return np.minimum(low, values), np.maximum(high, values)


def _find_limit(
    candidate: Candidate, centre: Fit, evidence: Evidence, place: int, guess: float, bound: float
) -> float:
    """Return the value between estimate and bound where the root deviance reaches the quantile, by false position."""
    k = len(candidate.hypothesis.names)
    wanted = compute_student_quantile(candidate.informed) * compute_widening(candidate)
    inside, outside = float(centre.values[place - k]), float(bound)
    if inside == outside:
        return outside

    def compute_root_deviance(x: float) -> float:
        rise = _fit_pinned(centre, evidence, place - k, x).objective - centre.objective
        return float(np.sqrt(max(rise, 0.0)))

    at_inside, at_outside = 0.0, compute_root_deviance(outside)
    if at_outside <= wanted:
        return outside
    x = guess if min(inside, outside) < guess < max(inside, outside) else 0.5 * (inside + outside)
    for _ in range(evidence.rules.profile_points):
        here = compute_root_deviance(x)
        if abs(here - wanted) < evidence.rules.profile_tolerance * wanted:
            return x
        if here < wanted:
            inside, at_inside = x, here
        else:
            outside, at_outside = x, here
        # kept away from both ends, so that a curved profile cannot keep one of them for ever
        share = np.clip((wanted - at_inside) / (at_outside - at_inside), 0.1, 0.9)
        x = inside + float(share) * (outside - inside)
    return x


def _fit_pinned(centre: Fit, evidence: Evidence, place: int, value: float) -> Fit:
    """Return the best fit that holds one parameter of the last hypothesis (``place`` counts from the end)."""
    last = centre.parts[-1]
    lower, upper = last.lower.copy(), last.upper.copy()
    lower[place] = upper[place] = value
    moved = value - centre.values[place]
    start = centre.values + moved * centre.covariance[:, place] / max(centre.covariance[place, place], 1e-300)
    start[place] = value
    k = len(last.names)
    start[-k:] = np.clip(start[-k:], lower, upper)
    pinned = (*centre.parts[:-1], replace(last, lower=lower, upper=upper))
    return fit_hypotheses(
        evidence.train, pinned, evidence.session_sigma, values=start, session=centre.session,
        iterations=4,
    )  # fmt: skip
