"""Rivals of a named number on the training runs: others that explain nearly as much in its place."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tasks.identification.joint.derivatives import differentiate_run
from tasks.identification.joint.elimination import refit_numbers
from tasks.identification.joint.fit import JointFit, describe_fit
from tasks.identification.joint.numbers import JointNumber
from tasks.identification.joint.stops import Stop

FORESEEN_SHARE = 0.05
"""Share of what a substitute must make good, from which on it is fitted [1]; a fit of a late brake makes good ten times
what its derivatives foresee where no delay is free."""


@dataclass(frozen=True, kw_only=True)
class Substitute:
    """A number that explains nearly as much as a named one in its place.

    Parameters
    ----------
    of : the named number
    fitted : the fit with the substitute
    name : of the substitute
    """

    of: str
    name: str
    fitted: JointFit


def foresee_falls(
    stops: Sequence[Stop], fitted: JointFit, others: Sequence[JointNumber]
) -> NDArray[np.float64]:
    """Return by how much the cost of a fit would fall with each other number free beside it, linearly, float64 [O].

    A number moves no further than its bounds.

    Parameters
    ----------
    stops : its runs
    fitted : the fit
    others : that are not free in it
    """
    numbers = (*fitted.numbers, *others)
    values = np.append(fitted.values, np.zeros(len(others)))
    runs = [
        differentiate_run(stop, numbers, values, own, fitted.scales)
        for stop, own in zip(stops, fitted.offsets, strict=True)
    ]
    beside = describe_fit(stops, runs, numbers, values, fitted.offsets, fitted.scales, fitted.cost)
    information = np.diag([1.0 / n.sigma**2 for n in numbers])
    gradient = np.zeros(len(numbers))
    for residual, slope in zip(beside.residuals, beside.slopes, strict=True):
        weighted = slope.T / np.sqrt(1.0 + residual**2)  # as the robust loss weighs them
        information += weighted @ slope
        gradient += weighted @ residual
    falls = np.zeros(len(others))
    for i, other in enumerate(others):
        free = [*range(len(fitted.numbers)), len(fitted.numbers) + i]
        variance = np.linalg.inv(information[np.ix_(free, free)])[-1, -1]
        move = np.clip(-variance * gradient[free[-1]], other.lower, other.upper)
        falls[i] = -move * (gradient[free[-1]] + 0.5 * move / variance)
    return falls


def find_substitutes(
    stops: Sequence[Stop],
    fitted: JointFit,
    named: Sequence[JointNumber],
    everything: Sequence[JointNumber],
    share: float,
) -> list[Substitute]:
    """Return what explains nearly as much as each named number in its place.

    A number is worth what the fit loses without it. Another that makes good nearly all of that is no worse an
    explanation on these runs, whatever the likelihood of a model that is not exact says between them.

    Parameters
    ----------
    stops : training runs
    fitted : after elimination
    named : of its numbers, those in whose place others are tried
    everything : numbers that the campaign could show
    share : of what a number explains from which a substitute is as good [1]
    """
    left = {n.name for n in fitted.numbers}
    others = [n for n in everything if n.removable and n.name not in left]
    found = []
    for number in named if others else ():
        rest = tuple(n for n in fitted.numbers if n is not number)
        without = refit_numbers(stops, fitted, rest)
        worth = without.cost - fitted.cost
        for other, fall in zip(others, foresee_falls(stops, without, others), strict=True):
            if fall < FORESEEN_SHARE * share * worth:
                continue
            instead = refit_numbers(stops, without, (*rest, other), {other.name: 0.5 * other.sigma})
            if instead.cost < fitted.cost + (1.0 - share) * worth:
                found.append(Substitute(of=number.name, name=other.name, fitted=instead))
    return found
