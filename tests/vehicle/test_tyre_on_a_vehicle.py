"""The Magic Formula as a vehicle's tyre: on every surface, in a stop, in identification and in the document."""

import re
from dataclasses import replace

import numpy as np
import pytest

from catalogs.entries import load
from manifests.provenance import SOURCE_ROOT
from tasks.identification.inference.forward import predict_channels, prepare_run
from tasks.vehicle.effects.table import PARAMETER_INDEX
from tasks.vehicle.parameters import compute_surface_response
from tasks.vehicle.tyres.contract import compute_tyre_friction, compute_tyre_slope
from tests.identification.synthetic import plain_run
from tests.vehicle.conftest import HUMP

LOAD = 8000.0
"""Of an axle [N]."""
SURFACES = [("dry", 0.82), ("rain", 0.347126), ("rain", 0.5), ("snow", 0.24), ("snow", 0.51)]


@pytest.fixture(scope="module")
def car(vehicle):
    """The reference vehicle on the book's tyres."""
    return replace(vehicle, tyre=load("tyre", "pacejka-205-60r15"))


@pytest.mark.parametrize(("family", "friction"), SURFACES)
def test_the_surface_sets_the_peak_and_the_family_the_stiffness(vehicle, car, family, friction):
    burckhardt, magic = (compute_surface_response(v, family, friction) for v in (vehicle, car))
    assert magic.tyre.peak == pytest.approx(burckhardt.tyre.peak, rel=1e-12)
    assert compute_tyre_friction(magic.tyre.target_slip, LOAD, magic.tyre) == pytest.approx(
        magic.tyre.peak, rel=1e-12
    )
    assert compute_tyre_slope(magic.tyre.target_slip, LOAD, magic.tyre) == pytest.approx(0.0, abs=1e-6)
    slips = np.linspace(0, 1, 2001)
    assert max(compute_tyre_friction(slip, LOAD, magic.tyre) for slip in slips) <= magic.tyre.peak * (
        1 + 1e-12
    )
    assert compute_tyre_friction(0.0, LOAD, magic.tyre) == 0.0
    assert compute_tyre_slope(0.0, LOAD, magic.tyre) == pytest.approx(21.51 * magic.slip_stiffness, rel=1e-12)


@pytest.mark.parametrize("mode", [pytest.param("paper", marks=pytest.mark.minutes), "coupled"])
@pytest.mark.parametrize(("family", "friction"), [("rain", 0.347126), ("snow", 0.3)])
def test_a_vehicle_on_the_magic_formula_stops_as_its_friction_allows(drive, car, mode, family, friction):
    """The ABS uses all but a few percent of the peak: 1.04 to 1.06 of v^2 / (2 mu_eff g), as on Burckhardt's curve."""
    run = drive(family, friction, car=car, mode=mode, duration=14.0, hold=True)
    shortest = (60 / 3.6) ** 2 / (2 * run.tyre_peak * car.gravity)
    assert run.target_slip == compute_surface_response(car, family, friction).tyre.target_slip
    assert 1.03 * shortest < run.stopping_distance < 1.07 * shortest


def test_the_force_of_each_tick_is_the_curves_at_its_slip_and_load(drive, car):
    run = drive("rain", 0.4, car=car, mode="coupled", hazard=HUMP, duration=3.0)
    tyre, columns = compute_surface_response(car, "rain", 0.4).tyre, run.columns
    for axle in "fr":
        slip, load = columns[f"braking_slip_{axle}"], columns[f"tyre_load_{axle}"]
        expected = [
            np.sign(k) * compute_tyre_friction(abs(k), f, tyre) * f for k, f in zip(slip, load, strict=True)
        ]
        np.testing.assert_allclose(columns[f"tyre_force_{axle}"], expected, rtol=1e-9, atol=1e-9)
        assert np.ptp(load) > 2000.0


def test_an_effect_is_found_in_a_car_on_the_magic_formula(car):
    """The one model serves identification too: three Newton steps find a tyre that grips 4 % less than its surface."""
    run = replace(plain_run(20.0, 2.3), weather="rain", precipitation_mm_h=50.0)
    model = prepare_run(run, car, load("surface", "dense-asphalt"))
    unit = np.zeros(len(PARAMETER_INDEX))
    unit[PARAMETER_INDEX["friction"]] = 1.0
    measured, found = predict_channels(model, -0.04 * unit), 0.0
    for _ in range(3):
        here = predict_channels(model, found * unit)
        rise = (predict_channels(model, (found + 1e-4) * unit) - here) / 1e-4
        found += float(np.sum(rise * (measured - here)) / np.sum(rise * rise))
    assert found == pytest.approx(-0.04, abs=1e-4)


def test_the_document_shows_what_runs_and_its_figures_are_those_of_the_model(drive, vehicle, car):
    text = (SOURCE_ROOT / "docs/reference/tyres.md").read_text()
    (code,) = re.findall(r"```python\n(.*?)```", text, flags=re.S)
    names: dict[str, object] = {}
    exec(code, names)  # noqa: S102
    assert names["vehicle"] == car and names["braking"] < 0 > names["cornering"]
    rows = re.findall(r"\| (\w+), (0\.\d+) \| (.*) \|", text)
    assert len(rows) == 4
    for family, friction, figures in rows:
        runs = [
            drive(family, float(friction), car=one, mode="coupled", duration=14.0, hold=True)
            for one in (car, vehicle)
        ]
        told = " | ".join(f"{run.target_slip:.3f} | {run.stopping_distance:.1f}" for run in runs)
        assert figures == told
