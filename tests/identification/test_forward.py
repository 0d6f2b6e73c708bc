"""A run in the model: what its measured inputs do, and by what its prediction misses the samples."""

from dataclasses import replace

import numpy as np
import pytest

from tasks.campaign.campaign import CHANNELS
from tasks.identification.inference.forward import predict_channels, prepare_run
from tasks.vehicle.effects.table import build_parameter_vector
from tests.identification.synthetic import SURFACE, VEHICLE, plain_run


@pytest.mark.parametrize("mass", [0.0, 0.3])
def test_a_measured_slope_acts_as_a_grade_of_the_session_does_whatever_the_mass(mass: float):
    run = plain_run(20.0, 1.0)
    slope = np.full(len(run.pressure), np.arctan(0.05))
    theta = build_parameter_vector({"mass": mass})
    measured = predict_channels(prepare_run(replace(run, road_slope=slope), VEHICLE, SURFACE), theta)
    felt = replace(run, felt_slope=float(slope[0]))
    assert np.array_equal(predict_channels(prepare_run(felt, VEHICLE, SURFACE), theta), measured)
    # what was measured counts before what the accelerometer feels
    both = replace(run, road_slope=slope, felt_slope=-0.1)
    assert np.array_equal(predict_channels(prepare_run(both, VEHICLE, SURFACE), theta), measured)
    graded = predict_channels(
        prepare_run(run, VEHICLE, SURFACE), build_parameter_vector({"mass": mass, "slope": 0.05})
    )
    # the force of a grade in the model is that of its tangent, and acts on each of the three bodies
    for name, tolerance in (("speed", 0.01), ("longitudinal_acceleration", 0.01)):
        place = CHANNELS.index(name)
        np.testing.assert_allclose(measured[:, place], graded[:, place], atol=tolerance)


def test_a_prediction_misses_a_slow_channel_at_its_samples_alone():
    """A speed at every tenth instant, linear between them, of a car that slows down ever faster."""
    run = plain_run(20.0, 1.0)
    count = len(run.response)
    exact, sampled = np.zeros((2, count, 7)), np.ones((count, 7), dtype=bool)
    exact[:, :, 0] = 20.0 - 1e-4 * np.arange(count) ** 2
    exact[1, :, 0] += 0.5
    rows = np.arange(0, count, 10)
    sampled[:, 0] = np.isin(np.arange(count), rows)
    response = np.zeros((count, 7))
    response[:, 0] = np.interp(np.arange(count), rows, exact[0, rows, 0])
    model = prepare_run(replace(run, response=response, sampled=sampled), VEHICLE, SURFACE)
    error = model.compute_square_error(exact[:, : model.samples])
    assert error[:, 0] == pytest.approx([0.0, 0.25], abs=1e-12)
    dense = replace(model, run=replace(model.run, sampled=None))
    assert dense.compute_square_error(exact[:, : model.samples])[0, 0] > 1e-7
