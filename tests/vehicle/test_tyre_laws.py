"""A kind of tyre is one row of one table: rollout, FMU and explanation choose its law there."""

from dataclasses import replace
from math import copysign
from typing import Any, NamedTuple

import numpy as np
import pytest
from numba import njit
from numba.extending import register_jitable

from catalogs.entries import entry_names, load
from tasks.explanation import force_steps
from tasks.surface.road_profile import FLAT_ROAD
from tasks.vehicle.model.embedded import _compile_tyre
from tasks.vehicle.parameters import Vehicle, compute_surface_response
from tasks.vehicle.tyres import contract
from tasks.vehicle.tyres.contract import TyreLaw, compute_tyre_slope, find_law


class ArctanCurve(NamedTuple):
    """mu = 2/pi atan(stiffness kappa), a curve without a peak."""

    stiffness: float


class ArctanTyre(NamedTuple):
    stiffness: float
    peak: float
    target_slip: float


@register_jitable
def scale_arctan(curve: ArctanCurve, peak: float, slip_stiffness: float) -> ArctanTyre:
    return ArctanTyre(curve.stiffness * slip_stiffness, peak, 0.2)


@njit
def compute_arctan_friction(slip: float, load: float, tyre: ArctanTyre) -> float:
    return tyre.peak * 2 / np.pi * np.arctan(tyre.stiffness * slip)


@njit
def compute_arctan_slope(slip: float, load: float, tyre: ArctanTyre) -> float:
    return tyre.peak * 2 / np.pi * tyre.stiffness / (1 + (tyre.stiffness * slip) ** 2)


@pytest.fixture
def car(vehicle: Vehicle, monkeypatch: pytest.MonkeyPatch) -> Vehicle:
    """The reference vehicle on a third kind of tyre, of which only the table knows."""
    row = TyreLaw(
        curve=ArctanCurve, tyre=ArctanTyre, scale=scale_arctan, friction=compute_arctan_friction,
        slope=compute_arctan_slope, formula="mu_A({kappa:.4g})",
    )  # fmt: skip
    monkeypatch.setattr(contract, "LAWS", (*contract.LAWS, row))
    return replace(vehicle, tyre=ArctanCurve(40.0))


def test_a_third_kind_of_tyre_drives_by_its_row_alone(car: Vehicle, drive: Any) -> None:
    run = drive("snow", 0.3, car=car, mode="coupled", duration=3.0)
    tyre = compute_surface_response(car, "snow", 0.3).tyre
    for axle in "fr":
        slip, load = run.columns[f"braking_slip_{axle}"], run.columns[f"tyre_load_{axle}"]
        wanted = [
            copysign(compute_arctan_friction(abs(k), f, tyre) * f, k) for k, f in zip(slip, load, strict=True)
        ]
        np.testing.assert_allclose(run.columns[f"tyre_force_{axle}"], wanted, rtol=1e-9, atol=1e-9)
    row = {name: values[2000] for name, values in run.columns.items()}
    steps = force_steps(car, compute_surface_response(car, "snow", 0.3), FLAT_ROAD, "coupled", row)
    assert all(step.agrees for step in steps)
    assert any("mu_A(" in step.formula for step in steps)


def test_an_fmu_takes_the_third_kind_of_tyre_as_a_rollout_does(car: Vehicle) -> None:
    make_tyre = _compile_tyre(car)
    for place, weather in enumerate(("dry", "rain", "snow", "ice")):
        assert make_tyre(place, 0.3) == compute_surface_response(car, weather, 0.3).tyre


@pytest.mark.parametrize("law", contract.LAWS, ids=lambda law: law.tyre.__name__)
def test_a_slope_is_the_derivative_of_its_friction(law: TyreLaw, vehicle: Vehicle) -> None:
    curves = (vehicle.find_curve("rain"), *(load("tyre", name) for name in entry_names("tyre")))
    tyre = contract.scale_curve(next(c for c in curves if isinstance(c, law.curve)), 0.4, 1.2)
    assert find_law(type(tyre)) is find_law(law.curve) is law
    for slip in (0.01, 0.05, 0.3):
        rise = law.friction(slip + 1e-6, 4000.0, tyre) - law.friction(slip - 1e-6, 4000.0, tyre)
        assert compute_tyre_slope(slip, 4000.0, tyre) == pytest.approx(rise / 2e-6, rel=1e-5)
