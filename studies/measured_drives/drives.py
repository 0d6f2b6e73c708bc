"""Campaign folders read as drives: any channels, no split, for protocols that look at braking events."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from catalogs.campaign_files import (
    LARGEST_RUN,
    CampaignHeader,
    find_unit_problems,
    parse_columns,
    parse_rows,
    read_header_bytes,
)
from catalogs.documents import read_content
from catalogs.quantities import parse_entry
from catalogs.sentences import cap_problems, shorten
from studies.measured_drives.events import RecordedRun
from tasks.campaign.channels import CHANNELS_BY_NAME, COLUMN_UNITS
from tasks.campaign.slow_channels import fill_between_samples
from tasks.errors import InputError
from tasks.surface.weather import Weather

NEEDED = ("brake_pressure", "speed", "pitch", "longitudinal_acceleration")
WEATHER = ("weather", "precipitation_mm_h", "snow_accumulation_h")


@dataclass(frozen=True, kw_only=True)
class DriveCampaign:
    """The parts of a campaign that a protocol needs.

    Parameters
    ----------
    name, vehicle : of the campaign, and of the catalogue entry it is compared with
    drives : runs in the order of runs.csv; a run without a drive column is a drive of its own
    """

    name: str
    vehicle: str
    drives: tuple[RecordedRun, ...]


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
    header, rows = _read_header_and_runs(folder)
    interval = 1.0 / header.sample_rate_hz
    problems: list[str] = []
    drives: list[RecordedRun] = []
    for row in rows:
        path = folder / "runs" / f"{row['run']}.parquet"
        if not path.is_file():
            problems.append(f"{row['run']}: runs.csv names it, but {path.name} is not in runs/")
            continue
        try:
            columns, units = parse_columns(
                read_content(path, "run", LARGEST_RUN), path.name, CHANNELS_BY_NAME
            )
        except InputError as error:
            problems += [f"{row['run']}: {problem}" for problem in error.problems]
            continue
        columns = {name: fill_between_samples(name, values) for name, values in columns.items()}
        problems += find_unit_problems(units, COLUMN_UNITS, row["run"])
        problems += [f"{row['run']}: channel {name} is missing" for name in needed if name not in columns]
        problems += [
            f"{row['run']}: channel {name} has a gap; import the recording again"
            for name, values in columns.items()
            if not np.isfinite(values).all()
        ]
        drives.append(
            RecordedRun(
                name=row["run"],
                drive=row.get("drive") or row["run"],
                interval=interval,
                columns=columns,
                weather=Weather(
                    kind=row["weather"],
                    precipitation_mm_h=float(row["precipitation_mm_h"]),
                    snow_accumulation_h=float(row["snow_accumulation_h"]),
                ),
            )
        )
    if problems:
        raise InputError(cap_problems([f"{shorten(folder.name)}: {problem}" for problem in problems]))
    return DriveCampaign(name=header.campaign, vehicle=header.vehicle, drives=tuple(drives))


def _read_header_and_runs(folder: Path) -> tuple[CampaignHeader, list[dict[str, str]]]:
    """Header and runs, or the problems of both at once."""
    header_bytes, table = read_header_bytes(folder)
    problems: list[str] = []
    checked, rows = None, []
    path = folder / "campaign.yaml"
    try:
        checked = parse_entry(CampaignHeader, header_bytes, path, "campaign's header")
    except InputError as error:
        problems += error.problems
    try:
        rows = parse_rows(table, ("run", *WEATHER), WEATHER[1:])
    except InputError as error:
        problems += [f"{shorten(folder)}: {problem}" for problem in error.problems]
    if problems or checked is None:
        raise InputError(cap_problems(problems))
    return checked, rows
