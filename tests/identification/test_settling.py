"""What is named stays named only where the last fit, which reports it, agrees."""

from types import SimpleNamespace

import numpy as np
import pytest

from catalogs.entries import load
from tasks.campaign.campaign import SESSION
from tasks.identification.decision import settling
from tasks.identification.decision.odds import search_explanations
from tasks.identification.decision.open_explanations import list_open_explanations
from tests.identification.explained import effect_of, form_of, grams_of

RULES = load("set of decision rules")


def settle(monkeypatch, grams, most=1, **fit):
    """The explanations that stay open with a last fit of these fields."""
    plain = {
        "objective": 0.0, "covariance": np.array([[0.01]]), "scatter": np.zeros(9), "session": np.zeros(8),
        "session_sigma": np.full(8, 0.01), "session_error": np.zeros(8), "pulls": np.zeros(8),
    }  # fmt: skip
    fitted = SimpleNamespace(**(plain | fit))
    opened = list_open_explanations(grams, search_explanations(grams, most=most, width=8), RULES)
    monkeypatch.setattr(settling, "fit_named", lambda finding, opened: fitted)
    monkeypatch.setattr(settling, "refine_fit", lambda finding, fitted: fitted)
    return settling.settle_named(SimpleNamespace(grams=grams, null=fitted), opened, RULES)[0]


@pytest.mark.parametrize(("value", "scatter", "told"), [(-1.5, 0.0, 0), (-2.5, 0.0, 1), (-2.5, 1.0, 0)])
def test_no_form_is_named_whose_interval_holds_no_form_at_all(monkeypatch, value, scatter, told):
    """The spline's values have errors of 1: -1.5 may be 0, -2.5 is not, but where runs scatter by 1 it may be too."""
    form = form_of("friction", "load_ratio", (0, 1))
    designs = [np.eye(2) / 2.0] * 4
    grams = grams_of([form], designs, [x @ np.array([9.0, -9.0]) for x in designs])
    shape = SimpleNamespace(
        name="friction ~ a", port="friction", effect_class="form", names=("a",), lower=(-9.0,), upper=(9.0,),
        units=("1",),
    )  # fmt: skip
    opened = settle(
        monkeypatch,
        grams,
        parts=(shape,),
        values=np.array([value]),
        scatter=np.array([scatter, *np.zeros(8)]),
    )
    assert len(opened[0].named) == told


@pytest.mark.parametrize(
    ("pull", "names"), [(4.5, [{"brake_lag"}]), (5.5, [{"brake_lag"}, {"brake_lag", "mass"}])]
)
def test_a_number_of_the_file_that_a_name_pulls_far_beyond_its_tolerance_stays_open(monkeypatch, pull, names):
    lag, mass = effect_of("brake_lag", 0), effect_of("retuned_mass", 1)
    designs = [np.diag([10.0, 1.0])] * 4
    grams = grams_of([lag, mass], designs, [x @ np.array([3.0, 0.0]) for x in designs])
    part = SimpleNamespace(name="brake_lag", effect_class="effect", port="brake_torque", names=("lag",))
    pulls = np.where(np.array(SESSION) == "mass", pull, 0.0)
    opened = settle(monkeypatch, grams, parts=(part,), values=np.array([3.0]), pulls=pulls)
    assert [{name.removeprefix("retuned_") for name in one.names} for one in opened] == names
    assert all(one.log_odds <= np.log(RULES.named_odds) for one in opened)


def test_values_are_known_as_well_as_the_signature_where_runs_disagree_with_the_model_as_much_as_noise():
    """Residuals of 0, 1 and 2 standard errors in every run: mean squares of 0, 1 and 4, with bounds at 1 and 2."""
    lag = effect_of("brake_lag", 0)
    designs = [np.array([[10.0], [0.0]])] * 4
    shares = []
    for size in (0.0, 1.0, 1.25, 2.0):
        residuals = [np.array([sign * size, 0.0]) for sign in (1.0, -1.0, 1.0, -1.0)]
        grams = grams_of([lag], designs, residuals)
        opened = SimpleNamespace(explanation=search_explanations(grams, most=0, width=1)[0])
        shares.append(settling.estimate_signature_share(SimpleNamespace(grams=grams), opened, RULES))
    assert shares == pytest.approx([0.0, 0.0, 0.1 * np.sqrt(0.5625), 0.1], abs=1e-6)


@pytest.mark.parametrize(
    ("name", "port", "fall", "names"),
    [
        ("retuned_friction_level", "friction", 0.0, [{"retuned_friction_level"}]),
        ("retuned_friction_level", "friction", 12.0, [{"retuned_friction_level"}, {"form friction(speed)"}]),
        ("retuned_friction_level", "friction", 60.0, [{"form friction(speed)"}]),
        ("retuned_pitch_gain", "pitch_moment", 60.0, [{"form pitch_moment(speed)"}]),
        ("retuned_pressure_gain", "brake_torque", 60.0, [{"retuned_pressure_gain"}]),
    ],
)
def test_a_number_of_the_file_is_held_against_a_form_of_its_port_through_the_simulation(
    monkeypatch, name, port, fall, names
):
    """The runs show 3 and 2.2 where the number says one value; the last fit with the form has a misfit less by fall.

    No run has a disturbance of its own at the brake.
    """
    level = effect_of(name, 0)
    form = form_of(port, "speed", (1, 2), log_prior=-5.0)
    designs = [np.array([[3.0, 3.0, 0.0], [3.0, 0.0, 3.0]])] * 4
    grams = grams_of([level, form], designs, [np.array([9.0, 6.6])] * 4)

    def fit(finding, opened):
        varies = opened.named[0] is form
        part = SimpleNamespace(
            name=opened.named[0].name, effect_class="form" if varies else "retune", port=port, names=("a",),
            lower=(-9.0,), upper=(9.0,), units=("1",),
        )  # fmt: skip
        return SimpleNamespace(
            parts=(part,), values=np.array([2.8]), covariance=np.array([[0.01]]), scatter=np.zeros(9),
            session=np.full(8, 2.8), session_sigma=np.full(8, 0.01), session_error=np.zeros(8), pulls=np.zeros(8),
            objective=-fall if varies else 0.0,
        )  # fmt: skip

    opened = list_open_explanations(grams, search_explanations(grams, most=1, width=8), RULES)
    assert opened[0].names == {level.name}
    monkeypatch.setattr(settling, "fit_named", fit)
    monkeypatch.setattr(settling, "refine_fit", lambda finding, fitted: fitted)
    null = SimpleNamespace(objective=0.0)
    finding = SimpleNamespace(grams=grams, null=null, evidence=SimpleNamespace(train=[None] * 4))
    settled, _ = settling.settle_named(finding, opened[:1], RULES)
    assert [set(one.names) for one in settled] == names
