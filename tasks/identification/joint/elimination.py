"""Backward elimination: what does not earn its place goes, the least certain first, each time with a new fit."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

from tasks.identification.joint.fit import JointFit, fit_jointly
from tasks.identification.joint.numbers import JointNumber
from tasks.identification.joint.stops import Stop

CERTAIN = 3.0
"""Standard errors from 0 from which a number is named."""
HARDLY = 1.0
"""Standard errors below which one number of each group goes in the same step."""
FEWEST_RUNS = 4
"""Runs from which their scatter says how certain a number is; with fewer, the residuals' correlation does."""
LONGEST_MEMORY = 0.98
"""Correlation from sample to sample beyond which more is not told apart [1]."""
AS_GOOD = 0.15
"""Share of what a number explains that a substitute may miss and still be as good."""


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


def standard_errors(fitted: JointFit) -> NDArray[np.float64]:
    """Return the standard error of each number, float64 [K] [unit of the table].

    Misfit of a model is no white noise. The larger of two answers is taken: the curvature widened by the residuals'
    correlation from sample to sample; and, from `FEWEST_RUNS` runs on, the jackknife over runs, linear about the fit
    (Efron 1982, doi:10.1137/1.9781611970319).

    Parameters
    ----------
    fitted : the fit
    """
    inverse = np.linalg.inv(fitted.information)
    wide = max(_lag_inflation(r) * float(np.mean(r**2)) for r in fitted.residuals)
    error = np.sqrt(np.diag(inverse) * max(wide, 1.0))
    runs = len(fitted.residuals)
    if runs < FEWEST_RUNS:
        return error
    moves = []
    for residual, slope in zip(fitted.residuals, fitted.slopes, strict=True):
        rest = fitted.information - slope.T @ slope
        moves.append(np.linalg.solve(rest, slope.T @ _softened(residual)))
    spread = np.array(moves) - np.mean(moves, axis=0)
    return np.maximum(error, np.sqrt((runs - 1) / runs * np.sum(spread**2, axis=0)))


def _softened(residual: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the residuals with the weight that the robust loss gives them."""
    return residual / np.sqrt(1.0 + residual**2)


def _lag_inflation(residual: NDArray[np.float64]) -> float:
    """Return how many samples count as one: (1 + rho) / (1 - rho) of first-order autoregressive misfit."""
    a, b = residual[1:], residual[:-1]
    power = float(residual @ residual)
    rho = min(max(float(a @ b) / power, 0.0), LONGEST_MEMORY) if power > 0.0 else 0.0
    return (1.0 + rho) / (1.0 - rho)


def quantile(fitted: JointFit) -> float:
    """Return the number of standard errors of a 95 % interval: Student's t with the runs less one.

    Parameters
    ----------
    fitted : the fit
    """
    return float(student.ppf(0.975, max(len(fitted.residuals) - 1, 2)))


def certainty(fitted: JointFit) -> NDArray[np.float64]:
    """Return by how many standard errors each number differs from the vehicle file's, float64 [K].

    Parameters
    ----------
    fitted : the fit
    """
    return np.asarray(np.abs(fitted.values) / standard_errors(fitted))


def eliminate(stops: Sequence[Stop], fitted: JointFit) -> JointFit:
    """Return the fit of what is left when every number that may go and is not certain has gone.

    Parameters
    ----------
    stops : training runs
    fitted : with every number free
    """
    while True:
        weak = _weakest(fitted)
        if not weak:
            return fitted
        fitted = refit(stops, fitted, tuple(n for n in fitted.numbers if n.name not in weak))


def _weakest(fitted: JointFit) -> set[str]:
    """Return the numbers that go next: the least certain one, and of every other group one that is hardly there."""
    sure = certainty(fitted)
    weak: dict[str, tuple[float, str]] = {}
    for number, here in zip(fitted.numbers, sure, strict=True):
        if number.removable and here < CERTAIN:
            weak[number.group] = min(weak.get(number.group, (np.inf, "")), (float(here), number.name))
    least = min(weak.values(), default=(0.0, ""))
    return {name for here, name in weak.values() if name == least[1] or here < HARDLY}


def refit(
    stops: Sequence[Stop],
    fitted: JointFit,
    numbers: tuple[JointNumber, ...],
    start: dict[str, float] | None = None,
) -> JointFit:
    """Fit other numbers from where a fit ended.

    Parameters
    ----------
    stops : its runs
    fitted : the fit
    numbers : that are free now
    start : values beside those of the fit
    """
    begin = fitted.by_name | (start or {})
    return fit_jointly(stops, numbers, [begin], scales=fitted.scales, offsets=fitted.offsets)[0]


def find_substitutes(
    stops: Sequence[Stop], fitted: JointFit, everything: Sequence[JointNumber]
) -> list[Substitute]:
    """Return what explains nearly as much as each named number in its place.

    A number is worth what the fit loses without it. Another of its group that makes good nearly all of that is no
    worse an explanation on these runs, whatever the likelihood of a model that is not exact says between them.

    Parameters
    ----------
    stops : training runs
    fitted : after elimination
    everything : numbers that the campaign could show
    """
    left = {n.name for n in fitted.numbers}
    found = []
    for number in fitted.numbers:
        others = [n for n in everything if n.group == number.group and n.name not in left]
        if not number.removable or not others:
            continue
        rest = tuple(n for n in fitted.numbers if n is not number)
        without = refit(stops, fitted, rest)
        worth = without.cost - fitted.cost
        for other in others:
            instead = refit(stops, without, (*rest, other), {other.name: 0.5 * other.sigma})
            if instead.cost < fitted.cost + AS_GOOD * worth:
                found.append(Substitute(of=number.name, name=other.name, fitted=instead))
    return found
