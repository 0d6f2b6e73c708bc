"""The decision: what is missing, how sure, and what it does to the error on runs that no fit has seen."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from tasks.closure.attribution import (
    ACCEPT_SCORE,
    HELD_OUT_GAIN,
    RIVAL_SPAN,
    WIN_SHARE,
    Candidate,
    Evidence,
    inflation,
    judge,
    ladder,
    nested,
    win_share,
    without,
)  # fmt: skip
from tasks.closure.campaign import CHANNEL_UNITS, CHANNELS, SESSION, Campaign, Run
from tasks.closure.evidence import Disturbance, RunEvidence, fit_disturbance, run_evidence, with_disturbance
from tasks.closure.fit import Fit, compose, fit, library_hypothesis, misfit_by_run
from tasks.closure.forms import form_hypotheses, scan
from tasks.closure.forward import Slot, predict, run_model
from tasks.closure.noise import channel_noise
from tasks.surface.state import SurfaceParameters
from tasks.vehicle.effects.library import ALL_PARAMETERS, Effect
from tasks.vehicle.parameters import Vehicle

VerdictName = Literal["FOUND", "SET", "UNKNOWN_FORM", "RETUNE", "SENSOR", "NOTHING"]
MAX_EFFECTS = 3
RETUNE_PULL = 4.0
"""Pull of a session nuisance, in prior sigmas, from which it is called a wrong number of the vehicle."""
RETUNE_WIDENING = 10.0
"""Factor on the session's tolerances when a model is re-tuned without any new effect."""
WORSE_LIMIT = 1.05
ERROR_DRAWS = 1000


@dataclass(frozen=True, kw_only=True)
class Parameter:
    """An estimated parameter with its 95 % interval and bounds [unit]."""

    name: str
    value: float
    ci_low: float
    ci_high: float
    lower: float
    upper: float
    unit: str


@dataclass(frozen=True, kw_only=True)
class NamedEffect:
    """An effect of the verdict or a rival of one.

    Parameters
    ----------
    name, effect_class, port, variable : as in the library, or of the form found
    parameters : estimates
    score : gain / inflation - parameters x log N, beyond the other effects
    gain, inflation, held_out_gain, win_share : what the score is made of and the gates it met
    """

    name: str
    effect_class: str
    port: str
    variable: str
    parameters: tuple[Parameter, ...]
    score: float
    gain: float
    inflation: float
    held_out_gain: float
    win_share: float


@dataclass(frozen=True, kw_only=True)
class ChannelError:
    """RMSE of one channel over the held-out runs: as delivered, re-tuned, and with the effects.

    Parameters
    ----------
    frozen, retuned, after : RMSE [unit]
    ci_low, ci_high : 95 % bootstrap interval over runs of ``after`` [unit]
    change_low, change_high : the same of after minus frozen, paired [unit]
    wins : held-out runs in which ``after`` is below ``frozen``
    worst_run : the run with the largest ``after``
    """

    frozen: float
    retuned: float
    after: float
    ci_low: float
    ci_high: float
    change_low: float
    change_high: float
    wins: int
    worst_run: str
    unit: str


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """What `attribute` concludes.

    Parameters
    ----------
    verdict : the kind of answer
    effects : the effects named, in the order found
    rivals : effects that cannot be told from the named ones, with the effect each rivals
    tried : best candidates of the last round that were not accepted
    error : by channel, on held-out runs
    session_pulls : session nuisances in prior sigmas, before and after
    noise : AR(1) coefficient and sigma by channel
    disturbance : scales and times of the smooth disturbances
    detectable : by library effect, the smallest value of its first parameter that would be named
    campaign, content_hash, split_hash : what was read
    theta : float64 full parameter vector of the effects, without session nuisances
    slots : tables of the forms found
    reasons : sentences that say why the answer is what it is
    """

    verdict: VerdictName
    effects: tuple[NamedEffect, ...]
    rivals: tuple[tuple[str, NamedEffect], ...]
    tried: tuple[NamedEffect, ...]
    error: dict[str, ChannelError]
    session_pulls: dict[str, tuple[float, float]]
    noise: dict[str, tuple[float, float]]
    disturbance: Disturbance
    detectable: dict[str, float]
    campaign: str
    content_hash: str
    split_hash: str
    theta: NDArray[np.float64]
    slots: tuple[Slot, ...]
    reasons: tuple[str, ...]


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
    evidence, rho, sigma, disturbance = prepare(campaign, vehicle, surface, effects)
    null = fit(evidence.train, (), evidence.session_sigma, iterations=6)
    progress("search")
    base, rounds, tried, reasons = _search(evidence, null)
    if not rounds:
        base, rounds = _retuned(evidence, null, reasons)
    progress("left over")
    base, rounds, near_forms = _forms(evidence, null, base, rounds, reasons)
    progress("rivals")
    named, near = _rivals(evidence, base, rounds) if rounds else ([], [])
    near = [*near, *near_forms]
    error = held_out_error(evidence, null, base)
    kind = _kind(named, near)
    worse = [name for name, e in error.items() if e.after > WORSE_LIMIT * e.frozen and e.change_low > 0.0]
    if named and worse:
        # the marginal likelihood can buy a fit with disturbances; prediction of unseen runs cannot be bought
        reasons.append(
            f"{', '.join(e.name for e in named)} would fit, but predicts {', '.join(worse)} of the held-out runs"
            " worse than the frozen model: not named"
        )
        kind, base = "NOTHING", null
        tried, named, near = [r.accepted for r in rounds], [], []
        error = held_out_error(evidence, null, null)
    if kind == "SET":
        reasons.append(
            f"{len(near)} other explanation(s) lie within {RIVAL_SPAN:g} units or win too many resamples"
        )
    if kind == "NOTHING" and not rounds:
        reasons.append("no candidate passes the score, held-out and bound gates together")
    theta, slots = compose(base.parts, base.values, np.zeros(len(SESSION)))
    pulls = {
        name: (float(a), float(b))
        for name, a, b in zip(
            SESSION, null.session / evidence.session_sigma, base.session / evidence.session_sigma, strict=True
        )
    }
    return Verdict(
        verdict=kind,
        effects=tuple(named),
        rivals=tuple(near),
        tried=tuple(_named(c, 0.0) for c in tried[:6]),
        error=error,
        session_pulls=pulls,
        noise={name: (float(r), float(s)) for name, r, s in zip(CHANNELS, rho, sigma, strict=True)},
        disturbance=disturbance,
        detectable=_detectable(evidence, base),
        campaign=campaign.name,
        content_hash=campaign.content_hash,
        split_hash=campaign.split_hash,
        theta=theta,
        slots=slots,
        reasons=tuple(reasons),
    )


def prepare(
    campaign: Campaign, vehicle: Vehicle, surface: SurfaceParameters, effects: tuple[Effect, ...]
) -> tuple[Evidence, NDArray[np.float64], NDArray[np.float64], Disturbance]:
    """Noise, derivatives and disturbance scales; arguments as in `attribute`."""
    rho, sigma = channel_noise(campaign)
    plain = np.zeros(len(ALL_PARAMETERS))
    guess = Disturbance()

    def derived(runs: tuple[Run, ...], library: tuple[Effect, ...]) -> tuple[RunEvidence, ...]:
        return tuple(
            run_evidence(
                run_model(run, vehicle, surface), rho, sigma, plain, library, campaign.tolerances, guess
            )
            for run in runs
        )

    train, held_out = derived(campaign.train, effects), derived(campaign.held_out, ())
    residuals = [run.residual(plain) for run in train]
    disturbance = fit_disturbance(train, residuals, campaign.tolerances, effects, guess)
    return (
        Evidence(
            train=tuple(with_disturbance(run, campaign.tolerances, disturbance) for run in train),
            held_out=tuple(with_disturbance(run, campaign.tolerances, disturbance) for run in held_out),
            effects=effects,
            session_sigma=np.array(campaign.tolerances.session),
        ),
        rho,
        sigma,
        disturbance,
    )


def held_out_error(evidence: Evidence, null: Fit, base: Fit) -> dict[str, ChannelError]:
    """RMSE by channel on held-out runs under the frozen, the re-tuned and the grown model.

    Parameters
    ----------
    evidence : the runs
    null : fit without effects, where re-tuning starts
    base : fit with the accepted effects
    """
    retuned = fit(
        evidence.train, (), RETUNE_WIDENING * evidence.session_sigma, session=null.session, iterations=8
    )
    square = np.zeros((3, len(evidence.held_out), len(CHANNELS)))
    for i, run in enumerate(evidence.held_out):
        for j, (theta, slots) in enumerate(
            (
                (np.zeros(len(ALL_PARAMETERS)), ()),
                compose((), np.empty(0), retuned.session),
                compose(base.parts, base.values, base.session),
            )
        ):
            square[j, i] = np.mean((run.model.measured - predict(run.model, theta, slots=slots)) ** 2, axis=0)
    draws = np.random.Generator(np.random.Philox(0)).integers(
        0, square.shape[1], (ERROR_DRAWS, square.shape[1])
    )
    errors = {}
    for c, (name, unit) in enumerate(zip(CHANNELS, CHANNEL_UNITS, strict=True)):
        frozen, tuned, after = np.sqrt(square[:, :, c].mean(axis=1))
        resampled = np.sqrt(square[:, draws, c].mean(axis=2))
        low, high = np.percentile(resampled[2], (2.5, 97.5))
        change = np.percentile(resampled[2] - resampled[0], (2.5, 97.5))
        errors[name] = ChannelError(
            frozen=float(frozen), retuned=float(tuned), after=float(after), ci_low=float(low), ci_high=float(high),
            change_low=float(change[0]), change_high=float(change[1]),
            wins=int(np.sum(square[2, :, c] < square[0, :, c])),
            worst_run=evidence.held_out[int(np.argmax(square[2, :, c]))].model.run.name, unit=unit,
        )  # fmt: skip
    return errors


@dataclass(frozen=True, kw_only=True)
class Round:
    """One round of the search: what was tried on top of ``base`` and which candidate was accepted."""

    base: Fit
    tried: tuple[Candidate, ...]
    accepted: Candidate


def _search(evidence: Evidence, null: Fit) -> tuple[Fit, list[Round], list[Candidate], list[str]]:
    base, reasons = null, []
    rounds: list[Round] = []
    tried: list[Candidate] = []
    for _ in range(MAX_EFFECTS):
        tried = ladder(evidence, base)
        passing = [c for c in tried if c.passes]
        if not passing:
            break
        best = passing[0]
        if tried[0] is not best:
            reasons.append(
                f"{tried[0].hypothesis.name} scores higher than {best.hypothesis.name} but fails a gate"
            )
        simpler = [
            c for c in passing if nested(c.hypothesis, best.hypothesis) and c.score > best.score - RIVAL_SPAN
        ]
        best = simpler[0] if simpler else best
        rounds.append(Round(base=base, tried=tuple(tried), accepted=best))
        base = best.fitted
    return base, rounds, tried, reasons


def _retuned(evidence: Evidence, null: Fit, reasons: list[str]) -> tuple[Fit, list[Round]]:
    """A session nuisance pulled beyond belief is a wrong number in the vehicle and not a doubt about the session."""
    pulls = np.abs(null.session / evidence.session_sigma)
    worst = int(np.argmax(pulls))
    if pulls[worst] <= RETUNE_PULL:
        return null, []
    effect = next(
        e for e in evidence.effects
        if e.parameters[0].name == SESSION[worst] and len(e.parameters) == 1
    )  # fmt: skip
    found = judge(
        evidence,
        null,
        misfit_by_run(evidence.held_out, null),
        library_hypothesis(effect, float(null.session[worst])),
    )
    gained = float(
        np.sum(misfit_by_run(evidence.held_out, null) - misfit_by_run(evidence.held_out, found.fitted))
    )
    found = replace(found, held_out_gain=gained / found.inflation)
    reasons.append(f"session nuisance {SESSION[worst]} is pulled by {pulls[worst]:.1f} sigma")
    if found.held_out_gain <= HELD_OUT_GAIN:
        return null, []
    return found.fitted, [Round(base=null, tried=(), accepted=found)]


def _forms(
    evidence: Evidence, null: Fit, base: Fit, rounds: list[Round], reasons: list[str]
) -> tuple[Fit, list[Round], list[tuple[str, NamedEffect]]]:
    """Look for forms outside the library: alone against all that was named, and in what the named leave over."""
    near: list[tuple[str, NamedEffect]] = []
    if rounds:
        alone = _best_form(evidence, null)
        ahead = -np.inf
        if alone is not None and alone.passes:
            # a form has no direction of its own to be judged by, so both sides take the larger inflation
            common = max(alone.inflation, *(r.accepted.inflation for r in rounds))
            log_n = float(np.log(evidence.samples))
            extra = len(alone.hypothesis.names) - sum(len(r.accepted.hypothesis.names) for r in rounds)
            ahead = (alone.gain - sum(r.accepted.gain for r in rounds)) / common - extra * log_n
        if alone is not None and ahead > RIVAL_SPAN:
            reasons.append(f"a form alone explains more than the library: {alone.hypothesis.name}")
            base, rounds = alone.fitted, [Round(base=null, tried=(), accepted=alone)]
        elif alone is not None and ahead > -RIVAL_SPAN:
            first = rounds[0].accepted.hypothesis
            if alone.hypothesis.port != first.port:
                near.append((first.name, _named(alone, 0.0)))
    if len(rounds) < MAX_EFFECTS:
        left = _best_form(evidence, base)
        if left is not None and left.passes:
            reasons.append(f"something is left over: {left.hypothesis.name}")
            rounds = [*rounds, Round(base=base, tried=(), accepted=left)]
            base = left.fitted
    return base, rounds, near


def _best_form(evidence: Evidence, base: Fit) -> Candidate | None:
    leftovers = [x for x in scan(evidence, base)[:2] if x.gain > ACCEPT_SCORE + np.log(evidence.samples)]
    if not leftovers:
        return None
    held_out = misfit_by_run(evidence.held_out, base)
    judged = [
        judge(evidence, base, held_out, h) for x in leftovers for h in form_hypotheses(x, evidence.samples)
    ]
    return max(judged, key=lambda c: c.score)


def _rivals(
    evidence: Evidence, base: Fit, rounds: list[Round]
) -> tuple[list[NamedEffect], list[tuple[str, NamedEffect]]]:
    named, near = [], []
    for i, found in enumerate(rounds):
        rest, own, tried = found.base, found.accepted, found.tried
        if i + 1 < len(rounds):
            # what was accepted later may change how this effect compares with its rivals
            rest = without(base, i, evidence)
            at = sum(len(p.names) for p in base.parts[:i])
            part = replace(base.parts[i], start=base.values[at : at + len(base.parts[i].names)])
            own = judge(evidence, rest, misfit_by_run(evidence.held_out, rest), part)
            tried = tuple(ladder(evidence, rest)) if own.hypothesis.effect_class != "form" else ()
        others = [c for c in tried if c.hypothesis.name != own.hypothesis.name]
        share = win_share([own, *others], rest)
        named.append(_named(own, share))
        for c in others:
            wins = win_share([c, own, *[o for o in others if o is not c]], rest)
            close = c.score > own.score - RIVAL_SPAN or (share < WIN_SHARE and wins > 0.5 * (1.0 - WIN_SHARE))
            if close and not nested(own.hypothesis, c.hypothesis) and c.score > 0.0:
                near.append((own.hypothesis.name, _named(c, wins)))
    return named, near


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


def _named(candidate: Candidate, share: float) -> NamedEffect:
    h = candidate.hypothesis
    k = len(h.names)
    values = candidate.fitted.values[-k:]
    sigma = np.sqrt(np.maximum(np.diag(candidate.fitted.covariance)[-k:], 0.0) * candidate.inflation)
    return NamedEffect(
        name=h.name,
        effect_class=h.effect_class,
        port=h.port,
        variable=h.variable,
        parameters=tuple(
            Parameter(
                name=n, value=float(v), ci_low=float(v - 1.96 * s), ci_high=float(v + 1.96 * s), lower=float(lo),
                upper=float(hi), unit=u,
            )
            for n, v, s, lo, hi, u in zip(h.names, values, sigma, h.lower, h.upper, h.units, strict=True)
        ),
        score=candidate.score,
        gain=candidate.gain,
        inflation=candidate.inflation,
        held_out_gain=candidate.held_out_gain,
        win_share=share,
    )  # fmt: skip


def _detectable(evidence: Evidence, base: Fit) -> dict[str, float]:
    """Smallest first parameter whose linear gain would pass the score gate, at the level of the null's inflation."""
    level = inflation(evidence, base, None)
    needed = 2.0 * level * (25.0 + np.log(evidence.samples))
    library = np.zeros((len(evidence.effects),) * 2)
    cross = np.zeros((len(evidence.effects), len(SESSION)))
    session = np.diag(1.0 / np.square(evidence.session_sigma))
    for run in evidence.train:
        q = run.library_q
        library += run.library.T @ run.library - q.T @ q
        cross += run.library.T @ run.session - q.T @ run.session_q
        session += run.session.T @ run.session - run.session_q.T @ run.session_q
    information = np.diag(library) - np.einsum("ij,jk,ik->i", cross, np.linalg.inv(session), cross)
    return {
        e.name: float(np.sqrt(needed / i)) if i > 0 else float("inf")
        for e, i in zip(evidence.effects, information, strict=True)
    }
