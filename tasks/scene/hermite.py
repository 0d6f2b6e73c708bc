"""A smooth curve through points with given tangents."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, kw_only=True)
class CubicCurve:
    """Cubics between knots (de Boor 1978, A Practical Guide to Splines, ch. IV).

    The same bits as `scipy.interpolate.CubicHermiteSpline`, whose import takes a tenth of a worker's start.

    Parameters
    ----------
    knots : float64 [M] strictly increasing, M >= 2
    terms : float64 [4, M-1, D] coefficients from the cubic term to the constant one, in the distance from the knot
    """

    knots: NDArray[np.float64]
    terms: NDArray[np.float64]

    def evaluate(self, at: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the points of the curve, float64 [N, D].

        Parameters
        ----------
        at : float64 [N], in the unit of the knots; beyond them the outer cubics go on
        """
        (cubic, square, linear, constant), step = self._find_terms(at)
        return constant + linear * step + square * (step * step) + cubic * (step * step * step)

    def differentiate(self, at: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the slopes of the curve, float64 [N, D].

        Parameters
        ----------
        at : float64 [N], in the unit of the knots; beyond them the outer cubics go on
        """
        (cubic, square, linear, _), step = self._find_terms(at)
        return linear + square * step * 2.0 + cubic * (step * step) * 3.0

    def _find_terms(self, at: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        piece = np.clip(np.searchsorted(self.knots, at, side="right") - 1, 0, len(self.knots) - 2)
        return self.terms[:, piece], (at - self.knots[piece])[:, None]


def make_cubic_curve(
    knots: NDArray[np.float64], points: NDArray[np.float64], slopes: NDArray[np.float64]
) -> CubicCurve:
    """Return the cubics with these points and slopes at the knots.

    Parameters
    ----------
    knots : float64 [M] strictly increasing, M >= 2
    points, slopes : float64 [M, D]
    """
    width = np.diff(knots)[:, None]
    chord = np.diff(points, axis=0) / width
    bend = (slopes[:-1] + slopes[1:] - 2 * chord) / width
    terms = np.stack((bend / width, (chord - slopes[:-1]) / width - bend, slopes[:-1], points[:-1]))
    return CubicCurve(knots=knots, terms=terms)
