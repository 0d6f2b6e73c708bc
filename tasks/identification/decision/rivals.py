"""Rivals of the named effects: explanations that training, resampled and unseen runs cannot tell from them."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tasks.campaign.campaign import SESSION
from tasks.identification.decision.attribution import (  # fmt: skip
    Candidate,
    Misfits,
    assess_fit,
    judge_hypothesis,
    refine_candidates,
    refit_without_part,
)
from tasks.identification.decision.cross_validation import cross_validate_candidate
from tasks.identification.decision.search import Round
from tasks.identification.decision.session_numbers import (
    find_alike_instruments,
    find_alike_numbers,
    free_session_number,
)
from tasks.identification.inference.campaign_evidence import Evidence
from tasks.identification.inference.fit import (
    Fit,
    compute_misfit_by_run,
    compute_misfit_falls,
    fit_hypotheses,
)
from tasks.identification.inference.hypothesis import is_nested
from tasks.identification.inference.linearisation import hold_session

MORE_STEPS = 12
"""Gauss-Newton steps of a fit that begins where another ended [1]."""


@dataclass(frozen=True, kw_only=True)
class RivalComparison:
    """An accepted effect and the alternatives that were tried in its place.

    Parameters
    ----------
    own : the effect, in addition to all other accepted ones
    share : bootstrap win share [1]
    others : alternatives with their win shares, best first
    near : alternatives that cannot be told from the effect
    """

    own: Candidate
    share: float
    others: tuple[tuple[Candidate, float], ...]
    near: tuple[tuple[Candidate, float], ...]


def compare_with_rivals(evidence: Evidence, base: Fit, rounds: tuple[Round, ...]) -> list[RivalComparison]:
    """Compare every accepted effect with its alternatives, with all other accepted effects in the model.

    Parameters
    ----------
    evidence : the runs, with derivatives that hold at ``base``
    base : fit of all accepted effects
    rounds : rounds of the search that accepted them
    """
    compared = []
    for i, found in enumerate(rounds):
        rest, own, tried = found.base, found.accepted, found.tried
        if i + 1 < len(rounds):
            # an effect that was accepted later may change the comparison of this effect with its rivals
            rest = refit_without_part(base, i, evidence)
            at = sum(len(p.names) for p in base.parts[:i])
            part = replace(base.parts[i], start=base.values[at : at + len(base.parts[i].names)])
            own = judge_hypothesis(evidence, rest, compute_misfit_by_run(evidence.held_out, rest), part)
            own = cross_validate_candidate(evidence, rest, own)
            tried = tuple(refine_candidates(evidence, rest)) if own.hypothesis.effect_class != "form" else ()
        others = [c for c in tried if c.hypothesis.name != own.hypothesis.name]
        alike = find_alike_numbers(evidence, own.hypothesis.names[0])
        others += _free_numbers(evidence, rest, alike, {c.hypothesis.name for c in others})
        others = [_fit_further(evidence, rest, base, c) if c.gain < own.gain else c for c in others]
        instruments = _judge_alike_instruments(evidence, rest, own)
        others = [c for c in others if c.hypothesis.name not in instruments] + list(instruments.values())
        unseen = compute_misfit_by_run(evidence.held_out, rest)
        share = compute_win_share([own, *others], rest)
        shares = [compute_win_share([c, own, *[o for o in others if o is not c]], rest) for c in others]
        near = []
        for c, wins in zip(others, shares, strict=True):
            if c.hypothesis.names[0] in alike:
                explains = _is_as_wrong(c)
            else:
                enough = _is_as_wrong(c) if c.hypothesis.name in instruments else c.score > 0.0
                explains = enough and is_close(own, share, c, wins)
            if (
                explains
                and not is_nested(own.hypothesis, c.hypothesis)
                # an explanation that bends the session beyond belief is none beside one that does not
                and (own.pulls_session or not c.pulls_session)
                and is_close_on_unseen_runs(evidence, unseen, own, c)
            ):
                near.append((c, wins))
        compared.append(
            RivalComparison(
                own=own, share=share, others=tuple(zip(others, shares, strict=True)), near=tuple(near)
            )
        )
    return compared


def _fit_further(evidence: Evidence, rest: Fit, base: Fit, other: Candidate) -> Candidate:
    """Return an explanation with a large gain, fitted again from its numbers and the session beside what is named.

    A search ranks what gains much after a few steps, and fits only the best of it to the end. A rival of that is what
    gains as much at its own end, which lies where the runs are explained as well.
    """
    if other.gain < evidence.rules.relinearisation_gain:
        return other
    known = other.fitted
    fitted = fit_hypotheses(
        evidence.train, known.parts, evidence.session_sigma, values=known.values, session=base.session,
        iterations=MORE_STEPS,
    )  # fmt: skip
    if fitted.objective >= known.objective:
        return other
    return assess_fit(evidence, rest, None, other.hypothesis, fitted)


def _is_as_wrong(other: Candidate) -> bool:
    """Return whether what looks like a wrong number may be what is wrong: as of that one, no score is asked."""
    return other.gain > 0.0 and not other.fitted.at_bound


def _free_numbers(
    evidence: Evidence, rest: Fit, names: Sequence[str], known: Collection[str]
) -> list[Candidate]:
    """Return numbers of the vehicle that are not known yet, each freed in place of the one that is named.

    Which of two numbers that look alike is pulled is decided by their tolerances alone.
    """
    judged = []
    for name in names:
        hypothesis = free_session_number(evidence, rest, name)
        if hypothesis is not None and hypothesis.name not in known:
            judged.append(judge_hypothesis(evidence, rest, None, hypothesis))
    return judged


def _judge_alike_instruments(evidence: Evidence, rest: Fit, own: Candidate) -> dict[str, Candidate]:
    """Return errors of instruments that look like a wrong number, by name, each with the number as the file has it."""
    number = own.hypothesis.names[0]
    if own.hypothesis.effect_class != "retune" or number not in SESSION:
        return {}
    held = hold_session(evidence, [number])
    return {
        instrument.name: judge_hypothesis(held, rest, None, instrument)
        for instrument in find_alike_instruments(held, number)
    }


def compute_win_share(candidates: list[Candidate], base: Fit, seed: int = 0) -> float:
    """Return the share of bootstrap resamples of the runs in which the first candidate keeps the best score [1].

    Parameters
    ----------
    candidates : refined candidates, best first
    base : fit to which they were added
    seed : seed of the resampling
    """
    runs = len(base.by_run)
    draws = np.random.Generator(np.random.Philox(seed)).integers(
        0, runs, (candidates[0].rules.bootstrap_resamples, runs)
    )
    scores = []
    for c in candidates:
        per_run = 0.5 * (base.by_run - c.fitted.by_run) / c.inflation
        penalty = c.gain / c.inflation - c.score
        scores.append(per_run[draws].sum(axis=1) - penalty)
    winner = np.argmax(np.array(scores), axis=0)
    return float(np.mean((winner == 0) & (scores[0] > 0.0)))


def is_close(own: Candidate, share: float, other: Candidate, wins: float) -> bool:
    """Return whether another explanation cannot be told from the named one: by score, by gain, or by resamples.

    Parameters
    ----------
    own, other : the named effect and the other
    share, wins : their shares of bootstrap resamples [1]
    """
    needed = own.rules.win_share
    if other.gain > own.rules.rival_gain_share * own.gain:
        return True
    return other.score > own.score - own.rules.rival_span or (share < needed and wins > 0.5 * (1.0 - needed))


def is_close_on_unseen_runs(evidence: Evidence, before: Misfits, own: Candidate, other: Candidate) -> bool:
    """Return whether held-out runs leave another explanation as close to the named one as the training runs do.

    Parameters
    ----------
    evidence : the runs
    before : `compute_misfit_by_run` of the held-out runs without either
    own, other : the named effect and the other
    """
    mine, its = (
        compute_misfit_falls(before, compute_misfit_by_run(evidence.held_out, c.fitted)) for c in (own, other)
    )
    # what a single run says tells no two explanations apart
    kept = 1.0 - np.eye(len(mine))
    own_fall, fall = 0.5 * kept @ mine, 0.5 * kept @ its
    rules = evidence.rules
    as_good = (fall > rules.rival_gain_share * own_fall) | (
        fall / other.inflation > own_fall / own.inflation - rules.rival_span
    )
    return bool(np.any(as_good & (2.0 * fall / other.inflation >= -rules.held_out_gain)))
