"""A brake gain that the file hardly knows is found first, and left free while single effects are looked for."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from catalogs.decision_rules import load_decision_rules
from catalogs.effects import load_effects
from catalogs.joint_numbers import load_joint_numbers
from tasks.campaign.campaign import CHANNELS, SESSION, Campaign, Run
from tasks.identification.decision.calibrated import tell_calibrated
from tasks.identification.decision.disputes import ForeignCarError
from tasks.identification.inference.fit import Fit
from tasks.identification.inference.linearisation import prepare_evidence
from tasks.identification.inference.quantiles import NORMAL_QUANTILE
from tasks.identification.joint.calibration import calibrate_gain
from tasks.vehicle.effects.table import build_parameter_vector
from tests.identification.synthetic import SURFACE, TOLERANCES, VEHICLE, measured, plain_run

RULES = load_decision_rules()
HARDLY = replace(TOLERANCES, session=(0.2, *TOLERANCES.session[1:]))
SPEED, ACCELERATION = CHANNELS.index("speed"), CHANNELS.index("longitudinal_acceleration")
SEEN = np.isin(np.arange(len(CHANNELS)), (SPEED, ACCELERATION))


@cache
def make_runs(gain: float) -> tuple[Run, ...]:
    theta = build_parameter_vector({"pressure_gain": gain})
    runs = []
    for i, (speed, pressure) in enumerate(((27.0, 1.2), (20.0, 2.0), (24.0, 1.6))):
        run = measured(plain_run(speed, pressure, name=f"run-{i}"), theta, i).run
        runs.append(
            replace(run, pressure=run.pressure[:250], response=np.where(SEEN, run.response, 0.0)[:250])
        )
    return tuple(runs)


def make_campaign(runs: tuple[Run, ...], tolerances=HARDLY) -> Campaign:
    held_out = replace(runs[0], held_out=True)
    return Campaign(
        name="stops", vehicle="paper-reference", runs=(*runs, held_out), tolerances=tolerances, content_hash="",
        split_hash="", channels=("speed", "longitudinal_acceleration"),
    )  # fmt: skip


def calibrate_campaign(campaign: Campaign) -> dict[str, tuple[float, float]]:
    return calibrate_gain(campaign, VEHICLE, SURFACE, load_joint_numbers(), RULES.joint)


def test_a_gain_that_the_file_knows_is_left_to_its_tolerance():
    assert calibrate_campaign(make_campaign(make_runs(0.0), TOLERANCES)) == {}


@pytest.mark.parametrize("gain", [-0.3, 0.4])
def test_a_gain_far_from_the_files_is_found_and_refined_beside_the_mass(gain):
    campaign = make_campaign(make_runs(gain))
    hardly_known = calibrate_campaign(campaign)
    assert hardly_known["pressure_gain"][0] == pytest.approx(gain, abs=0.03)
    evidence, null = prepare_evidence(campaign, VEHICLE, SURFACE, load_effects()[:1], RULES, hardly_known)
    place = SESSION.index("pressure_gain")
    assert evidence.session_sigma[place] > 1.0
    assert null.session[place] == pytest.approx(gain, abs=4.0 * null.session_error[place])
    assert 0.0005 < null.session_error[place] < 0.02
    assert abs(null.session[SESSION.index("mass")]) < 1e-3
    known, _ = prepare_evidence(
        replace(campaign, tolerances=TOLERANCES), replace(VEHICLE, brake_gain=(1.0 + gain) * VEHICLE.brake_gain),
        SURFACE, load_effects()[:1], RULES,
    )  # fmt: skip
    for wide, sharp in zip(evidence.train, known.train, strict=True):
        slope, expected = wide.session[:, place], sharp.session[:, place] / (1.0 + gain)
        assert slope == pytest.approx(expected, abs=0.05 * np.abs(expected).max()), (
            "a wide prior is no wide step"
        )


def test_a_car_that_no_gain_makes_the_models_is_left_to_the_joint_fit():
    def shake_speed(run: Run) -> Run:
        response = run.response.copy()
        response[:, SPEED] += (
            0.5 * np.sin(4.0 * run.interval * np.arange(len(response))) * (run.pressure > 0.0)
        )
        return replace(run, response=response)

    with pytest.raises(ForeignCarError, match="the speed misses by"):
        calibrate_campaign(make_campaign(tuple(shake_speed(run) for run in make_runs(0.0))))


@pytest.mark.parametrize(("gain", "is_wrong"), [(0.5, False), (0.7, True)])
def test_a_calibrated_gain_is_wrong_beyond_as_many_tolerances_as_the_rules_say(gain, is_wrong):
    session, error = np.zeros(7), np.full(7, 0.01)
    session[SESSION.index("pressure_gain")] = gain
    fitted = Fit(
        parts=(), values=np.empty(0), session=session, session_sigma=np.ones(7), objective=0.0, by_run=np.zeros(1),
        covariance=np.empty((0, 0)), session_error=error, residuals=(), offsets=(),
    )  # fmt: skip
    hardly_known = {"pressure_gain": (0.4, 2.0), "mass": (0.0, 1e-5)}
    within, wrong = tell_calibrated(fitted, load_effects(), hardly_known, HARDLY, RULES)
    (told,) = wrong if is_wrong else within
    assert not (within if is_wrong else wrong)
    assert told.name == "retuned_pressure_gain"
    (number,) = told.parameters
    reach = NORMAL_QUANTILE * np.hypot(0.01, 0.01 * (1.0 + gain))  # of the fit, and of the mass that was held
    assert (number.ci_low, number.value, number.ci_high) == pytest.approx((gain - reach, gain, gain + reach))
