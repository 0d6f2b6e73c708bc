"""Effects that were named early and no longer earn their place beside those named later."""

from collections.abc import Sequence
from dataclasses import replace

from tasks.identification.decision.attribution import assess_fit, refine_candidates, refit_without_part
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
    gone = min(weak)[1]
    after = refit_without_part(found.base, gone, evidence)
    kept = [r for i, r in enumerate(found.rounds) if i != gone]
    rounds = [_judge_again(found, after, kept[-1])]
    for known in reversed(kept[:-1]):
        rounds.insert(0, _judge_again(found, rounds[0].base, known))
    return replace(found, base=after, rounds=tuple(rounds))


def _judge_again(found: SearchState, fitted: Fit, known: Round) -> Round:
    """Return the round that ends with a fit, whose last part is judged beyond the others."""
    evidence, part = found.evidence, fitted.parts[-1]
    before = refit_without_part(fitted, len(fitted.parts) - 1, evidence)
    held_out = compute_misfit_by_run(evidence.held_out, before)
    tried = tuple(refine_candidates(evidence, before)) if part.effect_class != "form" else ()
    accepted = assess_fit(evidence, before, held_out, part, fitted)
    return replace(known, base=before, tried=tried, accepted=accepted, evidence=evidence)
