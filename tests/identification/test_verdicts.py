"""Every kind of verdict, from whole campaigns of known truth made unlike the model that judges them."""

from dataclasses import replace

import numpy as np
import pytest

from catalogs.decision_rules import load_decision_rules
from catalogs.effects import load_effects
from catalogs.effects.truths import load_truths
from catalogs.studies.closing import load_closing_study
from catalogs.surfaces import load_surface
from catalogs.vehicles import load_vehicle
from tasks.campaign.campaign import CHANNELS
from tasks.campaign.planned_runs import RICH, RunPlan, make_planned_run, plan_experiments
from tasks.identification.benchmark import make_synthetic_campaign
from tasks.identification.decision import discovery, experiment
from tasks.identification.decision.answer import Verdict
from tasks.identification.decision.disputes import ForeignCarError
from tasks.identification.decision.screening import can_show
from tasks.identification.decision.verdict import find_missing_effects
from tasks.identification.inference.forward import predict_channels, prepare_run
from tasks.identification.rules import DecisionRules
from tasks.vehicle.effects.forms import Form
from tasks.vehicle.effects.table import build_parameter_vector
from tasks.vehicle.parameters import Vehicle

VEHICLE, SURFACE = load_vehicle("paper-reference"), load_surface("dense-asphalt")
LIBRARY = {
    effect.name: effect
    for effect in load_effects()
    if effect.name in {
        "aerodynamic_drag", "brake_lag", "pad_drag", "retuned_pressure_gain", "rolling_resistance",
        "sensor_gravity_leak",
    }
}  # fmt: skip
"""One or two for each verdict and what may be taken for them: all 55 take ten times as long."""
LEAN = (
    RunPlan(speed=32.0, peak=0.0, duration=2.5), RunPlan(speed=14.0, peak=0.0, duration=2.5),
    RunPlan(speed=25.0, peak=2.0, disc_rise=350.0, duration=2.5), RunPlan(speed=26.4, peak=-2.4, duration=2.5),
    RunPlan(speed=13.9, peak=2.3, duration=2.0), RunPlan(weather="rain", rate=10.0, speed=20.0, peak=2.3, duration=2.0),
    RunPlan(weather="snow", rate=1.0, speed=9.7, peak=0.6, duration=2.0),
    RunPlan(speed=11.1, peak=0.0, duration=2.0, hazard=(12.0, 3.7, 0.075)),
    RunPlan(speed=9.7, peak=0.0, duration=2.0, hazard=(10.0, 2.0, -0.08)),
    RunPlan(speed=25.0, peak=0.0, duration=2.5), RunPlan(speed=22.2, peak=2.6, disc_rise=250.0, duration=2.0),
    RunPlan(speed=8.9, peak=0.8, duration=2.0, hazard=(9.0, 3.7, 0.05)),
)  # fmt: skip
"""Every port is excited by nine training runs; three are held out."""
LEVEL = tuple(plan for plan in LEAN if plan.hazard[1] == 0.0 and plan.weather == "dry")
"""Those that show what brakes, air and instruments do: five for training, two held out."""
BUMPS = (*LEAN[2:5], *LEAN[7:9], LEAN[10], LEAN[11])
"""Those that show what the suspension does: five for training, two held out."""
OUTSIDE = {truth.name: truth for truth in load_truths() if not truth.in_library}


RULES = load_decision_rules()


def judged(
    values: dict[str, float],
    *,
    seed: int = 31,
    vehicle: Vehicle = VEHICLE,
    driven: Vehicle = VEHICLE,
    outside: str | None = None,
    design: tuple[RunPlan, ...] = LEAN,
    rules: DecisionRules = RULES,
    first_experiment: int = -1,
    hardly_known: dict[str, tuple[float, float]] | None = None,
    brake_rest: float = 0.0,
) -> Verdict:
    """The verdict on a campaign; to weigh every planned run takes as long as all that comes before it."""
    slots = OUTSIDE[outside].slots if outside else ()
    campaign = make_synthetic_campaign(driven, SURFACE, values, seed, slots=slots, design=design)
    last = 3 * len(design) // 4
    runs = tuple(replace(run, held_out=number >= last) for number, run in enumerate(campaign.runs))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(experiment, "plan_experiments", lambda gain: plan_experiments(gain)[first_experiment:])
        return find_missing_effects(
            replace(campaign, runs=runs, brake_rest=brake_rest), vehicle, SURFACE, tuple(LIBRARY.values()), rules,
            hardly_known=hardly_known or {},
        ).verdict  # fmt: skip


def names(verdict: Verdict) -> list[str]:
    return [effect.name for effect in verdict.effects]


def test_a_number_off_beyond_its_tolerance_is_a_retune() -> None:
    verdict = judged({"pressure_gain": 0.12}, design=LEVEL)
    assert (verdict.verdict, names(verdict)) == ("RETUNE", ["retuned_pressure_gain"])
    (gain,) = verdict.effects[0].parameters
    assert gain.ci_low < 0.12 < gain.ci_high
    speed = verdict.error["speed"]
    assert speed.retuned < 1.1 * speed.after < speed.frozen, (
        "six tolerances are within a re-tuned session's reach"
    )


@pytest.mark.minutes
def test_an_effect_is_found_beside_a_gain_that_the_file_hardly_knows() -> None:
    verdict = judged(
        {"pressure_gain": 0.3, "lag": 0.08}, design=LEVEL,
        hardly_known={"pressure_gain": (0.25, 2.0), "mass": (0.0, 1e-5)},
    )  # fmt: skip
    assert (verdict.verdict, names(verdict)) == ("FOUND", ["brake_lag", "retuned_pressure_gain"])
    (lag,), (gain,) = (effect.parameters for effect in verdict.effects)
    assert lag.ci_low < 0.08 < lag.ci_high and lag.ci_high - lag.ci_low < 0.02
    assert gain.ci_low < 0.3 < gain.ci_high and gain.ci_high - gain.ci_low < 0.08


def test_a_named_effect_about_which_the_runs_disagree_is_left_to_the_joint_fit() -> None:
    with pytest.raises(ForeignCarError, match="disagree about brake_lag by a factor of"):
        judged({"lag": 0.08}, design=BUMPS, rules=replace(RULES, disputed_inflation=0.5))


class TestRunsThatDisagreeUntilAFormIsInTheModel:
    """Pitch that depends on deceleration: no effect of the library, and pitch along the road is none to a joint fit."""

    DISAGREEING = replace(RULES, foreign_inflation=1.5)

    def test_the_form_is_named(self) -> None:
        verdict = judged({}, outside="pitch_by_deceleration", rules=self.DISAGREEING)
        (form,) = verdict.effects
        assert (verdict.verdict, form.port, form.variable) == ("UNKNOWN_FORM", "pitch_moment", "deceleration")
        # the best of all forms would pull the pitch gain by more than four tolerances
        assert any("vehicle's own pitch_gain" in reason for reason in verdict.reasons)
        assert abs(verdict.session_pulls["pitch_gain"][1]) < 0.1

    def test_a_form_that_passes_no_gate_explains_nothing(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(discovery, "search_forms", lambda found, *_: (found, None))
        with pytest.raises(ForeignCarError):
            judged({}, outside="pitch_by_deceleration", rules=self.DISAGREEING)

    def test_runs_that_disagree_beside_every_form_are_left_to_the_joint_fit(self) -> None:
        with pytest.raises(ForeignCarError, match="disagree with the model by a factor of"):
            judged({}, outside="pitch_by_deceleration", rules=replace(RULES, foreign_inflation=0.9))

    def test_what_moves_the_body_alone_is_taken_back_where_they_disagree_about_it(self) -> None:
        verdict = judged({}, outside="strut_step", design=BUMPS, rules=replace(RULES, disputed_inflation=0.5))
        assert verdict.verdict == "NOTHING"
        assert any(
            reason.startswith("suspension_force") and "disagree" in reason for reason in verdict.reasons
        )


def test_what_a_gauge_read_at_rest_is_told_beside_why_nothing_is_named() -> None:
    verdict = judged({}, brake_rest=0.05)
    assert verdict.verdict == "NOTHING"
    refusal, gauge = verdict.reasons
    assert "best candidate" in refusal or "no effect of the library explains enough" in refusal
    assert "rests at 0.050 MPa" in gauge


def test_an_instrument_that_feels_gravity_is_a_sensor_and_no_missing_physics() -> None:
    verdict = judged({"gravity_leak": 1.0}, design=LEVEL)
    assert (verdict.verdict, names(verdict)) == ("SENSOR", ["sensor_gravity_leak"])
    felt = verdict.error["longitudinal_acceleration"]
    assert felt.after < 0.6 * felt.frozen


def test_what_no_library_holds_is_a_form_at_its_port_and_variable() -> None:
    verdict = judged({}, outside="strut_step", design=BUMPS)
    assert verdict.verdict == "UNKNOWN_FORM"
    assert (verdict.effects[0].port, verdict.effects[0].variable) == ("suspension_force", "suspension_speed")


@pytest.mark.minutes
def test_two_effects_at_once_are_both_named() -> None:
    verdict = judged({"lag": 0.08, "drag_area": 0.7}, design=LEVEL)
    assert verdict.verdict == "FOUND"
    assert set(names(verdict)) == {"brake_lag", "aerodynamic_drag"}
    assert verdict.error["speed"].after < 0.5 * verdict.error["speed"].frozen


@pytest.mark.minutes
def test_what_stops_of_one_kind_cannot_tell_apart_is_a_set_with_the_run_that_can() -> None:
    verdict = judged({"pad_drag": 40.0}, design=load_closing_study().drives(), first_experiment=0)
    told = {*names(verdict), *(rival.name for _, rival in verdict.rivals)}
    assert verdict.verdict == "SET" and "pad_drag" in told
    assert verdict.experiment is not None and verdict.experiment.expected_d2 > 10.0
    assert set(verdict.experiment.between) <= told


class TestACarThatIsGrown:
    """The ``effects`` and ``forms`` of a vehicle are part of the model that is judged."""

    GROWN = replace(VEHICLE, name="grown", effects={"lag": 0.08, "drag_area": 0.7})
    FORM = Form(
        port="brake_torque",
        variable="pressure",
        shape="a + b x",
        coefficients=(0.0, 0.1),
        scale=3.6,
        low=0.0,
        high=3.6,
    )

    def test_it_predicts_as_the_plain_car_with_its_effects(self) -> None:
        run = make_planned_run(RICH[4], "pulsed")
        theta = build_parameter_vector({"lag": 0.08, "drag_area": 0.7})
        grown = predict_channels(prepare_run(run, self.GROWN, SURFACE), np.zeros_like(theta))
        np.testing.assert_array_equal(grown, predict_channels(prepare_run(run, VEHICLE, SURFACE), theta))

    def test_it_predicts_with_its_forms(self) -> None:
        run = make_planned_run(RICH[4], "pulsed")
        none = build_parameter_vector({})
        grown = predict_channels(prepare_run(run, replace(VEHICLE, forms=(self.FORM,)), SURFACE), none)
        added = predict_channels(prepare_run(run, VEHICLE, SURFACE), none, slots=(self.FORM.slot,))
        np.testing.assert_array_equal(grown, added)
        assert np.abs(grown - predict_channels(prepare_run(run, VEHICLE, SURFACE), none)).max() > 0.1

    def test_it_lacks_only_what_it_has_not(self) -> None:
        """Were what it has no part of the model, this would be named too."""
        half = replace(self.GROWN, effects={"lag": 0.08})
        verdict = judged({"lag": 0.08, "drag_area": 0.7}, vehicle=half, design=LEVEL)
        assert names(verdict) == ["aerodynamic_drag"]
        assert "grown already has lag: what is named comes on top of that" in verdict.reasons

    @pytest.mark.minutes
    def test_a_calibrated_vehicle_is_judged_with_all_that_calibration_gave_it(self) -> None:
        grown = load_vehicle("multibody-grown")
        assert {"stick_ratio", "enveloping_length", "scrub_stiffness"} <= set(grown.effects)
        assert names(judged({"lag": 0.08}, vehicle=grown, driven=grown, design=LEVEL)) == ["brake_lag"]


@pytest.mark.parametrize(
    ("channels", "unseen"),
    [
        (CHANNELS, set()),
        (("speed", "wheel_speed_front", "vertical_acceleration"), set()),
        (("speed", "wheel_speed_front"), {"aerodynamic_pitch", "retuned_pitch_gain"}),
        (("speed", "pitch"), {"relaxation_length"}),
    ],
)
def test_an_effect_by_slip_needs_a_wheel_speed_and_a_pitch_moment_a_channel_of_the_body(channels, unseen):
    """A wheel radius 3 % off was named as a pitch moment, with no channel that shows pitch."""
    library = load_effects()
    found = {effect.name for effect in library if can_show(effect, VEHICLE, channels)}
    assert found == {e.name for e in library} - unseen
