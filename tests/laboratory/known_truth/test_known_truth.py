"""A calibration on traces of known scalars: it comes back to them, and says which ones it cannot know."""

from dataclasses import replace

import numpy as np
import pytest

from catalogs.entries import load
from studies.known_truth.traces import add_errors, draw_truth, list_development_cases, make_known_cases
from tasks.identification.calibration.identifiability import DETERMINED, compute_identifiability
from tasks.identification.calibration.scalars import list_calibration_scalars, read_scalar, set_scalars
from tasks.identification.calibration.staged import calibrate_vehicle

LONGITUDINAL = {"coast_deceleration", "efficiency", "slip_stiffness"}


@pytest.fixture(scope="module")
def start():
    return load("vehicle", "paper-reference")


@pytest.fixture(scope="module")
def longitudinal():
    procedure, interval = load("calibration procedure", "paper-staged")
    stages = tuple(stage for stage in procedure.stages if set(stage.groups) <= LONGITUDINAL)
    return replace(procedure, stages=stages), 4 * interval


def fit(start, procedure, interval, names, errors):
    conditions = [case for case in list_development_cases() if case.case in names]
    truth = replace(draw_truth(start, procedure, 3), coast_deceleration=0.05)
    cases = make_known_cases(truth, conditions, procedure, interval)
    if errors:
        cases = add_errors(cases, procedure, 3)
    fitted, records = calibrate_vehicle(start, cases, procedure)
    report = compute_identifiability(fitted, cases, procedure)
    true = {s.name: read_scalar(truth, s) for s in list_calibration_scalars(start, procedure.groups)}
    return true, report, records


@pytest.mark.parametrize(
    ("errors", "within"), [pytest.param(False, 0.2, marks=pytest.mark.minutes), (True, 2.0)]
)
def test_drag_and_efficiency_come_back_where_a_stop_below_the_grip_limit_tells_them_apart(
    start, longitudinal, errors, within
):
    true, report, records = fit(
        start, *longitudinal, ("flat-dry", "flat-rain10", "flat-rain50", "flat-snow3"), errors
    )
    determined = {s.name: s for s in report.scalars if s.determined}
    assert {
        "coast_deceleration", "efficiency rain 0.347126", "efficiency rain 0.43415", "efficiency snow 0.24"
    } <= set(determined)  # fmt: skip
    for name, scalar in determined.items():
        assert abs(scalar.value - true[name]) < within * scalar.sd, name
    # no stop of these is on the knots of rain 25 and snow 1, and the brakes alone limit the dry one
    assert not {"efficiency rain 0.369279", "efficiency snow 0.42", "efficiency dry 0.82"} & set(determined)
    assert max(record.moved for record in records[-2:]) <= 1e-3


def test_drag_and_efficiency_are_confounded_where_every_stop_is_at_the_grip_limit(start, longitudinal):
    true, report, _ = fit(start, *longitudinal, ("flat-rain10", "flat-rain50"), True)
    pairs = {pair[:2] for pair in report.confounded}
    for knot in ("0.347126", "0.43415"):
        assert ("coast_deceleration", f"efficiency rain {knot}") in pairs
    # two stages that hold each other's scalars would know drag worse than its bounds do
    drag = report.scalars[0]
    assert abs(drag.value - true[drag.name]) < 2 * drag.sd < 0.1


def test_the_conditions_are_those_of_the_frozen_run():
    cases = list_development_cases()
    assert len(cases) == 19 and sum(case.hazard_height_m == 0 for case in cases) == 9
    knots = {
        (f, mu)
        for f, table in load("vehicle", "paper-reference").families.items()
        for mu in table.surface_friction
    }
    assert {(case.weather, case.surface_coefficient) for case in cases} == knots


def test_an_error_has_the_size_of_its_scale_at_each_time(start, longitudinal):
    procedure, interval = longitudinal
    conditions = [case for case in list_development_cases() if case.case == "flat-dry"]
    (case,) = make_known_cases(start, conditions, procedure, interval)
    drawn = np.array([add_errors([case], procedure, seed)[0].speed - case.speed for seed in range(400)])
    assert np.sqrt(np.mean(drawn**2, axis=0)) == pytest.approx(procedure.yardstick.scales["speed"], rel=0.15)


@pytest.mark.parametrize(("efficiency", "determined"), [(0.85, True), (0.93, False), (0.97, False)])
def test_a_scalar_is_undetermined_where_the_brakes_take_over_within_three_standard_deviations(
    start, longitudinal, efficiency, determined
):
    """At rain of 2 mm/h the brakes limit the stop from 0.95 on; below, derivatives at the value alone would do."""
    procedure, interval = longitudinal
    (scalar,) = (
        s for s in list_calibration_scalars(start, procedure.groups) if s.name == "efficiency rain 0.595585"
    )
    car = set_scalars(start, {scalar: efficiency})
    conditions = [case for case in list_development_cases() if case.case in ("flat-rain2", "flat-rain10")]
    cases = make_known_cases(car, conditions, procedure, interval)
    (known,) = (s for s in compute_identifiability(car, cases, procedure).scalars if s.name == scalar.name)
    assert known.determined == determined
    assert (known.share_of_prior < DETERMINED) == (efficiency < 0.95)
