"""Campaign folders read as drives: any channels, no split, for protocols that look at braking events."""

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import yaml

from tasks.errors import InputError
from tasks.recordings.channels import CHANNELS_BY_NAME
from tasks.recordings.events import Drive
from tasks.surface.state import Weather

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
    header = yaml.safe_load((folder / "campaign.yaml").read_text())
    absent = [key for key in ("campaign", "vehicle", "sample_rate_hz") if key not in (header or {})]
    if absent:
        raise InputError([f"{folder / 'campaign.yaml'} needs the key {key}" for key in absent])
    interval = 1.0 / float(header["sample_rate_hz"])
    rows = list(csv.DictReader((folder / "runs.csv").read_text(encoding="utf-8-sig").splitlines()))
    absent = [key for key in ("run", *WEATHER) if rows and key not in rows[0]]
    if absent:
        raise InputError([f"{folder / 'runs.csv'} needs the column {key}" for key in absent])
    problems: list[str] = []
    drives: list[Drive] = []
    for row in rows:
        path = folder / "runs" / f"{row['run']}.parquet"
        if not path.is_file():
            problems.append(f"{row['run']}: runs.csv names it, but {path.name} is not in runs/")
            continue
        table = pq.read_table(path)
        columns = {
            name: np.asarray(table.column(name).to_numpy(), dtype=np.float64)
            for name in table.column_names
            if name in CHANNELS_BY_NAME
        }
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
    if not rows:
        problems.append("runs.csv has no runs")
    if problems:
        raise InputError([f"{folder.name}: {problem}" for problem in problems])
    return DriveCampaign(name=str(header["campaign"]), vehicle=str(header["vehicle"]), drives=tuple(drives))
