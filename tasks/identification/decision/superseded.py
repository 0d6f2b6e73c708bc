"""Names that are taken back: an early one that no longer earns its place beside those named later."""

from collections.abc import Sequence
from dataclasses import replace

from tasks.identification.decision.attribution import (
    Candidate,
    assess_fit,
    refine_candidates,
    refit_without_part,
)
from tasks.identification.decision.cross_validation import cross_validate_candidate
from tasks.identification.decision.rivals import RivalComparison
from tasks.identification.decision.search import Round, SearchState
from tasks.identification.inference.fit import Fit, compute_misfit_by_run


def drop_superseded(found: SearchState, compared: Sequence[RivalComparison]) -> SearchState | None:
    """Return the search without the effect that the others explain best; None if every effect earns its place.

    A dead band that was named first may be the foot of a brake's curve that was named after it.

    Parameters
    ----------
    found : what is named
    compared : each named effect beyond all others
    """
    evidence = found.evidence
    weak = [
        (c.own.score, i)
        for i, c in enumerate(compared[:-1])
        if c.own.hypothesis.effect_class != "retune" and c.own.score < evidence.rules.accept_score
    ]
    if not weak:
        return None
    return leave_out(found, min(weak)[1])


def is_named(form: Candidate, compared: Sequence[RivalComparison]) -> bool:
    """Return whether a form is among what is named, where the effect that it was held against may be taken back.

    Parameters
    ----------
    form : that could not be told from the first name of the search
    compared : each named effect beyond all others
    """
    return any(c.own.hypothesis.name == form.hypothesis.name for c in compared)


def leave_out(found: SearchState, index: int) -> SearchState:
    """Return the search without one of its names; the others are fitted and judged again.

    Parameters
    ----------
    found : what is named
    index : position of the name
    """
    after = refit_without_part(found.base, index, found.evidence)
    rounds: tuple[Round, ...] = ()
    fitted = after
    for known in reversed([r for i, r in enumerate(found.rounds) if i != index]):
        rounds = (_judge_again(found, fitted, known), *rounds)
        fitted = rounds[0].base
    return replace(found, base=after, rounds=rounds)


def _judge_again(found: SearchState, fitted: Fit, known: Round) -> Round:
    """Return the round that ends with a fit, whose last part is judged beyond the others."""
    evidence, part = found.evidence, fitted.parts[-1]
    before = refit_without_part(fitted, len(fitted.parts) - 1, evidence)
    held_out = compute_misfit_by_run(evidence.held_out, before)
    tried = tuple(refine_candidates(evidence, before)) if part.effect_class != "form" else ()
    accepted = cross_validate_candidate(
        evidence, before, assess_fit(evidence, before, held_out, part, fitted)
    )
    return replace(known, base=before, tried=tried, accepted=accepted, evidence=evidence)
