"""Cross-validation over training runs, for candidates that the held-out runs neither confirm nor contradict."""

from dataclasses import replace

from tasks.identification.decision.attribution import Candidate
from tasks.identification.inference.campaign_evidence import Evidence
from tasks.identification.inference.fit import (
    Fit,
    compute_misfit_by_run,
    fit_hypotheses,
    sum_misfit_falls,
)


def cross_validate_candidate(evidence: Evidence, base: Fit, candidate: Candidate) -> Candidate:
    """Return the candidate with its gain by cross-validation, where the held-out runs do not decide.

    Parameters
    ----------
    evidence : the runs, with derivatives that hold at the candidate
    base : fit of the hypotheses accepted so far
    candidate : judged on held-out runs
    """
    # what no effect of the library says, or what needs a number pulled beyond belief, must be felt in the held-out runs
    if not candidate.is_open or candidate.pulls_session or candidate.hypothesis.effect_class == "form":
        return candidate
    fall = _compute_cross_validated_fall(evidence, base, candidate.fitted)
    return replace(candidate, cross_validated_gain=fall / candidate.inflation)


def _compute_cross_validated_fall(evidence: Evidence, base: Fit, fitted: Fit) -> float:
    """Return by how much a candidate lowers the misfit of training runs that its fit has not seen [1].

    Each run in turn is predicted by fits to the others, which start without the effect. Where the others do not show
    it, nothing is gained: what a single run shows is not confirmed.

    Parameters
    ----------
    evidence : the runs
    base : fit without the candidate
    fitted : fit with it; the candidate is its last part
    """
    start = fitted.values.copy()
    start[len(start) - len(fitted.parts[-1].names)] = 0.0
    fall = 0.0
    for place, left_out in enumerate(evidence.train):
        others = [i for i in range(len(evidence.train)) if i != place]
        rest = tuple(evidence.train[i] for i in others)
        offsets = tuple(base.offsets[i] for i in others)
        without, grown = (
            fit_hypotheses(
                rest, parts, evidence.session_sigma, values=values, session=base.session, offsets=offsets,
                iterations=4 + 4 * (len(values) - len(base.values)),
            )
            for parts, values in ((base.parts, base.values), (fitted.parts, start))
        )  # fmt: skip
        if without.objective - grown.objective <= evidence.rules.held_out_gain:
            continue
        unseen = (left_out,)
        fall += sum_misfit_falls(compute_misfit_by_run(unseen, without), compute_misfit_by_run(unseen, grown))
    return fall
