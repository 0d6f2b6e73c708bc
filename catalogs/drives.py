"""Campaign folders read as drives: any channels, no split, for protocols that look at braking events."""

import csv
from dataclasses import dataclass
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import yaml

from tasks.errors import InputError
from tasks.recordings.channels import CHANNELS_BY_NAME
from tasks.recordings.events import Drive
from tasks.surface.state import Weather, WeatherKind

NEEDED = ("brake_pressure", "speed", "pitch", "longitudinal_acceleration")
WEATHER = ("weather", "precipitation_mm_h", "snow_accumulation_h")


@dataclass(frozen=True, kw_only=True)
class DriveCampaign:
    """What a protocol needs of a campaign.

    Parameters
    ----------
    name, vehicle : of the campaign, and of the catalogue entry it is compared with
    drives : runs in the order of runs.csv; a run without a drive column is a drive of its own
    """

    name: str
    vehicle: str
    drives: tuple[Drive, ...]


def read_drives(folder: str | Path, *, needed: tuple[str, ...] = NEEDED) -> DriveCampaign:
    """Read a campaign folder.

    Parameters
    ----------
    folder : holds campaign.yaml, runs.csv and runs/NAME.parquet
    needed : channels that every run must have

    Raises
    ------
    InputError
        Listing missing files, keys and channels.
    """
    folder = Path(folder)
    missing = [name for name in ("campaign.yaml", "runs.csv") if not (folder / name).is_file()]
    if missing:
        raise InputError([f"a campaign folder needs {name}; {folder} has none" for name in missing])
    header = _header(folder / "campaign.yaml")
    rows = _rows(folder / "runs.csv")
    interval = 1.0 / float(header["sample_rate_hz"])
    problems: list[str] = []
    drives: list[Drive] = []
    for row in rows:
        path = folder / "runs" / f"{row['run']}.parquet"
        if not path.is_file():
            problems.append(f"{row['run']}: runs.csv names it, but {path.name} is not in runs/")
            continue
        try:
            table = pq.read_table(path)
            columns = {
                name: np.asarray(table.column(name).to_numpy(), dtype=np.float64)
                for name in table.column_names
                if name in CHANNELS_BY_NAME
            }
        except (pa.ArrowInvalid, OSError, ValueError) as error:
            problems.append(
                f"{row['run']}: {path.name} must be a Parquet file of numbers; {str(error)[:100]}"
            )
            continue
        problems += [f"{row['run']}: channel {name} is missing" for name in needed if name not in columns]
        problems += [
            f"{row['run']}: channel {name} has a gap; import the recording again"
            for name, values in columns.items()
            if not np.isfinite(values).all()
        ]
        drives.append(
            Drive(
                name=row["run"],
                drive=row.get("drive") or row["run"],
                interval=interval,
                columns=columns,
                weather=Weather(
                    kind=row["weather"],  # type: ignore[arg-type]
                    precipitation_mm_h=float(row["precipitation_mm_h"]),
                    snow_accumulation_h=float(row["snow_accumulation_h"]),
                ),
            )
        )
    if problems:
        raise InputError([f"{folder.name}: {problem}" for problem in problems])
    return DriveCampaign(name=str(header["campaign"]), vehicle=str(header["vehicle"]), drives=tuple(drives))


def _header(path: Path) -> dict[str, Any]:
    try:
        header = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise InputError(f"{path} must be YAML; {' '.join(str(error).split())[:200]}") from None
    if not isinstance(header, dict):
        raise InputError(f"{path} must be a table of campaign, vehicle and sample_rate_hz")
    absent = [key for key in ("campaign", "vehicle", "sample_rate_hz") if key not in header]
    if absent:
        raise InputError([f"{path} needs the key {key}" for key in absent])
    rate = header["sample_rate_hz"]
    if not isinstance(rate, int | float) or not rate > 0:
        raise InputError(f"{path}: sample_rate_hz must be a number above 0; it is {rate}")
    return header


def _rows(path: Path) -> list[dict[str, str]]:
    rows = list(csv.DictReader(path.read_text(encoding="utf-8-sig").splitlines()))
    if not rows:
        raise InputError(f"{path} must list at least one run; it lists none")
    absent = [key for key in ("run", *WEATHER) if key not in rows[0]]
    if absent:
        raise InputError([f"{path} needs the column {key}" for key in absent])
    problems = []
    for row in rows:
        if row["weather"] not in get_args(WeatherKind):
            kinds = ", ".join(get_args(WeatherKind))
            problems.append(f"{row['run']}: weather must be one of {kinds}; it is {row['weather']}")
        for key in WEATHER[1:]:
            try:
                float(row[key])
            except (TypeError, ValueError):
                problems.append(f"{row['run']}: {key} must be a number; it is {row[key]}")
    if problems:
        raise InputError([f"{path}: {problem}" for problem in problems])
    return rows
