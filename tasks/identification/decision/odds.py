"""Odds of explanations: the evidence of every set of candidates from one small matrix a run.

About a linearisation point the misfit of run i is m_i - 2 b_i'x + x'H_i x, with the run's offsets and disturbances
integrated out. With Gaussian priors the evidence of an explanation is a determinant and a quadratic form (MacKay 1992,
doi:10.1162/neco.1992.4.3.415). What differs from run to run in the direction of an explanation is a random effect: its
variance is that of DerSimonian and Laird (1986, doi:10.1016/0197-2456(86)90046-2), and runs that disagree count less.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from tasks.identification.decision.candidates import Candidate, Columns
from tasks.identification.decision.random_effects import Prior, integrate_columns, weigh_columns

ALONG_ROAD = {"longitudinal_force", "brake_torque"}
"""Ports whose forces a car feels alike."""
PORT_OF_NUMBER = {
    "retuned_pressure_gain": "brake_torque", "retuned_pitch_gain": "pitch_moment",
    "retuned_suspension_damping": "suspension_force", "retuned_suspension_stiffness": "suspension_force",
    "retuned_friction_level": "friction", "retuned_wet_friction": "friction", "retuned_snow_friction": "friction",
    "retuned_grade": "longitudinal_force",
}  # fmt: skip
"""Port at which a number of the vehicle's file acts."""
SAME_VARIABLE = {"speed": "wheel_speed", "wheel_speed": "speed"}
"""Variables that differ by the slip of the tyres alone."""


@dataclass(frozen=True, kw_only=True)
class RunGrams:
    """What the runs say about all columns, about a linearisation point.

    Parameters
    ----------
    information : float64 [R, C, C] of every run, its offsets and disturbances integrated out
    score : float64 [R, C] the same of its residual
    centre : float64 [C] values of the columns' numbers about which it is linearised
    columns : meaning of the columns
    """

    information: NDArray[np.float64]
    score: NDArray[np.float64]
    centre: NDArray[np.float64]
    columns: Columns

    @cached_property
    def total(self) -> NDArray[np.float64]:
        """Return the information of all runs, float64 [C, C]."""
        return np.asarray(self.information.sum(axis=0))

    @cached_property
    def total_score(self) -> NDArray[np.float64]:
        """Return the score of all runs, float64 [C]."""
        return np.asarray(self.score.sum(axis=0))

    @cached_property
    def nobody(self) -> Prior:
        """Return the prior of the numbers that belong to every explanation, none of them named."""
        return _arrange(self, ())[0]

    @cached_property
    def plain(self) -> float:
        """Return the log evidence of the explanation without a member [1]."""
        own = self.nobody.columns
        return float(integrate_columns(self.total[np.ix_(own, own)], self.total_score[own], self.nobody)[2])


@dataclass(frozen=True, kw_only=True)
class Explanation:
    """A set of candidates with what the runs say about it.

    Parameters
    ----------
    members : the candidates; none is the model with its small errors alone
    log_odds : logarithm of the odds against no member, priors included [1]
    gain : rise of the log likelihood against no member, without spread of the runs [1]
    values : float64 [K] of each member's columns, one after the other [their units]
    errors : float64 [K] their standard deviations
    spreads : standard deviation from run to run of each member, over its size [1]
    everything : float64 [C] mean of every column's number where the gain is taken, without spread of the runs; 0 where
        it takes no part
    """

    members: tuple[Candidate, ...]
    log_odds: float
    gain: float
    values: NDArray[np.float64]
    errors: NDArray[np.float64]
    spreads: tuple[float, ...]
    everything: NDArray[np.float64]

    @property
    def names(self) -> tuple[str, ...]:
        """Return the names of the members."""
        return tuple(member.name for member in self.members)

    def find_numbers(self, member: Candidate) -> slice:
        """Return where a member's numbers stand in ``values``.

        Parameters
        ----------
        member : one of the members
        """
        at = 0
        for other in self.members:
            if other is member:
                break
            at += len(other.columns)
        return slice(at, at + len(member.columns))


def weigh_explanation(
    grams: RunGrams, members: Sequence[Candidate], *, spread: bool = True
) -> Explanation | None:
    """Return what the runs say about an explanation; None where a number would lie beyond its bounds.

    Parameters
    ----------
    grams : of the runs
    members : of the explanation
    spread : count what differs from run to run
    """
    prior, own, begins = _arrange(grams, members)
    runs = (grams.information, grams.score, grams.total, grams.total_score)
    mean, values, errors, spreads, evidence, with_spread = weigh_columns(
        runs, prior, grams.nobody, own, begins, spread
    )
    bounds = [(m.lower, m.upper) for m in members for _ in m.columns]
    if any(not low - 1e-12 <= x <= high + 1e-12 for x, (low, high) in zip(values, bounds, strict=True)):
        return None
    everything = np.zeros(grams.columns.count)
    everything[prior.columns] = mean
    gain = evidence - grams.plain
    if np.isnan(with_spread):
        with_spread = gain
    return Explanation(
        members=tuple(members), log_odds=with_spread + sum(m.log_prior for m in members), gain=gain, values=values,
        errors=errors, spreads=tuple(spreads.tolist()), everything=everything,
    )  # fmt: skip


def compute_likelihood(grams: RunGrams, explanation: Explanation) -> float:
    """Return the log likelihood of the runs at an explanation's numbers, less that at the linearisation point [1].

    Parameters
    ----------
    grams : of the runs
    explanation : its numbers
    """
    used = np.flatnonzero(explanation.everything != 0.0)
    moved = (explanation.everything - grams.centre)[used]
    return float(grams.total_score[used] @ moved - 0.5 * moved @ grams.total[np.ix_(used, used)] @ moved)


def search_explanations(
    grams: RunGrams, *, most: int, width: int, spread: bool = True, forms: bool = True
) -> list[Explanation]:
    """Return explanations of up to some members, the best first; no member at all is always among them.

    Sets grow by one candidate at a time from the best of those before (beam search).

    Parameters
    ----------
    grams : of the runs
    most : members of an explanation
    width : sets of each size that grow further
    spread : count what differs from run to run
    forms : try forms too
    """
    found: dict[tuple[int, ...], Explanation | None] = {(): weigh_explanation(grams, ())}
    beam: list[tuple[int, ...]] = [()]
    candidates = grams.columns.candidates
    seen = np.einsum("rii->i", grams.information)  # of all runs
    shown = [
        j
        for j, c in enumerate(candidates)
        if float(seen[list(c.columns)].max()) * c.slab**2 > 1.0 and (forms or c.base >= 0)
    ]
    for _ in range(most):
        grown: dict[tuple[int, ...], Explanation] = {}
        for known in beam:
            for j in shown:
                candidate, key = candidates[j], tuple(sorted((*known, j)))
                if key in grown or any(_exclude_each_other(candidate, candidates[i]) for i in known):
                    continue
                weighed = weigh_explanation(grams, [candidates[i] for i in key], spread=spread)
                if weighed is not None:
                    grown[key] = weighed
        found |= grown
        beam = sorted(grown, key=lambda key: -grown[key].log_odds)[:width]
    return sorted((e for e in found.values() if e is not None), key=lambda e: -e.log_odds)


def _exclude_each_other(one: Candidate, other: Candidate) -> bool:
    """Whether two candidates are the same number, two forms, or a form and what it can stand for."""
    if one.base >= 0 and other.base >= 0:
        return one.base == other.base
    if one.base < 0 and other.base < 0:
        return True
    form, known = (one, other) if one.base < 0 else (other, one)
    return can_stand_for(form, known)


def can_stand_for(form: Candidate, known: Candidate) -> bool:
    """Return whether a form can take the place of an effect or number: it acts where that does, by the same variable.

    What holds the car back at its wheels and what holds its body back are one force along the road, and a number of
    the file is a constant at its port.

    Parameters
    ----------
    form : the form
    known : of the library
    """
    port = PORT_OF_NUMBER.get(known.name, known.port)
    at_port = form.port == port or {form.port, port} <= ALONG_ROAD
    return at_port and known.variable in (form.variable, "constant", SAME_VARIABLE.get(form.variable))


def keep_members(explanation: Explanation, members: Sequence[Candidate]) -> Explanation:
    """Return an explanation with some of its members alone, at the same values.

    Parameters
    ----------
    explanation : with all members
    members : those that are kept
    """
    indices = [explanation.find_numbers(m) for m in explanation.members]
    kept = [
        (m, s, c)
        for m, s, c in zip(explanation.members, indices, explanation.spreads, strict=True)
        if m in members
    ]
    take = np.concatenate(
        [np.empty(0, dtype=np.int64), *(np.arange(s.start, s.stop) for _, s, _ in kept)]
    ).astype(int)
    return replace(
        explanation, members=tuple(m for m, *_ in kept), values=explanation.values[take],
        errors=explanation.errors[take], spreads=tuple(c for *_, c in kept),
    )  # fmt: skip


def _arrange(
    grams: RunGrams, members: Sequence[Candidate]
) -> tuple[Prior, NDArray[np.int64], NDArray[np.int64]]:
    """Return the columns of an explanation: those of every number, and those of its members instead or besides.

    Beside them stand the places of the members' numbers among these columns, and where each member's own begin.
    """
    base = grams.columns
    columns, deviations, centre = base.base.copy(), base.spike.copy(), grams.centre[base.base].copy()
    further: list[int] = []
    wide: list[float] = []
    own: list[int] = []
    begins = [0]
    for member in members:
        if member.base < 0:
            own += range(len(columns) + len(further), len(columns) + len(further) + len(member.columns))
            further += member.columns
            wide += [member.slab] * len(member.columns)
        else:
            (columns[member.base],), deviations[member.base] = member.columns, member.slab
            centre[member.base] = grams.centre[member.columns[0]]
            own.append(member.base)
        begins.append(len(own))
    prior = Prior(
        columns=np.concatenate((columns, np.array(further, dtype=np.int64))),
        precision=np.concatenate((deviations, wide)) ** -2.0,
        centre=np.concatenate((centre, grams.centre[further])),
    )
    return prior, np.array(own, dtype=np.int64), np.array(begins)
