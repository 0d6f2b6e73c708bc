"""Reference traces: a folder with cases.json and one Parquet file a case."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import pyarrow.parquet as pq
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from tasks.errors import InputError
from tasks.eval.state_agreement import REFERENCE_COLUMNS, CaseFacts
from tasks.surface.road_profile import RoadHazard
from tasks.vehicle.brake import BrakeCommand
from tasks.vehicle.rollout import Controls

AFTER_STOP_S = 12.0
"""How long past the reference's end the model may still roll before it counts as not stopping [s]."""

Number = Annotated[float, Field(allow_inf_nan=False)]


class ReferenceCase(BaseModel):
    """The conditions of one reference trace, as cases.json has them; other keys are ignored."""

    model_config = ConfigDict(extra="ignore", frozen=True)

    case: str
    split: str = "all"
    weather: Literal["dry", "rain", "snow"]
    surface_coefficient: Annotated[float, Field(gt=0, le=2)]
    initial_speed_km_h: Annotated[float, Field(gt=0)]
    peak_pressure_mpa: Annotated[float, Field(ge=0)] | None = None
    ramp_s: Annotated[float, Field(ge=0)] = 0.5
    brake_onset_s: Number | None = None
    brake_onset_m: Number | None = None
    hazard_center_m: Number = 0.0
    hazard_height_m: Number = 0.0
    hazard_length_m: Number = 0.0
    stopping_distance_m: Number | None = None

    @property
    def braked(self) -> bool:
        """Whether the case brakes at all."""
        return bool(self.peak_pressure_mpa) and (self.brake_onset_s, self.brake_onset_m) != (None, None)

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
        """What the judge is told of the case, beside its trace; the wheelbase is the model's [m]."""
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


def read_reference(folder: Path) -> list[tuple[ReferenceCase, dict[str, NDArray[np.float64]]]]:
    """Every case of a folder of traces, with its columns as float64.

    Raises
    ------
    InputError
        Listing every case whose condition or trace is missing or faulty.
    """
    path = folder / "cases.json"
    try:
        rows = json.loads(path.read_text())
    except FileNotFoundError:
        raise InputError(
            f"{path}: no such file; a folder of traces holds cases.json and one Parquet a case"
        ) from None
    except (json.JSONDecodeError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: must be valid JSON; {error}") from None
    problems: list[str] = []
    cases = []
    for row in rows:
        try:
            case = ReferenceCase.model_validate(row)
            cases.append((case, _trace(folder, case)))
        except ValidationError as error:
            name = row.get("case", "?") if isinstance(row, dict) else row
            problems += [
                f"{path}: case {name}: {'.'.join(map(str, e['loc']))}: {e['msg'].lower()}"
                for e in error.errors()
            ]
        except InputError as error:
            problems += error.problems
    if problems:
        raise InputError(problems)
    return cases


def _trace(folder: Path, case: ReferenceCase) -> dict[str, NDArray[np.float64]]:
    found = sorted([*folder.glob(f"{case.case}.parquet"), *folder.glob(f"*/{case.case}.parquet")])
    if not found:
        raise InputError(
            f"{folder}: case {case.case} needs {case.case}.parquet here or one folder down; there is none"
        )
    table = pq.read_table(found[0])
    missing = [name for name in REFERENCE_COLUMNS if name not in table.column_names]
    if missing:
        raise InputError(f"{found[0]}: a trace needs the columns {', '.join(missing)}; they are missing")
    return {name: table[name].to_numpy().astype(np.float64) for name in REFERENCE_COLUMNS}
