"""Reading a measurement campaign: campaign.yaml, runs.csv and runs/*.parquet, with every problem listed."""

import hashlib
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from pydantic import BaseModel, ConfigDict, field_validator

from catalogs.campaign_files import (
    LARGEST_RUN,
    CampaignHeader,
    parse_columns,
    parse_rows,
    read_header_bytes,
)
from catalogs.channel_maps.tolerances import Tolerances as TolerancesEntry
from catalogs.documents import read_content
from catalogs.entries import load
from catalogs.quantities import Text, parse_entry
from catalogs.sentences import cap_problems, shorten, shorten_value
from tasks.campaign.assembly import judge_columns
from tasks.campaign.campaign import (
    CHANNELS,
    SESSION,
    Campaign,
    Run,
    Tolerances,
    find_motion,
)
from tasks.campaign.channels import BRAKE_SIGNALS, CHANNELS_BY_NAME, COLUMN_UNITS, SpeedSource
from tasks.campaign.checks import apply_checks
from tasks.campaign.measured import MeasuredRun, Session
from tasks.campaign.resting_pressure import find_brake_rest, find_throttle_rest, measure_resting_levels
from tasks.campaign.slow_channels import collect_samples, fill_between_samples
from tasks.errors import InputError
from tasks.surface.weather import DRY

NEEDED = ("brake_pressure", "speed")
"""Channels without which a campaign says nothing; another of `BRAKE_SIGNALS` may stand in for the first."""
TOLERANCE_KEYS = (
    "pressure_gain",
    "mass",
    "pitch_gain",
    "wheel_radius",
    "suspension_damping",
    "suspension_stiffness",
    "grade",
)
RUN_NUMBERS = (
    "precipitation_mm_h", "snow_accumulation_h", "direction", "disc_temperature_above_ambient_c", "hazard_center_m",
    "hazard_length_m", "hazard_height_m",
)  # fmt: skip

HEAT_COLUMN = "braking_heat_j_kg"
"""Column of runs.csv with the heat of the discs that an import estimates; a campaign may lack it."""
SLOPE_COLUMN = "felt_slope_rad"
"""Column of runs.csv with the slope of the road that an import reads off the accelerometer; a campaign may lack it."""
GAUGE_CHECKS = ("common_rest", "highest_rest")
"""Checks of a brake pressure that rests above 0."""
STEEPEST_ROAD = 0.4
"""Slope beyond which no road goes: our own choice, above the grade that `physical_limits.yaml` allows [rad]."""


class Split(BaseModel):
    """Names of the runs that may be fitted, and of those that only judge."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    train: tuple[Text, ...]
    held_out: tuple[Text, ...]


class MeasuredHeader(CampaignHeader):
    """campaign.yaml of a campaign with which the model is compared."""

    split: Split
    tolerances_1sigma: TolerancesEntry
    not_measured: tuple[Text, ...] = ()
    brake_signal: Text | None = None
    brake_stands_for: Text | None = None
    speed_from: SpeedSource = "ground"

    @field_validator("tolerances_1sigma")
    @classmethod
    def _are_all_given(cls, tolerances: TolerancesEntry) -> TolerancesEntry:
        # an import writes what its map leaves open; here nothing is assumed
        if missing := tolerances.list_assumed():
            raise ValueError(f"{', '.join(missing)} must be given: one sigma of each number")
        return tolerances


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
    header_bytes, table_bytes = read_header_bytes(folder)
    header, rows = _read_header_and_runs(folder, header_bytes, table_bytes)
    train, held_out = header.split.train, header.split.held_out
    problems = _find_split_problems([row["run"] for row in rows], train, held_out)
    problems += _find_channel_problems(header.not_measured)
    problems += _find_brake_problems(header)
    signal = _find_brake_signal(header)
    needed = [name for name in ("time", signal, *NEEDED, *CHANNELS) if name not in header.not_measured]
    needed = list(dict.fromkeys(needed))
    digest = hashlib.sha256(header_bytes + table_bytes)
    interval, judged = 1.0 / header.sample_rate_hz, set(held_out)
    runs, first_of, table = [], dict[bytes, str](), load("table of checks")
    readable: list[MeasuredRun] = []
    for row in rows:
        path = folder / "runs" / f"{row['run']}.parquet"
        if not path.is_file():
            problems.append(f"{row['run']}: runs.csv names it, but {path.name} is not in runs/")
            continue
        try:
            content = read_content(path, "run", LARGEST_RUN)
            digest.update(row["run"].encode() + content)
            if (twin := first_of.setdefault(content, row["run"])) != row["run"]:
                problems.append(
                    f"{row['run']}: must be a recording of its own; its file is that of {twin}: remove one"
                )
            columns, units = parse_columns(content, path.name, COLUMN_UNITS)
            columns = {name: values for name, values in columns.items() if name not in header.not_measured}
            about = MeasuredRun(
                name=row["run"],
                interval=interval,
                slippery=row["weather"] != DRY,
                over_feature=float(row["hazard_length_m"]) > 0.0,
            )
            measured, found = judge_columns(
                columns, units, about, needed, table, brake_stands_in=header.brake_stands_for is not None
            )
        except InputError as error:
            found = list(error.problems)
        problems += [f"{row['run']}: {problem}" for problem in found]
        if not found:
            readable.append(measured)
        if not found and signal in columns and "speed" in columns:
            columns["brake_pressure"] = BRAKE_SIGNALS[signal] * columns[signal]
            run = _make_run(
                row, columns, interval, held_out=row["run"] in judged, of_wheels=header.speed_from == "wheels"
            )
            first, _ = find_motion(run.speed)
            runs.append(run.begin_at(first) if first else run)
    violations = apply_checks(table.session, Session(runs=readable))
    problems += [one.sentence for one in violations if one.check.fault != "warning"]
    if problems:
        raise InputError(cap_problems([f"{shorten(folder.name)}: {problem}" for problem in problems]))
    zero = 0.0
    if header.brake_stands_for is None:
        taught = {
            run.name: {"brake_pressure": run.pressure, "speed": run.speed} for run in runs if not run.held_out
        }
        zero = find_brake_rest(measure_resting_levels(taught, interval))
    runs = [run.lower_pressure(zero) for run in runs] if zero else runs
    rest = find_throttle_rest([run for run in runs if not run.held_out])
    resting = (one.sentence for one in violations if one.check.name in GAUGE_CHECKS)
    split = "\n".join(["train", *sorted(train), "held_out", *sorted(held_out)])
    return Campaign(
        name=header.campaign,
        vehicle=header.vehicle,
        runs=tuple(run.lower_throttle(rest) if rest else run for run in runs),
        tolerances=_make_tolerances(header.tolerances_1sigma),
        content_hash=digest.hexdigest(),
        split_hash=hashlib.sha256(split.encode()).hexdigest(),
        channels=tuple(name for name in CHANNELS if name in needed),
        brake_signal=signal if header.brake_stands_for is None else header.brake_stands_for,
        brake_rest=zero,
        throttle_rest=rest,
        resting_gauge="" if zero else next(resting, ""),
    )


def _read_header_and_runs(
    folder: Path, header: bytes, table: bytes
) -> tuple[MeasuredHeader, list[dict[str, str]]]:
    """Header and runs, or the problems of both at once."""
    problems: list[str] = []
    checked, rows = None, []
    try:
        checked = parse_entry(MeasuredHeader, header, "campaign.yaml", "campaign's header")
    except InputError as error:
        problems += error.problems
    try:
        rows = parse_rows(table, ("run", "weather", *RUN_NUMBERS), (*RUN_NUMBERS, HEAT_COLUMN, SLOPE_COLUMN))
        problems += [
            f"{row['run']}: direction must be 1 or -1; it is {shorten(row['direction'], 40)}"
            for row in rows
            if float(row["direction"]) not in (1.0, -1.0)
        ]
        problems += [
            f"{row['run']}: {HEAT_COLUMN} must not be negative; it is {row[HEAT_COLUMN]}"
            for row in rows
            if float(row.get(HEAT_COLUMN, 0.0)) < 0.0
        ]
        problems += [
            f"{row['run']}: {SLOPE_COLUMN} must be within {STEEPEST_ROAD} of 0; it is {row[SLOPE_COLUMN]}"
            for row in rows
            if abs(float(row.get(SLOPE_COLUMN, 0.0))) > STEEPEST_ROAD
        ]
    except InputError as error:
        problems += error.problems
    if problems or checked is None:
        raise InputError(cap_problems([f"{shorten(folder.name)}: {problem}" for problem in problems]))
    return checked, rows


def _find_split_problems(names: Sequence[str], train: Sequence[str], held_out: Sequence[str]) -> list[str]:
    problems = [
        f"{shorten(name, 60)}: is in both parts of the split" for name in sorted(set(train) & set(held_out))
    ]
    problems += [
        f"{shorten(name, 60)}: is in neither part of the split"
        for name in names
        if name not in {*train, *held_out}
    ]
    problems += [
        f"{shorten(name, 60)}: the split names it, but runs.csv does not"
        for name in sorted({*train, *held_out} - set(names))
    ]
    problems += [
        f"split {part} needs at least one run; it has none: list runs there in campaign.yaml, or give them"
        f" `part: {part}` in the channel map and import again"
        for part, runs in (("train", train), ("held_out", held_out))
        if not runs
    ]
    return problems


def _find_channel_problems(not_measured: Sequence[str]) -> list[str]:
    """Sentences on channels that do not exist, and on those without which nothing can be judged."""
    problems = [
        f"not_measured: {shorten_value(name)} is no channel; there are: {', '.join(CHANNELS_BY_NAME)}"
        for name in not_measured
        if name not in CHANNELS_BY_NAME
    ]
    if "speed" in not_measured:
        problems.append(
            "channel speed must be measured: closing the loop compares the speed under a known brake"
        )
    return problems


def _find_brake_problems(header: MeasuredHeader) -> list[str]:
    """Sentences on a campaign of which nobody can say how hard the driver braked."""
    signal = _find_brake_signal(header)
    if signal not in BRAKE_SIGNALS:
        return [f"brake_signal: {shorten_value(signal)} must be one of {', '.join(BRAKE_SIGNALS)}"]
    if signal in header.not_measured:
        return [
            f"channel {signal} must be measured: closing the loop compares the speed under a known brake; one of"
            f" {', '.join(BRAKE_SIGNALS)} is enough"
        ]
    return []


def _find_brake_signal(header: MeasuredHeader) -> str:
    """Return the channel that says how hard the driver brakes: the campaign's own word, else the brake pressure."""
    return header.brake_signal or "brake_pressure"


def _make_run(
    row: dict[str, str], columns: dict[str, np.ndarray], interval: float, *, held_out: bool, of_wheels: bool
) -> Run:
    pressure = columns["brake_pressure"]
    return Run(
        name=row["run"],
        held_out=held_out,
        weather=row["weather"],
        precipitation_mm_h=float(row["precipitation_mm_h"]),
        snow_accumulation_h=float(row["snow_accumulation_h"]),
        direction=int(float(row["direction"])),
        disc_rise=float(row["disc_temperature_above_ambient_c"]),
        braking_heat=float(row.get(HEAT_COLUMN, 0.0)),
        felt_slope=float(row.get(SLOPE_COLUMN, 0.0)),
        hazard_center=float(row["hazard_center_m"]),
        hazard_length=float(row["hazard_length_m"]),
        hazard_height=float(row["hazard_height_m"]),
        interval=interval,
        pressure=pressure,
        response=np.column_stack(
            [
                fill_between_samples(name, columns[name]) if name in columns else np.zeros(len(pressure))
                for name in CHANNELS
            ]
        ),
        drive_torque=columns.get("engine_torque"),
        road_slope=np.radians(columns["road_slope"]) if "road_slope" in columns else None,
        throttle=columns.get("throttle"),
        speed_of_wheels=of_wheels,
        sampled=collect_samples(columns),
    )


def _make_tolerances(entry: TolerancesEntry) -> Tolerances:
    assert len(TOLERANCE_KEYS) == len(SESSION)
    run = entry.run
    return Tolerances(
        session=tuple(getattr(entry, key) for key in TOLERANCE_KEYS),
        initial_speed=run.initial_speed_m_s,
        friction=run.friction,
        acceleration_bias=run.acceleration_bias_m_s2,
        pitch_offset=run.pitch_offset_deg,
    )
