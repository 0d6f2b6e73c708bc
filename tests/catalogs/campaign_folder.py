"""A campaign folder of six runs that brake alike, to be read as it is or with a fault put in."""

import csv
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import yaml

from catalogs.campaigns import read_campaign
from tasks.errors import InputError

TOLERANCES = {
    "pressure_gain": 0.02, "mass": 0.01, "pitch_gain": 0.02, "wheel_radius": 0.005, "suspension_damping": 0.04,
    "suspension_stiffness": 0.02, "grade": 0.0015,
    "run": {"initial_speed_m_s": 0.05, "friction": 0.03, "acceleration_bias_m_s2": 0.03, "pitch_offset_deg": 0.03},
}  # fmt: skip
NAMES = [f"run-{i:02d}" for i in range(1, 7)]


def braking_columns(seed: int) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(seed)
    t = np.arange(300) * 0.01
    pressure = np.clip((t - 1.0) / 0.3, 0.0, 1.0) * 1.5
    acceleration = -2.0 * pressure
    speed = 20.0 + np.cumsum(acceleration) * 0.01
    pitch = 0.4 * pressure
    columns = {
        "brake_pressure": pressure, "speed": speed, "longitudinal_acceleration": acceleration,
        "wheel_speed_front": speed / 0.32, "wheel_speed_rear": speed / 0.32, "pitch": pitch,
        "pitch_rate": np.gradient(pitch, 0.01), "vertical_acceleration": np.zeros(300),
    }  # fmt: skip
    return {"time": t, **{name: x + 0.01 * rng.standard_normal(300) for name, x in columns.items()}}


def write_run(folder: Path, name: str, columns: dict[str, np.ndarray]) -> None:
    pq.write_table(pa.table(columns), folder / "runs" / f"{name}.parquet")


def write_campaign(folder: Path) -> Path:
    (folder / "runs").mkdir()
    header = {
        "campaign": "toy", "vehicle": "paper-reference", "sample_rate_hz": 100,
        "split": {"train": NAMES[:3], "held_out": NAMES[3:]}, "tolerances_1sigma": TOLERANCES,
    }  # fmt: skip
    (folder / "campaign.yaml").write_text(yaml.safe_dump(header))
    row = {
        "weather": "dry", "precipitation_mm_h": 0.0, "snow_accumulation_h": 0.0, "direction": 1,
        "disc_temperature_above_ambient_c": 20.0, "hazard_center_m": 0.0, "hazard_length_m": 0.0,
        "hazard_height_m": 0.0,
    }  # fmt: skip
    with open(folder / "runs.csv", "w", newline="") as file:
        writer = csv.DictWriter(file, ["run", *row])
        writer.writeheader()
        writer.writerows({"run": name, **row} for name in NAMES)
    for i, name in enumerate(NAMES):
        write_run(folder, name, braking_columns(i))
    return folder


def list_problems(folder: Path) -> str:
    """Return the problems that reading the folder tells."""
    with pytest.raises(InputError) as caught:
        read_campaign(folder)
    return str(caught.value)


def change_header(folder: Path, change: Callable[[dict], object]) -> None:
    header = yaml.safe_load((folder / "campaign.yaml").read_text())
    change(header)
    (folder / "campaign.yaml").write_text(yaml.safe_dump(header))
