"""The sensor: exposure doubles the light, noise has the variance of its electrons, and neither is there unasked."""

import numpy as np
import pytest

from catalogs.entries import load
from tasks.render.sensor import Sensor, apply_sensor

GREY = np.full((200, 300, 3), 0.25, np.float32)


def test_a_plain_sensor_leaves_the_picture_alone():
    assert apply_sensor(GREY, Sensor(), 1, 0) is GREY
    assert load("camera", "dashcam-480x320").sensor == Sensor()


def test_a_step_of_exposure_doubles_the_light():
    np.testing.assert_array_equal(apply_sensor(GREY, Sensor(exposure_ev=1.0), 1, 0), 2 * GREY)


@pytest.mark.parametrize("level", [0.02, 0.25, 0.9])
def test_noise_has_the_variance_of_photons_and_reading(level):
    sensor = Sensor(full_well=5000, read_noise=8)
    noisy = apply_sensor(np.full_like(GREY, level), sensor, 3, 7).astype(np.float64)
    assert noisy.mean() == pytest.approx(level, abs=4 * noisy.std() / np.sqrt(noisy.size))
    expected = (5000 * level + 8**2) / 5000**2
    # the variance of N draws is known to sqrt(2 / N), here half a percent
    assert noisy.var() == pytest.approx(expected, rel=0.02)


def test_noise_follows_seed_and_frame_alone():
    sensor = Sensor(full_well=5000, read_noise=8)
    first = apply_sensor(GREY, sensor, 3, 7)
    assert np.array_equal(first, apply_sensor(GREY, sensor, 3, 7))
    assert not np.array_equal(first, apply_sensor(GREY, sensor, 3, 8))
    assert not np.array_equal(first, apply_sensor(GREY, sensor, 4, 7))


def test_light_beyond_the_well_is_cut_off():
    noisy = apply_sensor(np.full_like(GREY, 3.0), Sensor(full_well=5000), 1, 0)
    assert noisy.mean() == pytest.approx(1.0, abs=1e-3)


def test_the_noisy_camera_of_the_catalogue_differs_in_its_sensor_only():
    plain, noisy = load("camera", "dashcam-480x320"), load("camera", "dashcam-480x320-noisy")
    assert noisy.sensor == Sensor(full_well=10_000, read_noise=5)
    assert np.array_equal(plain.K, noisy.K) and np.array_equal(plain.T_rig_camera, noisy.T_rig_camera)
