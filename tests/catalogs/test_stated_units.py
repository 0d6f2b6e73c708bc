"""A unit that a Parquet file states is the one that its reader takes, or the file is refused."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import yaml

from catalogs.references import TRACE_UNITS, read_reference
from studies.foreign_video.judge import read_claim
from studies.measured_drives.drives import read_drives
from tasks.campaign.channels import COLUMN_UNITS
from tasks.errors import InputError

DRIVE = {
    name: COLUMN_UNITS[name] for name in ("brake_pressure", "speed", "pitch", "longitudinal_acceleration")
}
CLAIM = {"time": "s", "pitch": "rad", "speed": "m s-1"}


TIME = np.linspace(0.0, 3.0, 30)
TRACE = {
    **{name: np.full(30, 4e3 if unit == "N" else 0.1) for name, unit in TRACE_UNITS.items()},
    "time": TIME, "speed": 16.7 - TIME, "station": 16.7 * TIME - TIME**2 / 2,
}  # fmt: skip


def write_table(path: Path, units: dict[str, str], values: dict[str, np.ndarray] | None = None) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    fields = [
        pa.field(name, pa.float64(), metadata={"units": unit} if unit else None)
        for name, unit in units.items()
    ]
    columns = [(values or {}).get(name, np.linspace(0.0, 1.0, 30)) for name in units]
    pq.write_table(pa.table(columns, schema=pa.schema(fields)), path)


def read_as_claim(folder: Path, units: dict[str, str]) -> Any:
    write_table(folder / "claim.parquet", units)
    return read_claim(folder / "claim.parquet")


def read_as_trace(folder: Path, units: dict[str, str], **changes: np.ndarray) -> Any:
    write_table(folder / "a.parquet", units, TRACE | changes)
    case = {"case": "a", "weather": "dry", "surface_coefficient": 0.8, "initial_speed_km_h": 60.0}
    (folder / "cases.json").write_text(json.dumps([case]))
    return read_reference(folder)


def read_as_drive(folder: Path, units: dict[str, str]) -> Any:
    write_table(folder / "runs" / "a.parquet", units)
    header = {"campaign": "toy", "vehicle": "paper-reference", "sample_rate_hz": 30}
    (folder / "campaign.yaml").write_text(yaml.safe_dump(header))
    row = {"run": "a", "weather": "dry", "precipitation_mm_h": 0.0, "snow_accumulation_h": 0.0}
    pd.DataFrame([row]).to_csv(folder / "runs.csv", index=False)
    return read_drives(folder)


READERS: dict[str, tuple[Callable[[Path, dict[str, str]], Any], dict[str, str]]] = {
    "claim": (read_as_claim, CLAIM),
    "trace": (read_as_trace, TRACE_UNITS),
    "drive": (read_as_drive, DRIVE),
}


@pytest.mark.parametrize("reader", READERS)
def test_the_unit_that_a_reader_takes_may_be_stated(reader: str, tmp_path: Path) -> None:
    read, units = READERS[reader]
    assert read(tmp_path, units)


@pytest.mark.parametrize(
    ("reader", "column", "unit"),
    [
        ("claim", "pitch", "deg"),  # as the runs of a campaign have it
        ("claim", "time", "ms"),
        ("claim", "speed", "km/h"),
        ("trace", "pitch", "rad"),  # as the telemetry of a dataset has it
        ("trace", "brake_pressure", "bar"),
        ("trace", "wheel_load_fl", "kN"),
        ("drive", "pitch", "rad"),
        ("drive", "brake_pressure", "bar"),
    ],
)
def test_a_stated_unit_that_is_another_one_is_refused(
    reader: str, column: str, unit: str, tmp_path: Path
) -> None:
    read, units = READERS[reader]
    with pytest.raises(
        InputError, match=f"column {column} must be in .*; its metadata says {unit}: convert it"
    ):
        read(tmp_path, units | {column: unit})


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (
            {"speed": 3.6 * TRACE["speed"]},
            "column speed must begin at initial_speed_km_h, 16.67 m/s; it begins at 60.12",
        ),
        (
            {"time": 1e3 * TIME},
            "column station must grow by speed times time, .* the unit of time, speed or station",
        ),
        ({"station": TRACE["station"] / 1e3}, "column station must grow by speed times time"),
        (
            {name: values / 1e3 for name, values in TRACE.items() if name.startswith("wheel_load_")},
            "the columns wheel_load must add up to a car, 1000 to 100000 N; they add up to 16",
        ),
    ],
)
def test_a_trace_without_stated_units_whose_columns_contradict_is_refused(
    changes: dict[str, np.ndarray], words: str, tmp_path: Path
) -> None:
    assert read_as_trace(tmp_path, dict.fromkeys(TRACE_UNITS, ""))
    with pytest.raises(InputError, match=words):
        read_as_trace(tmp_path, dict.fromkeys(TRACE_UNITS, ""), **changes)
