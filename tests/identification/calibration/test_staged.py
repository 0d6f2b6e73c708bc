import dataclasses
from pathlib import Path

import numpy as np
import pytest
import yaml

from catalogs.entries import find_entry, load
from catalogs.references import read_reference
from flows.measured.agreement import agreement_of
from flows.measured.calibration import calibrate_on_traces, calibration_case
from tasks.identification.calibration.identifiability import (
    compute_staged_information,
    summarise_information,
)
from tasks.identification.calibration.jacobian import build_smoothness_rows, compute_stage_jacobian
from tasks.identification.calibration.scalars import list_calibration_scalars, read_scalar
from tasks.identification.calibration.staged import StageRecord, accept_jointly, compute_joint_loss, run_stage
from tasks.identification.calibration.staged import calibrate_vehicle as run_stages


def compute_fisher(rows: np.ndarray) -> np.ndarray:
    """Information of residuals and of a prior of standard deviation 1, written out."""
    return rows.T @ rows + np.eye(rows.shape[1])


def procedure_file(folder: Path, base: str, stages: list[dict], passes: int = 2) -> str:
    entry = yaml.safe_load(find_entry("calibration procedure", base).read_text())
    entry["stages"] = stages
    entry["passes"]["value"] = passes
    path = folder / "procedure.yaml"
    path.write_text(yaml.safe_dump(entry))
    return str(path)


def stage(groups, responses, kinds=("flat",), phase="braking"):
    return {
        "name": " and ".join(groups), "groups": list(groups), "responses": list(responses), "kinds": list(kinds),
        "phase": phase,
    }  # fmt: skip


def cases_of(folder, vehicle, procedure, interval):
    reference = read_reference(folder)
    rows = agreement_of(vehicle, reference, procedure.mode)["cases"]
    return [
        calibration_case(
            case, columns, row["window"], interval, procedure.yardstick.start_s, vehicle.wheelbase
        )
        for (case, columns), row in zip(reference, rows, strict=True)
    ]


def test_known_tyre_and_pitch_values_come_back_from_noisy_traces(vehicle, make_traces, changed, tmp_path):
    truth = dataclasses.replace(vehicle, static_pitch=np.deg2rad(0.3))
    for group, rain, snow in (
        ("efficiency", 0.90, 1.03),
        ("slip_stiffness", 1.4, 1.25),
        ("pitch_scale", 1.05, 1.2),
    ):
        truth = changed(changed(truth, "rain", group, 2, rain), "snow", group, 1, snow)
    folder = make_traces(truth, "paper")
    name = procedure_file(
        tmp_path,
        "paper-staged",
        [
            stage(["efficiency", "slip_stiffness"], ["speed", "slip"]),
            stage(["static_pitch", "pitch_scale"], ["pitch"]),
        ],
    )
    procedure, interval = load("calibration procedure", name)
    fitted, records = run_stages(vehicle, cases_of(folder, vehicle, procedure, interval), procedure)
    assert np.rad2deg(fitted.static_pitch) == pytest.approx(0.3, abs=0.01)
    for family, knot in (("rain", 2), ("snow", 1)):
        found, true = fitted.families[family], truth.families[family]
        assert found.efficiency[knot] == pytest.approx(true.efficiency[knot], abs=0.004)
        assert found.slip_stiffness[knot] == pytest.approx(true.slip_stiffness[knot], rel=0.04)
        assert found.pitch_scale[knot] == pytest.approx(true.pitch_scale[knot], abs=0.02)
    assert all(record.after <= record.before for record in records)


def test_effects_of_the_coupled_mode_come_back_from_noisy_traces(vehicle, make_traces, tmp_path):
    effects = {"rolling_coefficient": 0.02, "slope_moment": 1.5, "anti_dive": 0.3}
    truth = dataclasses.replace(vehicle, effects=effects)
    folder = make_traces(truth, "coupled", ("wet", "bump"))
    every = ("flat", "hump")
    name = procedure_file(
        tmp_path, "coupled-grown", [stage(list(effects), ["speed", "pitch", "wheel_load"], every, "event")]
    )
    procedure, interval = load("calibration procedure", name)
    fitted, _ = run_stages(vehicle, cases_of(folder, vehicle, procedure, interval), procedure)
    assert fitted.effects["rolling_coefficient"] == pytest.approx(0.02, abs=0.002)
    assert fitted.effects["slope_moment"] == pytest.approx(1.5, abs=0.1)
    assert fitted.effects["anti_dive"] == pytest.approx(0.3, abs=0.03)


@pytest.mark.parametrize(("upper_deg", "named"), [(0.2, ("static_pitch",)), (2.0, ())])
def test_a_scalar_that_rests_on_a_bound_is_named(vehicle, make_traces, tmp_path, upper_deg, named):
    folder = make_traces(dataclasses.replace(vehicle, static_pitch=np.deg2rad(0.3)), "paper")
    name = procedure_file(tmp_path, "paper-staged", [stage(["static_pitch"], ["pitch"])])
    procedure, interval = load("calibration procedure", name)
    bound = dataclasses.replace(procedure.bounds["static_pitch"], upper=np.deg2rad(upper_deg))
    bounded = dataclasses.replace(procedure, bounds=procedure.bounds | {"static_pitch": bound})
    _, record = run_stage(vehicle, cases_of(folder, vehicle, bounded, interval), bounded.stages[0], bounded)
    assert record.at_bounds == named


def test_a_scalar_to_which_no_run_answers_stays_where_it_was(vehicle, make_traces):
    procedure, interval = load("calibration procedure", "paper-staged")
    efficiency = next(s for s in procedure.stages if "efficiency" in s.groups)
    cases = cases_of(make_traces(vehicle, "paper"), vehicle, procedure, interval)
    fitted, _ = run_stage(vehicle, cases, efficiency, procedure)
    assert fitted.families["dry"].efficiency == vehicle.families["dry"].efficiency
    assert fitted.families["rain"].efficiency[0] == pytest.approx(
        vehicle.families["rain"].efficiency[0], abs=1e-9
    )


def test_an_unseen_scalar_goes_to_the_value_about_which_the_prior_lies(vehicle, make_traces, changed):
    procedure, interval = load("calibration procedure", "paper-staged")
    efficiency = next(s for s in procedure.stages if "efficiency" in s.groups)
    cases = cases_of(make_traces(vehicle, "paper", ("wet",)), vehicle, procedure, interval)
    moved = changed(vehicle, "dry", "efficiency", 0, 1.1)
    fitted, _ = run_stage(moved, cases, efficiency, procedure, prior=vehicle)
    assert fitted.families["dry"].efficiency[0] == pytest.approx(
        vehicle.families["dry"].efficiency[0], abs=1e-4
    )
    kept, _ = run_stage(moved, cases, efficiency, procedure)
    assert kept.families["dry"].efficiency[0] == pytest.approx(1.1, abs=1e-9)


def test_the_sparse_jacobian_is_that_of_differences_of_every_case(vehicle, make_traces):
    procedure, interval = load("calibration procedure", "paper-staged")
    slip = next(s for s in procedure.stages if s.groups == ("slip_stiffness",))
    cases = cases_of(make_traces(vehicle, "paper"), vehicle, procedure, interval)
    scalars = list_calibration_scalars(vehicle, slip.groups)
    x = np.array([read_scalar(vehicle, s) for s in scalars])
    jacobian = compute_stage_jacobian(vehicle, cases, slip, procedure, scalars, x)
    touched = [
        name for name, column in zip([s.name for s in scalars], jacobian.T, strict=True) if column.any()
    ]
    assert touched == ["slip_stiffness rain 0.43415", "slip_stiffness snow 0.42"]
    wet = len(jacobian) - np.flatnonzero(jacobian[:, 6])[0]
    assert 0 < wet < len(jacobian)
    assert not jacobian[-wet:, 3].any()


def test_neighbouring_knots_of_a_family_are_held_together_and_no_others(vehicle):
    procedure, _ = load("calibration procedure", "coupled-grown")
    rows = build_smoothness_rows(
        list_calibration_scalars(vehicle, ("efficiency", "slip_stiffness")), procedure
    )
    pairs = [tuple(np.flatnonzero(row)) for row in rows]
    assert pairs == [(1, 2), (2, 3), (3, 4), (5, 6), (6, 7)]
    assert np.allclose(rows.sum(axis=1), 0)


def test_confounded_and_unseen_scalars_are_named():
    scalars = [
        dataclasses.replace(s)
        for s in list_calibration_scalars(
            _any_vehicle(), ("hold_ratio", "coupled_pitch_scale", "static_pitch")
        )
    ]
    rng = np.random.Generator(np.random.Philox(key=[3, 0]))
    a = rng.normal(size=200)
    jacobian = np.stack([a, a + 1e-3 * rng.normal(size=200), np.zeros(200)], axis=1)
    units, widths = ["1", "1", "rad"], np.full(3, np.sqrt(12.0))
    report = summarise_information(compute_fisher(jacobian), scalars, np.zeros(3), units, widths)
    assert [pair[:2] for pair in report.confounded] == [("hold_ratio", "coupled_pitch_scale")]
    assert report.confounded[0][2] < -0.99
    unseen = report.scalars[2]
    assert (unseen.determined, unseen.sd) == (False, pytest.approx(1.0))
    # alone each is known to 1 / |a|
    assert report.scalars[0].sd_alone == pytest.approx(1 / np.sqrt(1 + a @ a))
    assert report.scalars[0].sd > 0.5


def test_stages_that_hold_each_others_scalars_know_less_than_a_joint_fit():
    """Monte Carlo of the stages' own equations is the oracle of the closed form."""
    rng = np.random.Generator(np.random.Philox(key=[11, 0]))
    first, second = rng.normal(size=(30, 3)), rng.normal(size=(20, 3))
    owned = [np.array([True, True, False]), np.array([False, False, True])]
    covariance = np.linalg.inv(compute_staged_information([first, second], owned))
    draws = 20000
    x = prior = rng.normal(size=(3, draws))
    noises = rng.normal(size=(30, draws)), rng.normal(size=(20, draws))
    for _ in range(25):
        for rows, own, noise in zip((first, second), owned, noises, strict=True):
            held = noise - rows[:, ~own] @ x[~own]
            normal = rows[:, own].T @ rows[:, own] + np.eye(own.sum())
            x = x.copy()
            x[own] = np.linalg.solve(normal, rows[:, own].T @ held + prior[own])
    assert np.cov(x) == pytest.approx(covariance, abs=0.03 * np.diag(covariance).max())
    joint = np.linalg.inv(compute_fisher(np.vstack([first, second])))
    assert (np.diag(covariance) > np.diag(joint)).all()
    alone = compute_staged_information([first], [np.array([True] * 3)])
    assert alone == pytest.approx(compute_fisher(first))


def test_a_stage_is_taken_as_far_as_all_cases_together_are_no_worse(vehicle, make_traces):
    procedure, interval = load("calibration procedure", "paper-staged")
    truth = dataclasses.replace(vehicle, static_pitch=np.deg2rad(0.3))
    cases = cases_of(make_traces(truth, "paper", ("wet",), noise=0.0), vehicle, procedure, interval)
    record = StageRecord(stage="any", turn=0, before=2.0, after=1.0, moved=0.4, at_bounds=())
    start = vehicle.static_pitch

    def accept(target):
        after = dataclasses.replace(vehicle, static_pitch=target)
        return accept_jointly(vehicle, after, record, cases, procedure)

    to_truth, taken = accept(truth.static_pitch)
    assert (to_truth.static_pitch, taken.accepted) == (pytest.approx(truth.static_pitch), 1.0)
    too_far, taken = accept(start + 5 * (truth.static_pitch - start))
    assert (taken.accepted, taken.moved) == (0.25, pytest.approx(0.1))
    assert compute_joint_loss(too_far, cases, procedure) < compute_joint_loss(vehicle, cases, procedure)
    away, taken = accept(start - 0.01)
    assert away == vehicle and (taken.accepted, taken.moved, taken.after) == (0.0, 0.0, record.before)


def test_the_same_traces_give_the_same_bytes(vehicle, make_traces, tmp_path):
    folder = make_traces(vehicle, "paper", ("wet",))
    name = procedure_file(tmp_path, "paper-staged", [stage(["efficiency"], ["speed"])], passes=1)
    files = []
    for run in ("one", "two"):
        calibrate_on_traces(str(folder), out=str(tmp_path / run), procedure=name, name="car")
        files.append([(tmp_path / run / file).read_bytes() for file in ("car.yaml", "calibration.json")])
    assert files[0][0] == files[1][0]
    assert files[0][1].replace(b"/one/", b"/two/") == files[1][1]


def _any_vehicle():

    return load("vehicle", "paper-reference")
