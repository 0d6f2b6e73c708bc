"""The curve of a route is scipy's cubic Hermite spline, to the last bit."""

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline

from tasks.scene.hermite import make_cubic_curve


@pytest.mark.parametrize("count", [2, 3, 400])
def test_points_and_slopes_are_scipys_to_the_last_bit(count):
    rng = np.random.default_rng(count)
    knots = np.concatenate(([0.0], np.cumsum(rng.uniform(0.05, 3.0, count - 1))))
    points, slopes = rng.normal(scale=50.0, size=(count, 3)), rng.normal(size=(count, 3))
    inner = rng.uniform(0.0, knots[-1], 2000)
    at = np.concatenate((inner, knots, [-0.5, knots[-1] + 0.5]))
    curve, theirs = make_cubic_curve(knots, points, slopes), CubicHermiteSpline(knots, points, slopes)
    assert np.array_equal(curve.evaluate(at), theirs(at))
    assert np.array_equal(curve.differentiate(at), theirs(at, 1))
