"""The recursion is scipy's filter, to the last bit."""

import numpy as np
import pytest
from scipy.signal import lfilter

from tasks.identification.inference.recursion import filter_recursively


@pytest.mark.parametrize("shape", [(1,), (700,), (300, 5)])
@pytest.mark.parametrize("keep", [0.0, 0.3, 0.97])
def test_the_recursion_is_scipys_filter_to_the_last_bit(shape, keep):
    driven = np.random.default_rng(3).normal(size=shape)
    before = driven.copy()
    assert np.array_equal(filter_recursively(driven, keep), lfilter([1.0], [1.0, -keep], driven, axis=0))
    assert np.array_equal(driven, before)
