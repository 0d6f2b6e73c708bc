"""Linear screening of the library: gain, estimate and detectable size of its effects, and the inflation of the runs."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tasks.identification.inference.campaign_evidence import Evidence
from tasks.identification.inference.derivatives import list_second_values
from tasks.identification.inference.fit import Fit
from tasks.vehicle.effects.library import Effect
from tasks.vehicle.parameters import Vehicle


def can_show(effect: Effect, vehicle: Vehicle, channels: Sequence[str]) -> bool:
    """Return whether runs can show an effect that a vehicle lacks.

    An effect of several parameters that the vehicle has already cannot be found as a change of it. One that depends on
    slip needs a wheel speed: without one it is a lag of the car's force, and any other lag of a car with other
    equations passes for it. Of eight logs of the double-track car without an effect, speed and acceleration alone
    named three relaxation lengths. A moment that pitches the body needs a channel of the body: the loads that it moves
    from axle to axle explain a part of whatever the wheels of another car do.

    Parameters
    ----------
    effect : of the library
    vehicle : the judged vehicle
    channels : that were measured
    """
    has_already = len(effect.parameters) > 1 and any(vehicle.effects.get(p.name) for p in effect.parameters)
    sees_slip = any(name.startswith("wheel_speed") for name in channels)
    sees_pitch = any(name in channels for name in ("pitch", "pitch_rate", "vertical_acceleration"))
    pitches = effect.port == "pitch_moment" or effect.parameters[0].name == "pitch_gain"
    return not has_already and (effect.variable != "slip" or sees_slip) and (not pitches or sees_pitch)


def screen_library(
    evidence: Evidence, at: Fit
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return gain and estimate of every library effect beyond the accepted ones, by linear algebra alone.

    Parameters
    ----------
    evidence : the runs
    at : fit that holds the accepted effects

    Returns
    -------
    Gains float64 [E]; estimates of the first parameter float64 [E] [its unit]; and the value of the second parameter
    with the largest gain float64 [E] [its unit], NaN if that is its first value or if there is no second parameter.
    """
    effects = evidence.effects
    accepted = [j for j, e in enumerate(effects) if e.name in {p.name for p in at.parts}]
    tried = [(j, np.nan) for j in range(len(effects))] + list_second_values(effects)
    library, n_session = len(tried), len(evidence.session_sigma)
    gram, right = np.zeros((library + n_session,) * 2), np.zeros(library + n_session)
    several = bool(list_second_values(effects))
    for run, r in zip(evidence.train, at.residuals, strict=True):
        extra, extra_q = ((run.others,), (run.others_q,)) if several else ((), ())
        b = np.column_stack((run.library, *extra, run.session))
        q = np.column_stack((run.library_q, *extra_q, run.session_q))
        gram += b.T @ b - q.T @ q
        right += b.T @ r - q.T @ run.project_on_nuisances(r)
    others = [*accepted, *range(library, library + n_session)]
    precision = np.concatenate((np.zeros(len(accepted)), 1.0 / np.square(evidence.session_sigma)))
    right[library:] -= at.session / np.square(evidence.session_sigma)
    inner = np.linalg.inv(
        gram[np.ix_(others, others)] + np.diag(precision) + 1e-9 * np.diag(np.diag(gram)[others])
    )
    gains, estimates, seconds = np.zeros(len(effects)), np.zeros(len(effects)), np.full(len(effects), np.nan)
    for i, (j, second) in enumerate(tried):
        if j in accepted:
            continue
        cross = gram[i, others]
        information = gram[i, i] - cross @ inner @ cross
        if information <= 1e-6 * gram[i, i] or gram[i, i] <= 0.0:
            continue
        slope = right[i] - cross @ inner @ right[others]
        first = effects[j].parameters[0]
        value = min(max(slope / information, first.lower), first.upper)
        gain = value * slope - 0.5 * information * value**2
        if i == j or gain > gains[j]:
            gains[j], estimates[j], seconds[j] = gain, value, second
    return gains, estimates, seconds


def compute_inflation(evidence: Evidence, at: Fit, own: NDArray[np.float64] | None) -> float:
    """Return the factor by which the runs disagree beyond their noise [1].

    Under a correct model every run's score z in any direction is standard normal, and Q, the sum of z^2 over runs,
    equals their number on average (Cochran 1954, doi:10.2307/3001666). The null's level is the median over the
    library's directions that at least four runs inform; the direction's own Q is drawn towards it as by six more runs.

    Parameters
    ----------
    evidence : the runs
    at : fit whose residuals are used
    own : float64 [R] z of the direction itself, or None for the null's level alone
    """
    z = _compute_run_scores(evidence, at)
    count = np.sum(np.isfinite(z), axis=0)
    mean_square = np.nansum(z**2, axis=0)[count >= 4] / count[count >= 4]
    level = max(float(np.median(mean_square)), 1.0) if mean_square.size else 1.0
    if own is None or len(own) < 3:
        return level
    return max(level, (float(np.sum(own**2)) + 6.0 * level) / (len(own) - 1 + 6.0))


def find_disagreeing_runs(evidence: Evidence, at: Fit) -> list[str]:
    """Return the training runs of which the library's directions would explain something beyond noise, the most first.

    Parameters
    ----------
    evidence : the runs
    at : fit whose residuals are used
    """
    z = np.ma.masked_invalid(_compute_run_scores(evidence, at))
    typical = np.ma.median(z**2, axis=1).filled(0.0)
    return [evidence.train[i].model.run.name for i in np.argsort(-typical, kind="stable") if typical[i] > 1.0]


def _compute_run_scores(evidence: Evidence, at: Fit) -> NDArray[np.float64]:
    """Return the score of every run in every library direction, float64 [R, E]; NaN where a run says nothing of it."""
    z = np.full((len(evidence.train), len(evidence.effects)), np.nan)
    for i, (run, r) in enumerate(zip(evidence.train, at.residuals, strict=True)):
        q, qr = run.library_q, run.project_on_nuisances(r)
        information = np.einsum("ij,ij->j", run.library, run.library) - np.einsum("ij,ij->j", q, q)
        alive = information * np.array([e.parameters[0].step for e in evidence.effects]) ** 2 > 0.05
        z[i, alive] = ((run.library.T @ r - q.T @ qr) / np.sqrt(np.maximum(information, 1e-30)))[alive]
    return z


def find_look_alikes(evidence: Evidence, index: int) -> list[int]:
    """Return the library effects that the runs can hardly tell from one of them, the most alike first.

    Parameters
    ----------
    evidence : the runs
    index : position of the effect in the library
    """
    gram = _compute_information(evidence)
    length = np.sqrt(np.maximum(np.diag(gram), 1e-30))
    cosine = np.abs(gram[index]) / (length * length[index])
    least = evidence.rules.look_alike_cosine
    return [int(j) for j in np.argsort(-cosine, kind="stable") if j != index and cosine[j] > least]


def find_detectable_sizes(evidence: Evidence, base: Fit) -> dict[str, float]:
    """Return the smallest first parameter of each effect whose linear gain would pass the score gate.

    The gate is taken at the null's inflation [unit of the parameter]; infinite where the bounds exclude that size.

    Parameters
    ----------
    evidence : the runs
    base : fit without effects
    """
    level = compute_inflation(evidence, base, None)
    information = np.diag(_compute_information(evidence))
    sizes = {}
    for effect, known in zip(evidence.effects, information, strict=True):
        needed = (
            2.0 * level * (evidence.rules.accept_score + len(effect.parameters) * np.log(evidence.samples))
        )
        first = effect.parameters[0]
        size = float(np.sqrt(needed / known)) if known > 0 else np.inf
        sizes[effect.name] = size if size <= max(first.upper, -first.lower) else np.inf
    return sizes


def _compute_information(evidence: Evidence) -> NDArray[np.float64]:
    """Return what the runs say about the library's first parameters, nuisances and session projected out, [E, E]."""
    size, n_session = len(evidence.effects), len(evidence.session_sigma)
    gram, cross = np.zeros((size, size)), np.zeros((size, n_session))
    session = np.diag(1.0 / np.square(evidence.session_sigma))
    for run in evidence.train:
        gram += run.library.T @ run.library - run.library_q.T @ run.library_q
        cross += run.library.T @ run.session - run.library_q.T @ run.session_q
        session += run.session.T @ run.session - run.session_q.T @ run.session_q
    return np.asarray(gram - cross @ np.linalg.solve(session, cross.T))
