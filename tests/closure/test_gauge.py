"""The noise of the pressure gauge feigns forms of its rate; what changes the brakes by more is kept."""

from types import SimpleNamespace

import numpy as np
import pytest

from catalogs.effects import load_effects
from catalogs.studies.closing import load_closing_study
from catalogs.surfaces import load_surface
from catalogs.vehicles import load_vehicle
from tasks.closure.benchmark import synthetic_campaign
from tasks.closure.gauge import BEYOND_NOISE, is_feigned, pressure_noise_share
from tasks.closure.verdict import attribute
from tasks.vehicle.effects.slots import Slot


def braking(noise: float, pressure: float = 2.0, seed: int = 1) -> SimpleNamespace:
    rng = np.random.Generator(np.random.Philox(seed))
    held = np.where(np.arange(600) < 100, 0.0, pressure)
    return SimpleNamespace(pressure=np.maximum(held + noise * rng.standard_normal(600), 0.0))


def form(port: str, variable: str, change: float) -> SimpleNamespace:
    def build(values: np.ndarray) -> tuple[np.ndarray, tuple[Slot, ...]]:
        table = np.array([-0.5, 0.0, 0.5]) * values[0]
        return np.zeros(1), (Slot(port=port, variable=variable, origin=-12.0, spacing=12.0, values=table),)

    hypothesis = SimpleNamespace(port=port, variable=variable, names=("a",), build=build)
    return SimpleNamespace(hypothesis=hypothesis, fitted=SimpleNamespace(values=np.array([7.0, change])))


@pytest.mark.parametrize("noise", [0.005, 0.01, 0.02])
def test_the_share_of_the_gauges_noise_is_found_under_ramps_and_rest(noise: float) -> None:
    runs = [braking(noise, seed=seed) for seed in range(6)]
    assert pressure_noise_share(runs) == pytest.approx(noise / 2.0, rel=0.1)


def test_runs_that_never_brake_have_no_share() -> None:
    assert pressure_noise_share([SimpleNamespace(pressure=np.zeros(50))]) == 0.0


def test_a_form_of_the_rate_is_feigned_up_to_what_the_noise_can_make() -> None:
    runs = [braking(0.01, seed=seed) for seed in range(6)]
    limit = BEYOND_NOISE * 0.005
    assert is_feigned(form("brake_torque", "pressure_rate", 0.8 * limit), runs)
    assert is_feigned(form("friction", "pressure_rate", -0.8 * limit), runs)
    assert not is_feigned(form("brake_torque", "pressure_rate", 1.3 * limit), runs)


def test_forms_of_other_variables_and_ports_are_not_the_gauges_doing() -> None:
    runs = [braking(0.01)]
    assert not is_feigned(form("brake_torque", "speed", 1e-4), runs)
    assert not is_feigned(form("pitch_moment", "pressure_rate", 1e-4), runs)


def test_stops_of_one_kind_and_a_noisy_gauge_are_no_discovery() -> None:
    model, surface = load_vehicle("paper-reference"), load_surface("dense-asphalt")
    campaign = synthetic_campaign(model, surface, {}, 700_000, design=load_closing_study().drives())
    assert attribute(campaign, model, surface, load_effects()).verdict.verdict == "NOTHING"
