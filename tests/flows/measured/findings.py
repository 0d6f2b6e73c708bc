"""Verdicts as if they had been found: what the tests of grown vehicles start from."""

from collections.abc import Mapping
from pathlib import Path

from catalogs.vehicles import open_vehicle
from flows.measured.grown_vehicle import grown_vehicle
from tasks.identification.decision.answer import NamedEffect, Parameter, Verdict
from tasks.identification.inference.disturbance import Disturbance
from tasks.vehicle.effects.forms import SHAPES, name_form
from tasks.vehicle.effects.library import Effect
from tasks.vehicle.effects.table import build_parameter_vector

FOUND = {
    "score": 50.0,
    "gain": 60.0,
}


def _parameter(name: str, value: float, lower: float, upper: float, unit: str) -> Parameter:
    low, high = sorted((0.9 * value, 1.1 * value))
    return Parameter(name=name, value=value, ci_low=low, ci_high=high, lower=lower, upper=upper, unit=unit)


def found_effect(effect: Effect, values: Mapping[str, float]) -> NamedEffect:
    """A library effect of these parameters, with 95 % intervals of +-10 %."""
    return NamedEffect(
        name=effect.name, effect_class=effect.effect_class, port=effect.port, variable=effect.variable,
        parameters=tuple(_parameter(p.name, values[p.name], p.lower, p.upper, p.unit) for p in effect.parameters),
        **FOUND,
    )  # fmt: skip


def found_form(port: str, variable: str, shape: str, scale: float, *coefficients: float) -> NamedEffect:
    """A form of the grammar."""
    assert shape in SHAPES
    return NamedEffect(
        name=name_form(port, variable, shape, scale), effect_class="form", port=port, variable=variable,
        parameters=tuple(_parameter(n, v, -2.0, 2.0, "1") for n, v in zip("ab", coefficients, strict=False)),
        **FOUND,
    )  # fmt: skip


def verdict_of(*effects: NamedEffect) -> Verdict:
    """A verdict that names these effects."""
    return Verdict(
        verdict="FOUND", effects=effects, rivals=(), odds=(), tried=(), error={}, manoeuvre_error={}, correlation={},
        session_pulls={}, noise={}, disturbance=Disturbance(), detectable={}, campaign="toy", content_hash="c" * 64,
        split_hash="d" * 64, theta=build_parameter_vector({}), slots=(), experiment=None, step_sensitive=(), reasons=(),
    )  # fmt: skip


def grown_file(path: Path, *effects: NamedEffect, reached: Mapping[str, tuple[float, float]]) -> Path:
    """The reference vehicle with these effects, all of them carried."""
    text, missing = grown_vehicle(open_vehicle("paper-reference"), verdict_of(*effects), reached)
    assert text is not None and missing == []
    path.write_text(text)
    return path
