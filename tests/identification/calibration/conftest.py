"""Traces that the model itself makes, in the format of reference traces."""

import json
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from catalogs.entries import load
from catalogs.references import ReferenceCase
from tasks.surface.state import SurfaceState
from tasks.vehicle.parameters import Vehicle
from tasks.vehicle.rollout import Mode, simulate_scenario

CONDITIONS = {
    "wet": {"weather": "rain", "surface_coefficient": 0.43415, "initial_speed_km_h": 40.0},
    "snowy": {"weather": "snow", "surface_coefficient": 0.42, "initial_speed_km_h": 40.0},
    "bump": {"weather": "dry", "surface_coefficient": 0.82, "initial_speed_km_h": 40.0}
    | {"hazard_center_m": 16.0, "hazard_length_m": 3.0, "hazard_height_m": 0.05},
    "roll": {"weather": "dry", "surface_coefficient": 0.82, "initial_speed_km_h": 40.0}
    | {"hazard_center_m": 20.0, "hazard_length_m": 3.0, "hazard_height_m": -0.08}
    | {"peak_pressure_mpa": None, "brake_onset_s": None, "stopping_distance_m": None},
    "trigger": {"weather": "dry", "surface_coefficient": 0.82, "initial_speed_km_h": 60.0}
    | {"brake_onset_s": None, "brake_onset_m": 12.0, "ramp_s": 0.2},
}
NOISE = {"speed": 0.005, "pitch": 0.005, "slip": 0.001, "wheel_load": 5.0}
Make = Callable[..., Path]


@pytest.fixture(scope="session")
def vehicle() -> Vehicle:
    return load("vehicle", "paper-reference")


def write_traces(
    folder: Path, car: Vehicle, mode: Mode, names: tuple[str, ...] = ("wet", "snowy"), noise: float = 1.0
) -> Path:
    """Write a folder of traces of a vehicle, with noise keyed by the case."""
    (folder / "development").mkdir(parents=True)
    rows = []
    for number, name in enumerate(names):
        row = {"case": name, "split": "development", "peak_pressure_mpa": 2.3, "brake_onset_s": 0.3}
        row |= CONDITIONS[name]
        rows.append(row)
        pq.write_table(_trace(car, ReferenceCase.model_validate(row), mode, number, noise),
                       folder / "development" / f"{name}.parquet")  # fmt: skip
    (folder / "cases.json").write_text(json.dumps(rows))
    return folder


@pytest.fixture
def make_traces(tmp_path: Path) -> Make:
    """Return `write_traces` for a folder of the test."""
    return partial(write_traces, tmp_path / "traces")


def _trace(car: Vehicle, case: ReferenceCase, mode: Mode, number: int, noise: float) -> pa.Table:
    surface = SurfaceState(kind=case.weather, friction=case.surface_coefficient)
    ride = simulate_scenario(car, surface, case.controls(), case.hazard(), mode=mode, duration_s=8.0)
    model = ride.columns
    end = int(np.argmax(model["speed"] <= 0.0)) or len(model["speed"])
    rng = np.random.Generator(np.random.Philox(key=[7, number]))
    columns = {"time": model["t_ns"] * 1e-9, "station": model["station"], "speed": model["speed"]}
    columns["pitch"] = np.rad2deg(model["pitch"] + ride.static_pitch)
    for wheel in ("fl", "fr", "rl", "rr"):
        columns[f"slip_{wheel}"] = np.clip(model[f"braking_slip_{wheel[0]}"], 0, 1)
        columns[f"wheel_load_{wheel}"] = model[f"axle_load_{wheel[0]}"] / 2
    for name, size in NOISE.items():
        for column in [c for c in columns if c.startswith(name)]:
            columns[column] = columns[column] + noise * size * rng.normal(size=len(columns[column]))
    return pa.table({name: values[:end] for name, values in columns.items()})


@pytest.fixture
def changed() -> Callable[..., Vehicle]:
    """A vehicle with another knot of one family's table."""

    def change(car: Vehicle, family: str, group: str, knot: int, value: float) -> Vehicle:
        table = car.families[family]
        values = list(getattr(table, group))
        values[knot] = value
        return replace(car, families={**car.families, family: replace(table, **{group: tuple(values)})})

    return change
