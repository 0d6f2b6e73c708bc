"""Every kind of verdict, from whole campaigns of known truth made unlike the model that judges them."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from catalogs.entries import load
from studies.closing_benchmark.synthetic import RICH, TOLERANCES, make_synthetic_campaign
from studies.closing_benchmark.truths import load_truths
from tasks.campaign.campaign import CHANNELS, SESSION, Campaign
from tasks.campaign.planned_runs import RunPlan, make_planned_run, plan_experiments
from tasks.identification.decision import experiment
from tasks.identification.decision.answer import Verdict
from tasks.identification.decision.verdict import judge_runs
from tasks.identification.inference.forward import predict_channels, prepare_run
from tasks.vehicle.effects.forms import Form
from tasks.vehicle.effects.table import build_parameter_vector
from tasks.vehicle.parameters import Vehicle

VEHICLE, SURFACE = load("vehicle", "paper-reference"), load("surface", "dense-asphalt")
FEW = (
    "aerodynamic_drag", "brake_lag", "pad_drag", "retuned_pressure_gain", "rolling_resistance", "sensor_gravity_leak",
)  # fmt: skip
"""One or two for each verdict and what may be taken for them: all of the library takes five times as long."""
LEVEL = (
    RunPlan(speed=32.0, peak=0.0, duration=2.5), RunPlan(speed=14.0, peak=0.0, duration=2.5),
    RunPlan(speed=28.0, peak=0.0, duration=2.5), RunPlan(speed=25.0, peak=2.0, disc_rise=350.0, duration=2.5),
    RunPlan(speed=26.4, peak=-2.4, duration=2.5), RunPlan(speed=13.9, peak=2.3, duration=2.0),
    RunPlan(speed=25.0, peak=0.0, duration=2.5), RunPlan(speed=22.2, peak=2.6, disc_rise=250.0, duration=2.0),
)  # fmt: skip
"""What brakes, air and instruments do: six runs train, two are held out; nothing is told by one run alone."""
BUMPS = (
    *LEVEL[3:6], RunPlan(speed=11.1, peak=0.0, duration=2.0, hazard=(12.0, 3.7, 0.075)),
    RunPlan(speed=9.7, peak=0.0, duration=2.0, hazard=(10.0, 2.0, -0.08)), LEVEL[7],
    RunPlan(speed=8.9, peak=0.8, duration=2.0, hazard=(9.0, 3.7, 0.05)),
)  # fmt: skip
"""What the suspension does: five runs train, two are held out."""
OUTSIDE = {truth.name: truth for truth in load_truths() if not truth.in_library}
SEED = 31
RULES = load("set of decision rules")


def judged(
    values: dict[str, float],
    *,
    vehicle: Vehicle = VEHICLE,
    driven: Vehicle = VEHICLE,
    outside: str | None = None,
    design: tuple[RunPlan, ...] = LEVEL,
    library: tuple[str, ...] = FEW,
    change: Callable[[Campaign], Campaign] = lambda campaign: campaign,
    experiments: tuple[str, ...] = (),
) -> Verdict:
    """The verdict on a campaign; to weigh every planned run takes as long as all that comes before it."""
    slots = OUTSIDE[outside].slots if outside else ()
    campaign = make_synthetic_campaign(driven, SURFACE, values, SEED, slots=slots, design=design)
    last = 3 * len(design) // 4
    runs = tuple(replace(run, held_out=number >= last) for number, run in enumerate(campaign.runs))
    effects = tuple(effect for effect in load("library of effects") if effect.name in library)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            experiment,
            "plan_experiments",
            lambda gain: (
                [run for run in plan_experiments(gain) if run[0].startswith(experiments)]
                or plan_experiments(gain)[-1:]
            ),
        )
        return judge_runs(change(replace(campaign, runs=runs)), vehicle, SURFACE, effects, RULES).verdict


def names(verdict: Verdict) -> list[str]:
    return [effect.name for effect in verdict.effects]


def rivals(verdict: Verdict) -> list[tuple[str, str]]:
    return [(of, rival.name) for of, rival in verdict.rivals]


@cache
def late_brakes() -> Verdict:
    return judged({"lag": 0.08})


def test_a_lag_is_found_with_an_interval_that_holds_it_and_the_error_of_unseen_runs_falls() -> None:
    verdict = late_brakes()
    assert (verdict.verdict, names(verdict), verdict.rivals) == ("FOUND", ["brake_lag"], ())
    (lag,) = verdict.effects[0].parameters
    assert lag.ci_low < 0.08 < lag.ci_high and lag.ci_high - lag.ci_low < 0.01
    speed = verdict.error["speed"]
    assert speed.after < 0.3 * speed.frozen and speed.after < 0.5 * speed.retuned
    assert [(o.names, o.odds) for o in verdict.odds] == [(("brake_lag",), 1.0)]


def test_held_out_runs_do_not_decide() -> None:
    """With noise in their place the verdict is the same to the last digit, and they alone are missed."""

    def drown_held_out_runs(campaign: Campaign) -> Campaign:
        rng = np.random.default_rng(5)
        return replace(
            campaign,
            runs=tuple(
                replace(run, response=run.response[:1] + rng.standard_normal(run.response.shape))
                if run.held_out
                else run
                for run in campaign.runs
            ),
        )

    plain, drowned = late_brakes(), judged({"lag": 0.08}, change=drown_held_out_runs)
    same = (
        "verdict",
        "effects",
        "rivals",
        "odds",
        "tried",
        "session_pulls",
        "noise",
        "detectable",
        "experiment",
    )
    for part in same:
        assert getattr(drowned, part) == getattr(plain, part), part
    assert drowned.error["speed"].after > 10.0 * plain.error["speed"].after and drowned.misses


def test_where_nothing_is_missing_nothing_is_named_and_the_verdict_says_why() -> None:
    verdict = judged({}, change=lambda campaign: replace(campaign, brake_rest=0.05))
    assert (verdict.verdict, verdict.effects, verdict.rivals) == ("NOTHING", (), ())
    refusal, *_, gauge = verdict.reasons
    assert "has odds of" in refusal and "a name needs 20 : 1" in refusal
    assert "rests at 0.050 MPa" in gauge
    assert 0.0 < verdict.detectable["brake_lag"] < 0.08


def test_a_number_off_beyond_its_tolerance_is_a_retune() -> None:
    verdict = judged({"pressure_gain": 0.15})
    assert (verdict.verdict, names(verdict)) == ("RETUNE", ["retuned_pressure_gain"])
    (gain,) = verdict.effects[0].parameters
    # the campaign's own vehicle is off by its tolerances too
    drawn = np.random.Generator(np.random.Philox(SEED)).standard_normal(len(SESSION)) * TOLERANCES.session
    assert gain.ci_low < 0.15 + drawn[SESSION.index("pressure_gain")] < gain.ci_high < 0.17
    speed = verdict.error["speed"]
    assert speed.retuned < 1.1 * speed.after < speed.frozen


def test_an_instrument_that_feels_gravity_is_a_sensor_and_no_missing_physics() -> None:
    verdict = judged({"gravity_leak": 1.0})
    assert (verdict.verdict, names(verdict)) == ("SENSOR", ["sensor_gravity_leak"])
    felt = verdict.error["longitudinal_acceleration"]
    assert felt.after < 0.6 * felt.frozen


def test_what_no_library_holds_is_a_form_at_its_port_and_variable_and_the_error_falls() -> None:
    verdict = judged({}, outside="strut_step", design=BUMPS)
    assert verdict.verdict == "UNKNOWN_FORM"
    (form,) = verdict.effects
    assert (form.port, form.variable) == ("suspension_force", "suspension_speed")
    pitch = verdict.error["pitch_rate"]
    assert pitch.after < 0.9 * pitch.frozen


def test_two_effects_at_once_are_both_named() -> None:
    verdict = judged({"lag": 0.03, "drag_area": 0.7})
    assert (verdict.verdict, set(names(verdict))) == ("FOUND", {"brake_lag", "aerodynamic_drag"})
    found = {effect.name: effect.parameters[0] for effect in verdict.effects}
    for name, truth in (("brake_lag", 0.03), ("aerodynamic_drag", 0.7)):
        assert found[name].ci_low < truth < found[name].ci_high
    assert verdict.error["speed"].after < 0.5 * verdict.error["speed"].frozen


def test_what_speed_alone_cannot_tell_apart_is_a_set_with_its_odds_and_the_run_that_can() -> None:
    """A deceleration shows brake gain over mass."""

    def measure_speed_alone(campaign: Campaign) -> Campaign:
        seen = np.array([name == "speed" for name in CHANNELS])
        runs = (replace(run, response=np.where(seen, run.response, 0.0)) for run in campaign.runs)
        return replace(campaign, channels=("speed",), runs=tuple(runs))

    library = ("retuned_pressure_gain", "retuned_mass", "brake_lag")
    verdict = judged({"pressure_gain": 0.2}, library=library, change=measure_speed_alone)
    assert verdict.verdict == "SET"
    ((of, rival),) = rivals(verdict)
    assert [of] == names(verdict) and {of, rival} == {"retuned_pressure_gain", "retuned_mass"}
    assert [o.names for o in verdict.odds] == [(of,), (rival,)]
    assert verdict.odds[0].odds == 1.0 and 1.0 / RULES.named_odds < verdict.odds[1].odds < RULES.named_odds


def test_a_set_holds_the_run_that_tells_its_explanations_apart() -> None:
    library = ("pad_drag", "rolling_resistance", "brake_lag")
    verdict = judged({"pad_drag": 45.0}, library=library, experiments=("coast down from 36", "gentle"))
    assert verdict.verdict == "SET"
    assert [o.names for o in verdict.odds] == [("pad_drag",), ("rolling_resistance",)]
    planned = verdict.experiment
    assert planned is not None and planned.between == ("pad_drag", "rolling_resistance")
    assert planned.plan.startswith("coast down from 36 m/s") and planned.expected_d2 > 10.0


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
        verdict = judged({"lag": 0.08, "drag_area": 0.7}, vehicle=half)
        assert names(verdict) == ["aerodynamic_drag"]
        assert "grown already has lag: what is named comes on top of that" in verdict.reasons

    @pytest.mark.minutes
    def test_a_calibrated_vehicle_is_judged_with_all_that_calibration_gave_it(self) -> None:
        grown = load("vehicle", "multibody-grown")
        assert {"stick_ratio", "enveloping_length", "scrub_stiffness"} <= set(grown.effects)
        assert names(judged({"lag": 0.08}, vehicle=grown, driven=grown)) == ["brake_lag"]
