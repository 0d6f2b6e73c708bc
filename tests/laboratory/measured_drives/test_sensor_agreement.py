"""Agreement of two sensors of one motion, from a recording long enough to show it."""

import numpy as np
import pytest

from studies.measured_drives.sensor_agreement import measure_sensor_agreement


@pytest.mark.parametrize("seconds", [4.0, 5.9, 6.1, 20.0])
def test_a_recording_of_little_more_than_its_ends_shows_no_agreement(seconds: float) -> None:
    t = np.arange(round(100 * seconds)) * 0.01
    columns = {
        "speed": 15.0 + np.sin(t), "longitudinal_acceleration": np.cos(t), "pitch": np.sin(2 * t),
        "pitch_rate": 2.0 * np.cos(2 * t),
    }  # fmt: skip
    found = measure_sensor_agreement(columns, 0.01)
    assert (found is not None) == (seconds > 6.0)
    assert found is None or found.rate_of_pitch_gain == pytest.approx(1.0, abs=0.1)
