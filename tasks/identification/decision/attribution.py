"""Attribution of a residual to the effect that the model lacks: screening, refinement, gates and rivals."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tasks.campaign.campaign import SESSION
from tasks.identification.decision.screening import compute_inflation, find_look_alikes, screen_library
from tasks.identification.inference.campaign_evidence import Evidence
from tasks.identification.inference.derivatives import SECOND_SHARES
from tasks.identification.inference.fit import (
    Fit,
    compute_misfit_by_run,
    fit_hypotheses,
    sum_misfit_falls,
)
from tasks.identification.inference.hypothesis import Hypothesis, make_library_hypothesis
from tasks.identification.rules import DecisionRules

Misfits = tuple[NDArray[np.float64], NDArray[np.float64]]


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """One hypothesis, added to the accepted ones, refined and judged.

    Parameters
    ----------
    hypothesis : added hypothesis
    fitted : joint fit of it and all accepted ones; its parameters come last
    gain : rise of the log likelihood [1]
    inflation : empirical-null factor by which the gain is divided [1]
    score : gain / inflation - parameters x log N [1]
    held_out_gain : fall of the held-out marginal misfit, divided by the inflation; 0 where the score fails [1]
    cross_validated_gain : the same over training runs, each left out in turn; 0 where it decides nothing [1]
    informed : number of training runs that are sensitive to its first parameter [1]
    rules : decision rules
    """

    hypothesis: Hypothesis
    fitted: Fit
    gain: float
    inflation: float
    score: float
    held_out_gain: float
    cross_validated_gain: float
    informed: int
    rules: DecisionRules

    @property
    def pulls_session(self) -> bool:
        """Return whether the fit pulls a number of the session beyond belief."""
        return bool(np.max(self.fitted.pulls) > self.rules.retune_pull)

    @property
    def passes(self) -> bool:
        """Return whether score, test on unseen runs and bounds all hold."""
        unseen = (
            self.held_out_gain > self.rules.held_out_gain
            or self.cross_validated_gain > self.rules.cross_validated_gain
        )
        return self.is_shown and unseen

    @property
    def is_shown(self) -> bool:
        """Return whether the training runs show it, with every parameter inside its bounds."""
        return self.score > self.rules.accept_score and not self.fitted.at_bound

    @property
    def is_open(self) -> bool:
        """Return whether the training runs show it and the held-out runs neither confirm nor contradict it."""
        return self.is_shown and abs(self.held_out_gain) <= self.rules.held_out_gain


def judge_hypothesis(
    evidence: Evidence,
    base: Fit,
    base_held_out: Misfits | None,
    hypothesis: Hypothesis,
    foreseen: float = np.inf,
) -> Candidate:
    """Refine a hypothesis on top of ``base`` and judge it on training and held-out runs.

    Parameters
    ----------
    evidence : the runs
    base : fit of the hypotheses accepted so far
    base_held_out : `compute_misfit_by_run` of the held-out runs under ``base``; None if only the gain is needed
    hypothesis : hypothesis that may be added
    foreseen : gain by the linear screen; a first fit that reaches it needs no other start [1]
    """
    rules = evidence.rules
    of_session = hypothesis.names[0] in SESSION
    if of_session:
        # the session already carries the same number under a prior: hand it over to the free parameter
        hypothesis = replace(hypothesis, start=base.session[[SESSION.index(hypothesis.names[0])]])
    # Two starts: the accepted fit, which the hypothesis extends; and the linear estimate with offsets of 0, which
    # have not absorbed the effect yet.
    absent = hypothesis.start.copy()
    if hypothesis.effect_class == "form":
        absent[:] = 0.0
    elif not of_session:
        absent[0] = 0.0  # a threshold or a wind is no effect by itself
    starts = [(absent, base.offsets, base.session), (hypothesis.start, None, base.session)]
    if not of_session and np.max(base.pulls) > rules.retune_pull:
        # a session that bends to make up for what is missing holds the fit in a valley of its own
        starts.insert(0, (hypothesis.start, None, np.zeros_like(base.session)))
    trials: list[Fit] = []
    for begin, offsets, session in starts:
        trials.append(
            fit_hypotheses(
                evidence.train,
                (*base.parts, hypothesis),
                evidence.session_sigma,
                values=np.concatenate((base.values, begin)),
                session=session,
                offsets=offsets,
                # parameters that can be traded for each other are found along a valley, in more steps
                iterations=4 + 4 * len(hypothesis.names),
            )
        )
        gain = 0.5 * (base.objective - trials[-1].objective)
        # a large gain is only ranked here: the runs are linearised anew at its estimate later
        enough = rules.reached_share * foreseen if len(hypothesis.names) == 1 else np.inf
        hopeless = max(gain, foreseen) < rules.hopeful_share * rules.accept_score
        if gain > min(enough, rules.relinearisation_gain) or hopeless:
            break
    fitted = min(trials, key=lambda trial: trial.objective)
    found = assess_fit(evidence, base, base_held_out, hypothesis, fitted)
    if hypothesis.effect_class == "form" or len(hypothesis.names) == 1 or found.score <= rules.accept_score:
        return found
    others = _fit_from_second_numbers(evidence, base, hypothesis, fitted)
    best = min((fitted, *others), key=lambda trial: trial.objective)
    return found if best is fitted else assess_fit(evidence, base, base_held_out, hypothesis, best)


def _fit_from_second_numbers(evidence: Evidence, base: Fit, hypothesis: Hypothesis, fitted: Fit) -> list[Fit]:
    """Return fits of an effect of two numbers that start across the range of the second.

    The misfit has a corner wherever a run passes a threshold, and a fit ends there.
    """
    width = hypothesis.upper[1] - hypothesis.lower[1]
    firsts = (np.array([fitted.values[-2], hypothesis.lower[1] + s * width]) for s in (0.0, *SECOND_SHARES))
    return [
        fit_hypotheses(
            evidence.train, fitted.parts, evidence.session_sigma, values=np.concatenate((base.values, first)),
            session=base.session, iterations=4 + 4 * len(first),
        )
        for first in firsts
    ]  # fmt: skip


def assess_fit(
    evidence: Evidence,
    base: Fit,
    base_held_out: Misfits | None,
    hypothesis: Hypothesis,
    fitted: Fit,
) -> Candidate:
    """Judge a fit that extends ``base`` by a hypothesis.

    Parameters
    ----------
    evidence : the runs, with derivatives that hold at the fit
    base : fit of the hypotheses accepted so far
    base_held_out : `compute_misfit_by_run` of the held-out runs under ``base``; None if only the gain is needed
    hypothesis : added hypothesis; its parameters come last
    fitted : the joint fit
    """
    gain = 0.5 * (base.objective - fitted.objective)
    own = _compute_own_scores(evidence, fitted, hypothesis)
    factor = compute_own_inflation(evidence, fitted, hypothesis)
    penalty = float(len(hypothesis.names) * np.log(evidence.samples))
    if gain / factor - penalty > evidence.rules.accept_score and base_held_out is not None:
        # a fall of the misfit that the base reaches from here too is no gain of the hypothesis
        gain = min(gain, 0.5 * (_refit_base(evidence, base, hypothesis, fitted).objective - fitted.objective))
    score = gain / factor - penalty
    candidate = Candidate(
        hypothesis=hypothesis, fitted=fitted, gain=gain, inflation=factor, score=score, held_out_gain=0.0,
        cross_validated_gain=0.0, informed=len(own) or len(evidence.train), rules=evidence.rules,
    )  # fmt: skip
    if score <= evidence.rules.accept_score or base_held_out is None:
        return candidate
    fall = sum_misfit_falls(base_held_out, compute_misfit_by_run(evidence.held_out, fitted))
    return replace(candidate, held_out_gain=fall / factor)


def compute_own_inflation(evidence: Evidence, fitted: Fit, hypothesis: Hypothesis) -> float:
    """Return the factor by which the runs disagree about one part of a fit beyond their noise [1].

    Parameters
    ----------
    evidence : the runs, with derivatives that hold at the fit
    fitted : the fit
    hypothesis : part of it
    """
    return compute_inflation(evidence, fitted, _compute_own_scores(evidence, fitted, hypothesis))


def _refit_base(evidence: Evidence, base: Fit, hypothesis: Hypothesis, fitted: Fit) -> Fit:
    """Return the base, fitted again from where a fit that extends it ended."""
    session = fitted.session.copy()
    k = len(hypothesis.names)
    if hypothesis.names[0] in SESSION:
        session[SESSION.index(hypothesis.names[0])] += fitted.values[-k]
    return fit_hypotheses(
        evidence.train, base.parts, evidence.session_sigma, values=fitted.values[:-k], session=session,
        offsets=fitted.offsets, iterations=4,
    )  # fmt: skip


def _compute_own_scores(evidence: Evidence, fitted: Fit, hypothesis: Hypothesis) -> NDArray[np.float64]:
    """Return the score z of each run that is sensitive to a library effect's direction, float64 [R']."""
    names = [e.name for e in evidence.effects]
    if hypothesis.name not in names:
        return np.empty(0)
    j = names.index(hypothesis.name)
    scores = []
    for run, r in zip(evidence.train, fitted.residuals, strict=True):
        a = run.library[:, j]
        q = run.library_q[:, j]
        information = float(a @ a - q @ q)
        if information * hypothesis.step[0] ** 2 > 0.05:
            scores.append(float(a @ r - q @ run.project_on_nuisances(r)) / np.sqrt(information))
    return np.array(scores)


def refine_candidates(
    evidence: Evidence,
    base: Fit,
    count: int | None = None,
    *,
    gated: bool = True,
    also: frozenset[str] = frozenset(),
) -> list[Candidate]:
    """Return the best candidates to add to ``base``, refined and sorted by score, best first.

    Parameters
    ----------
    evidence : the runs
    base : fit of the hypotheses accepted so far
    count : number of screened effects that are refined; None takes the number of the rules
    gated : judge them on held-out runs too, and refine effects that are nearly collinear with the best
    also : names of effects that are refined whatever their linear gain
    """
    rules = evidence.rules
    gains, estimates, seconds = screen_library(evidence, base)
    held_out = compute_misfit_by_run(evidence.held_out, base) if gated else None
    hopeful = [
        int(j)
        for j in np.argsort(-gains, kind="stable")
        if gains[j] > rules.hopeful_share * rules.accept_score
    ]
    order = hopeful[: rules.refined_candidates if count is None else count]

    def judge_library_effect(j: int) -> Candidate:
        hypothesis = make_library_hypothesis(evidence.effects[j], float(estimates[j]), float(seconds[j]))
        return judge_hypothesis(evidence, base, held_out, hypothesis, float(gains[j]))

    candidates: list[Candidate] = []
    refined: list[int] = []
    for j in order:
        best_so_far = max((c.gain / c.inflation for c in candidates), default=0.0)
        if gains[j] > rules.trusted_screen_share * best_so_far:
            candidates.append(judge_library_effect(j))
            refined.append(j)
    known = {p.name for p in base.parts}
    for j, effect in enumerate(evidence.effects):
        if effect.name in also and effect.name not in known and j not in refined:
            candidates.append(judge_library_effect(j))
            refined.append(j)
    if candidates and gated:
        best = max(range(len(candidates)), key=lambda i: candidates[i].score)
        if candidates[best].score > rules.accept_score:
            near = [
                j for j in find_look_alikes(evidence, refined[best]) if j not in refined and gains[j] > 0.0
            ]
            candidates += [judge_library_effect(j) for j in near[: rules.refined_look_alikes]]
    return sorted(candidates, key=lambda c: -c.score)


def refit_without_part(base: Fit, index: int, evidence: Evidence) -> Fit:
    """Return the fit again with one accepted part left out.

    Parameters
    ----------
    base : fit with all parts
    index : position of the part to leave out
    evidence : the runs
    """
    parts = tuple(p for i, p in enumerate(base.parts) if i != index)
    sizes = [len(p.names) for p in base.parts]
    at = sum(sizes[:index])
    values = np.delete(base.values, np.arange(at, at + sizes[index]))
    return fit_hypotheses(
        evidence.train, parts, base.session_sigma, values=values, session=base.session, offsets=base.offsets,
        iterations=8,
    )  # fmt: skip
