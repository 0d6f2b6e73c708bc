"""Tyre curve, slip, pressure profile and ABS: golden values, properties, and the NumPy twin."""

from dataclasses import replace
from math import inf

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from studies.peers import reference
from tasks.errors import InputError
from tasks.vehicle.brake import (
    BrakeCommand,
    compute_abs_command,
    compute_brake_pressure,
    find_onset_by_position,
    limit_abs_rate,
)
from tasks.vehicle.effects.table import pack_effect_values
from tasks.vehicle.model.axle_ports import compute_lock_share, compute_signed_friction, compute_signed_slip
from tasks.vehicle.parameters import compute_surface_response
from tasks.vehicle.tyres.contract import compute_braking_slip, compute_tyre_friction, compute_tyre_slope

SURFACES = [("dry", 0.82), ("rain", 0.347126), ("rain", 0.5), ("snow", 0.24), ("snow", 0.51)]
LOAD = 8e3


@pytest.mark.parametrize(("family", "friction"), SURFACES)
def test_the_tyre_peaks_at_mu_eff_at_the_target_slip(vehicle, family, friction):
    tyre = compute_surface_response(vehicle, family, friction).tyre
    assert compute_tyre_friction(tyre.target_slip, LOAD, tyre) == pytest.approx(tyre.peak, rel=1e-12)
    assert compute_tyre_slope(tyre.target_slip, LOAD, tyre) == pytest.approx(
        0, abs=1e-12 * tyre.rise * tyre.decay
    )
    slips = np.linspace(0, 1, 2001)
    assert max(compute_tyre_friction(slip, LOAD, tyre) for slip in slips) <= tyre.peak


def test_target_slips_are_those_of_the_base_curves_over_the_slip_stiffness(vehicle):
    """ln(c1 c2 / c3) / c2: 0.170 dry, 0.131 wet, 0.060 snow; beta 1.65 dry, 1 elsewhere (Appendix B and C)."""
    targets = [
        compute_surface_response(vehicle, *surface).tyre.target_slip
        for surface in (SURFACES[0], SURFACES[1], SURFACES[3])
    ]
    np.testing.assert_allclose(targets, [0.17007 / 1.65, 0.13090, 0.05992], atol=1e-4)


@pytest.mark.parametrize(("family", "friction"), SURFACES)
def test_tyre_agrees_with_its_twin(vehicle, family, friction):
    response = compute_surface_response(vehicle, family, friction)
    slips = np.linspace(-1, 1, 101)
    plain = pack_effect_values({})
    kernel = [compute_signed_friction(slip, LOAD, 0.0, response.tyre, plain) for slip in slips]
    np.testing.assert_allclose(
        kernel, reference.compute_reference_friction(slips, vehicle, family, response), atol=1e-6
    )


def test_tyre_slope_is_the_derivative(vehicle):
    tyre = compute_surface_response(vehicle, "rain", 0.4).tyre
    for slip in (0.0, 0.01, 0.1, 0.5):
        numeric = (
            compute_tyre_friction(slip + 1e-6, LOAD, tyre) - compute_tyre_friction(slip - 1e-6, LOAD, tyre)
        ) / 2e-6
        assert compute_tyre_slope(slip, LOAD, tyre) == pytest.approx(numeric, rel=1e-5, abs=1e-6)


def test_tables_are_linear_between_knots_and_clamped_and_flagged_outside(vehicle):
    """Rain knots 0.347126 and 0.369279: eta 0.9278 and 0.9320, gamma 1.133213 and 1.129315."""
    middle = compute_surface_response(vehicle, "rain", (0.347126 + 0.369279) / 2)
    assert middle.tyre.peak == pytest.approx(0.9299 * 0.3582025)
    assert middle.pitch_scale == pytest.approx(1.131264)
    assert not middle.extrapolated
    slippery = compute_surface_response(vehicle, "rain", 0.30)
    assert slippery.tyre.peak == pytest.approx(0.9278 * 0.30)
    assert slippery.pitch_scale == 1.133213
    assert slippery.extrapolated and compute_surface_response(vehicle, "rain", 0.7).extrapolated


@pytest.mark.parametrize("knot", [0.34712605, 0.595585, 0.5955852])
def test_a_knot_that_differs_only_by_its_printed_rounding_is_calibrated(vehicle, knot):
    assert not compute_surface_response(vehicle, "rain", knot).extrapolated


def test_paper_slip_is_clipped_and_coupled_slip_is_signed():
    assert compute_braking_slip(10.0, 9.0, 0.5) == compute_signed_slip(10.0, 9.0, 0.5) == pytest.approx(0.1)
    assert compute_braking_slip(10.0, 11.0, 0.5) == 0.0 and compute_signed_slip(
        10.0, 11.0, 0.5
    ) == pytest.approx(-0.1)
    assert compute_braking_slip(0.1, 0.0, 0.5) == pytest.approx(0.2)
    assert compute_signed_slip(1.0, 5.0, 0.5) == -1.0


def test_pressure_ramps_holds_and_falls():
    profile = BrakeCommand(
        peak_pressure_mpa=2.0, ramp_s=0.5, onset_s=1.0, onset_station_m=None, hold_s=1.0, release_s=0.25
    ).profile
    times = [-0.1, 0.0, 0.25, 0.5, 1.5, 1.5625, 1.75, 9.0]
    assert [compute_brake_pressure(t, profile) for t in times] == [0, 0, 1, 2, 2, 1.5, 0, 0]


@pytest.mark.parametrize("hold", [None, 1.0])
def test_an_instant_ramp_and_release_are_steps(hold):
    profile = BrakeCommand(
        peak_pressure_mpa=2.0, ramp_s=0.0, onset_s=0.0, onset_station_m=None, hold_s=hold, release_s=0.0
    ).profile
    assert compute_brake_pressure(0.0, profile) == 2.0
    assert compute_brake_pressure(1.5, profile) == (2.0 if hold is None else 0.0)


def test_a_position_trigger_is_timed_between_samples():
    profile = BrakeCommand(
        peak_pressure_mpa=1.0, ramp_s=0.1, onset_s=None, onset_station_m=12.0, hold_s=None, release_s=0.0
    ).profile
    assert find_onset_by_position(0.7, 11.9, 10.0, profile) == inf
    assert find_onset_by_position(0.7, 12.005, 10.0, profile) == pytest.approx(0.6995)


def test_all_that_is_wrong_with_a_brake_command_is_said_at_once():
    with pytest.raises(InputError) as error:
        BrakeCommand(
            peak_pressure_mpa=-1.0,
            ramp_s=float("nan"),
            onset_s=-1.0,
            onset_station_m=inf,
            hold_s=None,
            release_s=0.1,
        )
    assert [problem.split()[1] for problem in error.value.problems] == [
        "peak_pressure_mpa", "ramp_s", "onset_s", "onset_station_m",
    ]  # fmt: skip
    for onsets in ({"onset_s": None, "onset_station_m": None}, {"onset_s": 1.0, "onset_station_m": 5.0}):
        with pytest.raises(InputError, match="exactly one of onset_s and onset_station_m"):
            BrakeCommand(peak_pressure_mpa=1.0, ramp_s=0.1, hold_s=None, release_s=0.0, **onsets)


def test_coasting_needs_no_onset():
    profile = BrakeCommand(
        peak_pressure_mpa=0.0, ramp_s=0.5, onset_s=None, onset_station_m=None, hold_s=None, release_s=0.0
    ).profile
    assert profile.onset_time == profile.onset_station == inf


def test_abs_lets_all_through_below_the_target_and_nothing_a_width_above():
    assert compute_abs_command(0.0, 0.1, 0.2) == 1.0
    assert compute_abs_command(0.1, 0.1, 0.2) == pytest.approx(1.0)
    assert compute_abs_command(0.11, 0.1, 0.2) == pytest.approx(0.5)
    assert compute_abs_command(0.12, 0.1, 0.2) == pytest.approx(0.0, abs=1e-12)
    assert compute_abs_command(0.5, 0.1, 0.2) == 0.0


@given(st.floats(0, 1), st.floats(0, 1))
def test_large_abs_rates_give_the_algebraic_rule_exactly(command, before):
    assert limit_abs_rate(command, before, 500.0, 500.0) == command


@given(st.floats(0, 1), st.floats(0, 1), st.floats(0, 0.1), st.floats(0, 0.1))
def test_abs_changes_no_faster_than_its_rates(command, before, build, release):
    after = limit_abs_rate(command, before, build, release)
    assert before - release <= after <= before + build
    assert min(command, before) <= after <= max(command, before)


@given(st.floats(0, 0.5), st.floats(0, 1), st.floats(1, 200), st.floats(1, 200))
def test_abs_agrees_with_the_paper_form_of_its_rate_limit(vehicle, slip, before, build, release):
    slow = replace(vehicle, abs_build_rate=build, abs_release_rate=release)
    response = compute_surface_response(slow, "rain", 0.4)
    wanted = compute_abs_command(slip, response.tyre.target_slip, slow.abs_release_width)
    twin = reference.compute_abs_scale(np.array([slip]), np.array([before]), 5e-4, slow, response)
    assert limit_abs_rate(wanted, before, build * 5e-4, release * 5e-4) == pytest.approx(twin[0], abs=1e-12)


def test_brake_friction_fades_only_around_a_standing_wheel():
    assert (
        compute_lock_share(10.0, 0.05) == 1.0
        and compute_lock_share(0.0, 0.05) == 0.0
        and compute_lock_share(-1.0, 0.05) == -1.0
    )
    assert compute_lock_share(0.025, 0.05) == 0.5
