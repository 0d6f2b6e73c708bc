"""A verdict tells the vehicle's own numbers that its prediction rests on, each once."""

from types import SimpleNamespace

from catalogs.entries import load
from flows.measured.closing import _describe_own_numbers
from tasks.identification.decision.answer import NamedEffect, Parameter, make_estimate


def test_a_number_that_stands_as_a_rival_is_not_told_again_among_the_vehicles_own():
    def number(name: str, value: float) -> NamedEffect:
        effect = next(e for e in load("library of effects") if e.name == name)
        p = Parameter(
            name=effect.parameters[0].name,
            value=value,
            ci_low=0.0,
            ci_high=1.0,
            lower=0.0,
            upper=1.0,
            unit="1",
        )
        return make_estimate(effect, p, 0.1)

    grip, gain = number("retuned_friction_level", 0.65), number("retuned_pressure_gain", 0.51)
    told = SimpleNamespace(rivals=[("pressure_nonlinearity", grip)], effects=[grip], experiment=None)
    outcome = SimpleNamespace(verdict=told, calibrated=(gain, grip))
    assert (
        _describe_own_numbers(outcome, load("library of effects"))
        == "the brakes give 51 % [0, 100] above the torque of the vehicle file"
    )
    assert (
        _describe_own_numbers(SimpleNamespace(verdict=told, calibrated=(grip,)), load("library of effects"))
        == ""
    )
