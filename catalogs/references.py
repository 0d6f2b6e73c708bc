"""Reference traces: a folder with cases.json and one Parquet file a case."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import AliasChoices, BaseModel, ConfigDict, Field, ValidationError, model_validator

from catalogs.campaign_files import find_unit_problems, parse_columns
from catalogs.documents import LARGEST_YAML, parse_json, read_content
from catalogs.entries import load
from catalogs.names import Name, WeatherName
from catalogs.physical_limits import find_limit_problem
from catalogs.sentences import cap_problems, describe_rules, shorten_value
from tasks.errors import InputError
from tasks.eval.state_agreement import REFERENCE_COLUMNS, CaseFacts
from tasks.surface.road_profile import RoadHazard
from tasks.surface.weather import DRY
from tasks.vehicle.brake import BrakeCommand
from tasks.vehicle.rollout import Controls

AFTER_STOP_S = 12.0
"""How long past the reference's end the model may still roll before it counts as not stopping [s]."""

UNITS_APART = 1.3
"""Factor by which quantities of a trace may contradict each other [1]: m/s and km/h differ by 3.6, s and ms by 1000."""
LEAST_WAY = 1.0
"""Way from which speed and station are compared [m]."""
LOADS = (1e3, 1e5)
"""Weight of a car on its four wheels, from 100 kg to 10 t [N]."""
LARGEST_TRACE = 2**30
"""Bytes of a trace's Parquet [1]."""

Number = Annotated[float, Field(allow_inf_nan=False)]
Traces = dict[str, NDArray[np.float64]]
PRESSURE, CG_HEIGHT, ACCELERATION = "brake_pressure", "cg_height", "longitudinal_acceleration"
OPTIONAL_COLUMNS = (PRESSURE, CG_HEIGHT, ACCELERATION)
"""Columns that a trace may hold beside those that are scored."""
TRACE_UNITS = {
    "time": "s", "station": "m", "speed": "m/s", "pitch": "deg", PRESSURE: "MPa", CG_HEIGHT: "m", ACCELERATION: "m/s^2",
    **{name: "1" for name in REFERENCE_COLUMNS if name.startswith("slip_")},
    **{name: "N" for name in REFERENCE_COLUMNS if name.startswith("wheel_load_")},
}  # fmt: skip
"""Units in which the columns of a trace are scored."""


class ReferenceCase(BaseModel):
    """The conditions of one reference trace, as cases.json has them; other keys are ignored."""

    model_config = ConfigDict(extra="ignore", frozen=True, strict=True)

    case: Name
    split: str = "all"
    weather: WeatherName
    precipitation_mm_h: Number | None = None
    surface_coefficient: Annotated[float, Field(gt=0, le=2)]
    initial_speed_km_h: Annotated[float, Field(gt=0)]
    peak_pressure_mpa: Annotated[float, Field(ge=0)] | None = None
    ramp_s: Annotated[float, Field(ge=0)] = 0.5
    brake_onset_s: Number | None = None
    brake_onset_m: Number | None = Field(
        None,
        validation_alias=AliasChoices("brake_onset_m", "brake_onset_station_m", "brake_onset_position_m"),
    )
    hazard_center_m: Number = 0.0
    hazard_height_m: Number = 0.0
    hazard_length_m: Number = 0.0
    stopping_distance_m: Number | None = None
    static_pitch_deg: Number | None = None

    @model_validator(mode="after")
    def _keeps_physical_limits(self) -> "ReferenceCase":
        limits = load("table of physical limits")
        bounded = {
            "initial_speed_km_h": (self.initial_speed_km_h, limits.initial_speed),
            "peak_pressure_mpa": (self.peak_pressure_mpa or 0.0, limits.peak_pressure),
            "ramp_s": (self.ramp_s, limits.brake_time),
            "brake_onset_s": (abs(self.brake_onset_s or 0.0), limits.brake_time),
            "brake_onset_m": (abs(self.brake_onset_m or 0.0), limits.position),
            "hazard_center_m": (abs(self.hazard_center_m), limits.position),
            "hazard_length_m": (self.hazard_length_m, limits.hazard_length),
            "hazard_height_m": (abs(self.hazard_height_m), limits.hazard_height),
        }
        found = [find_limit_problem(name, value, limit) for name, (value, limit) in bounded.items()]
        if problems := [problem for problem in found if problem]:
            raise ValueError("; ".join(problems))
        return self

    @model_validator(mode="before")
    @classmethod
    def _null_is_left_out(cls, row: Any) -> Any:
        return {k: v for k, v in row.items() if v is not None} if isinstance(row, dict) else row

    @property
    def braked(self) -> bool:
        """Whether the case brakes at all."""
        return bool(self.peak_pressure_mpa) and (self.brake_onset_s, self.brake_onset_m) != (None, None)

    @property
    def control(self) -> str:
        """Variable of the case, as the paper's table of held-out cases groups it: road, weather or brake."""
        return "road" if self.hazard_height_m != 0 else "weather" if self.weather != DRY else "brake"

    def controls(self) -> Controls:
        """The driver: speed is held until the brake, and a case that does not brake coasts from the start."""
        brake = BrakeCommand(
            peak_pressure_mpa=(self.peak_pressure_mpa or 0.0) if self.braked else 0.0,
            ramp_s=self.ramp_s,
            onset_s=self.brake_onset_s if self.braked else None,
            onset_station_m=self.brake_onset_m if self.braked and self.brake_onset_s is None else None,
            hold_s=None,
            release_s=0.0,
        )
        return Controls(
            initial_speed=self.initial_speed_km_h / 3.6, brake=brake, hold_speed_until_brake=self.braked
        )

    def hazard(self) -> RoadHazard:
        """The road feature."""
        return RoadHazard(
            center_m=self.hazard_center_m, length_m=self.hazard_length_m, height_m=self.hazard_height_m
        )

    def facts(self, wheelbase: float) -> CaseFacts:
        """Return the facts that the judge gets of the case, beside its trace; the wheelbase is the model's [m]."""
        return CaseFacts(
            case=self.case,
            hazard_height=self.hazard_height_m,
            hazard_length=self.hazard_length_m,
            hazard_center=self.hazard_center_m,
            wheelbase=wheelbase,
            brake_onset=self.brake_onset_s if self.braked else None,
            brake_onset_station=self.brake_onset_m if self.braked else None,
            stopping_distance=self.stopping_distance_m if self.hazard_height_m == 0 else None,
        )

    def duration_s(self, reference: Mapping[str, NDArray[Any]]) -> float:
        """A whole number of seconds that covers the trace and the model's own stop [s]."""
        return float(np.ceil(reference["time"][-1] + AFTER_STOP_S))


def read_reference(folder: Path, split: str | None = None) -> list[tuple[ReferenceCase, Traces]]:
    """Every case of a folder of traces, with its columns as float64.

    Parameters
    ----------
    folder : with cases.json and the traces
    split : read the cases of this split only; None for all

    Raises
    ------
    InputError
        Listing every case whose condition or trace is missing or faulty, or the splits that exist.
    """
    path = folder / "cases.json"
    if not path.exists():
        raise InputError(f"{path}: no such file; a folder of traces holds cases.json and one Parquet a case")
    rows = parse_json(read_content(path, "list of cases", LARGEST_YAML), path, "list of cases")
    if not isinstance(rows, list) or not rows:
        raise InputError(f"{path}: must be a list of at least one case; it is {shorten_value(rows)}")
    problems: list[str] = []
    cases = []
    splits: set[str] = set()
    names: set[str] = set()
    for row in rows:
        try:
            case = ReferenceCase.model_validate(row)
            if case.case in names:
                problems.append(f"{path}: case {case.case} must stand once; it stands there again")
            names.add(case.case)
            splits.add(case.split)
            if split in (None, case.split):
                cases.append(_with_trace(folder, case))
        except ValidationError as error:
            name = row.get("case", "?") if isinstance(row, dict) else row
            problems += describe_rules(error, f"{path}: case {shorten_value(name)}")
        except InputError as error:
            problems += error.problems
    if not problems and not cases:
        problems.append(f"{path}: no case has the split {split}; there are: {', '.join(sorted(splits))}")
    if problems:
        raise InputError(cap_problems(problems))
    return cases


def trace_file(folder: Path, case: str) -> Path:
    """The Parquet file of a case.

    Raises
    ------
    InputError
        If there is none.
    """
    folders = [folder, *sorted(path for path in folder.iterdir() if path.is_dir())]
    found = [file for parent in folders if (file := parent / f"{case}.parquet").is_file()]
    if not found:
        raise InputError(f"{folder}: case {case} needs {case}.parquet here or one folder down; there is none")
    return found[0]


def _with_trace(folder: Path, case: ReferenceCase) -> tuple[ReferenceCase, Traces]:
    """A case with its columns, optional ones included; an open brake onset is read from the trace's pressure."""
    path = trace_file(folder, case.case)
    held, units = parse_columns(
        read_content(path, "trace", LARGEST_TRACE), str(path), (*REFERENCE_COLUMNS, *OPTIONAL_COLUMNS)
    )
    missing = [name for name in REFERENCE_COLUMNS if name not in held]
    if missing:
        raise InputError(f"{path}: a trace needs the columns {', '.join(missing)}; they are missing")
    columns = {name: held[name] for name in (*REFERENCE_COLUMNS, *OPTIONAL_COLUMNS) if name in held}
    problems = find_unit_problems(units, TRACE_UNITS, str(path))
    problems += [
        f"{path}: column {name} must hold numbers throughout; {int(np.sum(~np.isfinite(values)))} are not"
        for name, values in columns.items()
        if not np.isfinite(values).all()
    ]
    if not problems and not (len(columns["time"]) > 1 and (np.diff(columns["time"]) > 0).all()):
        problems.append(f"{path}: column time must hold at least two ascending times")
    if not problems:
        problems = [f"{path}: {problem}" for problem in _find_quantity_problems(case, columns)]
    if problems:
        raise InputError(problems)
    if case.peak_pressure_mpa and case.brake_onset_s is None and case.brake_onset_m is None:
        case = case.model_copy(update={"brake_onset_s": _find_onset(path, case.case, held)})
    return case, columns


def _find_quantity_problems(case: ReferenceCase, columns: Traces) -> list[str]:
    """Sentences on columns that contradict the case or each other by more than a factor: units that were mixed up."""
    time, station, speed = columns["time"], columns["station"], columns["speed"]
    begun, announced = float(speed[0]), case.initial_speed_km_h / 3.6
    driven, stated = float(np.trapezoid(speed, time)), float(station[-1] - station[0])
    loads = [values for name, values in columns.items() if name.startswith("wheel_load_")]
    weight, (lightest, heaviest) = float(np.mean(np.sum(loads, axis=0))), LOADS
    problems = []
    if not announced / UNITS_APART < begun < announced * UNITS_APART:
        problems.append(
            f"column speed must begin at initial_speed_km_h, {announced:.4g} m/s; it begins at {begun:.4g}: correct its"
            " unit or the case"
        )
    if driven > LEAST_WAY and not driven / UNITS_APART < stated < driven * UNITS_APART:
        problems.append(
            f"column station must grow by speed times time, {driven:.4g} m; it grows by {stated:.4g}: correct the unit"
            " of time, speed or station"
        )
    if not lightest < weight < heaviest:
        problems.append(
            f"the columns wheel_load must add up to a car, {lightest:g} to {heaviest:g} N; they add up to {weight:.4g}:"
            " correct their unit"
        )
    return problems


def _find_onset(path: Path, case: str, columns: Traces) -> float:
    braking = np.flatnonzero(columns.get(PRESSURE, np.zeros(1)) > 0)
    if len(braking) == 0:
        raise InputError(
            f"{path}: case {case} brakes, but neither brake_onset_s nor brake_onset_m says when and no {PRESSURE}"
            " in the trace does: add one of them"
        )
    return float(columns["time"][max(int(braking[0]) - 1, 0)])
