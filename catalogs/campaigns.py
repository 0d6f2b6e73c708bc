"""Reading a measurement campaign: campaign.yaml, runs.csv and runs/*.parquet, with every problem listed."""

import csv
import hashlib
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import yaml

from tasks.closure.campaign import CHANNELS, SESSION, Campaign, Run, Tolerances
from tasks.closure.validation import COLUMN_UNITS, run_problems
from tasks.errors import InputError

TOLERANCE_KEYS = (
    "pressure_gain",
    "mass",
    "pitch_gain",
    "wheel_radius",
    "suspension_damping",
    "suspension_stiffness",
    "grade",
)
RUN_TOLERANCE_KEYS = ("initial_speed_m_s", "friction", "acceleration_bias_m_s2", "pitch_offset_deg")
RUN_KEYS = (
    "precipitation_mm_h", "snow_accumulation_h", "direction", "disc_temperature_above_ambient_c", "hazard_center_m",
    "hazard_length_m", "hazard_height_m",
)  # fmt: skip


def read_campaign(folder: str | Path) -> Campaign:
    """Read and check a campaign folder.

    Parameters
    ----------
    folder : holds campaign.yaml, runs.csv and runs/NAME.parquet

    Returns
    -------
    The campaign, with SHA-256 of all that was read and of the split.

    Raises
    ------
    InputError
        With one sentence per problem: files, keys, the split, and what is wrong in which run and channel.
    """
    folder = Path(folder)
    missing = [name for name in ("campaign.yaml", "runs.csv") if not (folder / name).is_file()]
    if missing:
        raise InputError([f"a campaign folder needs {name}; {folder} has none" for name in missing])
    header_bytes, table_bytes = (folder / "campaign.yaml").read_bytes(), (folder / "runs.csv").read_bytes()
    try:
        header = yaml.safe_load(header_bytes)
    except yaml.YAMLError as error:
        raise InputError(f"{folder / 'campaign.yaml'} must be YAML; reading stopped at: {error}") from error
    if not isinstance(header, dict):
        raise InputError(
            f"{folder / 'campaign.yaml'} must be a mapping with campaign, vehicle, split and tolerances_1sigma"
        )
    rows = list(csv.DictReader(table_bytes.decode("utf-8-sig").splitlines()))
    problems = _header_problems(header) + _table_problems(rows)
    if problems:
        raise InputError([f"{folder.name}: {problem}" for problem in problems])
    train, held_out = header["split"]["train"], header["split"]["held_out"]
    problems = _split_problems([row["run"] for row in rows], train, held_out)

    digest = hashlib.sha256(header_bytes + table_bytes)
    runs = []
    for row in rows:
        path = folder / "runs" / f"{row['run']}.parquet"
        if not path.is_file():
            problems.append(f"{row['run']}: runs.csv names it, but {path.name} is not in runs/")
            continue
        content = path.read_bytes()
        digest.update(row["run"].encode() + content)
        try:
            columns, units = _read_columns(path)
        except (OSError, ValueError) as error:
            problems.append(f"{row['run']}: {path.name} is not a readable Parquet file ({error})")
            continue
        found = run_problems(columns, units, 1.0 / float(header["sample_rate_hz"]))
        problems += [f"{row['run']}: {problem}" for problem in found]
        if not found:
            runs.append(_run(row, columns, row["run"] in held_out, 1.0 / float(header["sample_rate_hz"])))
    if problems:
        raise InputError([f"{folder.name}: {problem}" for problem in problems])
    split = "\n".join(["train", *sorted(train), "held_out", *sorted(held_out)])
    return Campaign(
        name=str(header["campaign"]),
        vehicle=str(header["vehicle"]),
        runs=tuple(runs),
        tolerances=_tolerances(header["tolerances_1sigma"]),
        content_hash=digest.hexdigest(),
        split_hash=hashlib.sha256(split.encode()).hexdigest(),
    )


def _header_problems(header: dict[str, Any]) -> list[str]:
    needed = ("campaign", "vehicle", "sample_rate_hz", "split", "tolerances_1sigma")
    problems = [f"campaign.yaml needs the key {key}" for key in needed if key not in header]
    if problems:
        return problems
    split, tolerances = header["split"], header["tolerances_1sigma"]
    problems += [
        f"split needs a list {key}" for key in ("train", "held_out") if not isinstance(split.get(key), list)
    ]
    run = tolerances.get("run", {})
    for keys, place, where in ((TOLERANCE_KEYS, tolerances, ""), (RUN_TOLERANCE_KEYS, run, "run.")):
        for key in keys:
            if not isinstance(place.get(key), int | float) or place[key] <= 0:
                problems.append(f"tolerances_1sigma needs {where}{key} above 0; it is {place.get(key)}")
    if not isinstance(header["sample_rate_hz"], int | float) or header["sample_rate_hz"] <= 0:
        problems.append(f"sample_rate_hz must be above 0; it is {header['sample_rate_hz']}")
    return problems


def _table_problems(rows: list[dict[str, str]]) -> list[str]:
    if not rows:
        return ["runs.csv has no runs"]
    absent = [key for key in ("run", "weather", *RUN_KEYS) if key not in rows[0]]
    problems = [f"runs.csv needs the column {key}" for key in absent]
    for row in rows if not absent else []:
        if row["weather"] not in ("dry", "rain", "snow"):
            problems.append(f"{row['run']}: weather must be dry, rain or snow; it is {row['weather']}")
        for key in RUN_KEYS:
            try:
                float(row[key])
            except (TypeError, ValueError):
                problems.append(f"{row['run']}: {key} must be a number; it is {row[key]}")
        if row["direction"] not in ("1", "-1", "+1"):
            problems.append(f"{row['run']}: direction must be 1 or -1; it is {row['direction']}")
    return problems


def _split_problems(names: list[str], train: list[str], held_out: list[str]) -> list[str]:
    problems = [f"{name}: stands in both parts of the split" for name in sorted(set(train) & set(held_out))]
    problems += [
        f"{name}: is in neither part of the split" for name in names if name not in {*train, *held_out}
    ]
    problems += [
        f"{name}: the split names it, but runs.csv does not"
        for name in sorted({*train, *held_out} - set(names))
    ]
    problems += [
        f"split {part} needs at least 3 runs; it has {len(runs)}"
        for part, runs in (("train", train), ("held_out", held_out))
        if len(runs) < 3
    ]
    return problems


def _read_columns(path: Path) -> tuple[dict[str, np.ndarray], dict[str, str]]:
    table = pq.read_table(path)
    columns = {name: table.column(name).to_numpy().astype(np.float64) for name in table.column_names}
    units = {
        f.name: f.metadata[b"units"].decode() for f in table.schema if f.metadata and b"units" in f.metadata
    }
    return {name: columns[name] for name in columns if name in COLUMN_UNITS}, units


def _run(row: dict[str, str], columns: dict[str, np.ndarray], held_out: bool, interval: float) -> Run:
    return Run(
        name=row["run"],
        held_out=held_out,
        weather=row["weather"],
        precipitation_mm_h=float(row["precipitation_mm_h"]),
        snow_accumulation_h=float(row["snow_accumulation_h"]),
        direction=int(row["direction"]),
        disc_rise=float(row["disc_temperature_above_ambient_c"]),
        hazard_center=float(row["hazard_center_m"]),
        hazard_length=float(row["hazard_length_m"]),
        hazard_height=float(row["hazard_height_m"]),
        interval=interval,
        pressure=columns["brake_pressure"],
        response=np.column_stack([columns[name] for name in CHANNELS]),
    )


def _tolerances(values: dict[str, Any]) -> Tolerances:
    assert len(TOLERANCE_KEYS) == len(SESSION)
    run = values["run"]
    return Tolerances(
        session=tuple(float(values[key]) for key in TOLERANCE_KEYS),
        initial_speed=float(run["initial_speed_m_s"]),
        friction=float(run["friction"]),
        acceleration_bias=float(run["acceleration_bias_m_s2"]),
        pitch_offset=float(run["pitch_offset_deg"]),
    )
