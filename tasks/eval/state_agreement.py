"""Agreement of a model's states with a reference trace: the paper's Appendix A.2, case by case.

Signals stay on their original time axis and keep the static pitch offset; nothing is aligned, shifted
or left out. The model is sampled at the reference's timestamps.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from tasks.errors import InputError

Floats = NDArray[np.float64]

STOP_SPEED = 0.05
"""Speed below which a vehicle stands [m/s]: the stopping rule of the paper's Appendix E."""
SLIP_SPEED_FLOOR = 0.5
"""Speed above which slip is scored [m/s] (Appendix A.2)."""
AFTER_STOP, AROUND_FEATURE = 1.0, 0.5
"""Margins of the event windows: after the stop [s], before and behind the feature [m] (Appendix A.2)."""

WHEELS = {"fl": "f", "fr": "f", "rl": "r", "rr": "r"}
REFERENCE_COLUMNS = (
    "time", "station", "speed", "pitch", *(f"slip_{w}" for w in WHEELS), *(f"wheel_load_{w}" for w in WHEELS)
)  # fmt: skip
MODEL_COLUMNS = (
    "t_ns", "station", "speed", "pitch", "braking_slip_f", "braking_slip_r", "axle_load_f", "axle_load_r"
)  # fmt: skip
FIGURES = ("speed_rmse_m_s", "pitch_rmse_deg", "slip_rmse", "wheel_load_rmse_n", "event_error")


@dataclass(frozen=True, kw_only=True)
class CaseFacts:
    """Known facts of a case besides its trace.

    Parameters
    ----------
    case : name
    hazard_height : height of the road feature, negative for a depression, 0 for a flat road [m]
    hazard_length : length of the feature [m]
    hazard_center : station of its middle [m]
    wheelbase : [m]
    brake_onset : time of brake application [s]; None where a station triggers it
    brake_onset_station : station that triggers the brake, in either trace at its own time [m]; read only
        where `brake_onset` is None
    stopping_distance : of the reference from brake onset [m]; None to read it from the trace
    """

    case: str
    hazard_height: float
    hazard_length: float
    hazard_center: float
    wheelbase: float
    brake_onset: float | None = None
    brake_onset_station: float | None = None
    stopping_distance: float | None = None

    @property
    def kind(self) -> Literal["flat", "hump", "depression"]:
        """Group of the case in the paper's tables."""
        if self.hazard_height == 0:
            return "flat"
        return "hump" if self.hazard_height > 0 else "depression"


@dataclass(frozen=True, kw_only=True)
class CaseAgreement:
    """One row of the paper's per-case table.

    Parameters
    ----------
    case, kind : as in `CaseFacts`
    speed_rmse_m_s : [m/s]
    pitch_rmse_deg : with the static offset on both sides [deg]
    slip_rmse : mean over the four wheels, where the reference goes faster than 0.5 m/s [1]
    wheel_load_rmse_n : mean over the four wheels [N]
    event_error : absolute error of the stopping distance [m] or of the speed at the feature [km/h]
    event_unit : "m" or "km/h"
    window : begin and end of what was scored [s]
    note : why that is not the protocol's whole window; empty where it is
    """

    case: str
    kind: str
    speed_rmse_m_s: float
    pitch_rmse_deg: float
    slip_rmse: float
    wheel_load_rmse_n: float
    event_error: float
    event_unit: str
    window: tuple[float, float]
    note: str


def case_agreement(
    reference: Mapping[str, Floats], model: Mapping[str, Floats], facts: CaseFacts, static_pitch: float
) -> CaseAgreement:
    """Score one case by the paper's Appendix A.2.

    The window of a flat case ends one second after the reference stops, that of a road case half a
    metre behind the rear axle's exit. A reference that ends before that is scored to its end: its last pitch
    cannot be held, because a stopped car releases its pitch.

    Parameters
    ----------
    reference : columns `REFERENCE_COLUMNS`: time [s], station [m], speed [m/s], pitch with its static offset
        [deg], braking slip [1] and load [N] of each wheel
    model : columns `MODEL_COLUMNS` with the names and units of `tasks.conventions.TICK_CHANNELS`
    facts : what is known about the case
    static_pitch : pitch of the model's vehicle at rest, from which its pitch is counted [rad]

    Raises
    ------
    InputError
        If a column is missing, the model's record does not cover the window, the model does not stop
        within it, or the case has no brake onset.
    """
    _check_columns(reference, model, facts)
    time = reference["time"]
    start, end, note = _event_window(reference, facts)
    model_time = model["t_ns"] * 1e-9
    tick = 1e-9
    if model_time[0] > start + tick or model_time[-1] < end - tick:
        raise InputError(
            f"Case {facts.case}: the model's record must cover the event window {start:.3f} to {end:.3f} s, "
            f"got {model_time[0]:.3f} to {model_time[-1]:.3f} s; simulate that long."
        )
    scored = (time >= start - tick) & (time <= end + tick)
    at = time[scored]

    def rmse(reference_name: str, model_values: Floats, mask: NDArray[np.bool_] | None = None) -> float:
        error = np.interp(at, model_time, model_values) - reference[reference_name][scored]
        error = error if mask is None else error[mask]
        return float(np.sqrt(np.mean(error**2))) if error.size else float("nan")

    rolling = reference["speed"][scored] > SLIP_SPEED_FLOOR
    slip = [rmse(f"slip_{wheel}", model[f"braking_slip_{axle}"], rolling) for wheel, axle in WHEELS.items()]
    load = [rmse(f"wheel_load_{wheel}", model[f"axle_load_{axle}"] / 2) for wheel, axle in WHEELS.items()]
    event_error, event_unit = _event_error(reference, model, model_time, facts)
    return CaseAgreement(
        case=facts.case,
        kind=facts.kind,
        speed_rmse_m_s=rmse("speed", model["speed"]),
        pitch_rmse_deg=rmse("pitch", np.rad2deg(model["pitch"] + static_pitch)),
        slip_rmse=float(np.mean(slip)),
        wheel_load_rmse_n=float(np.mean(load)),
        event_error=event_error,
        event_unit=event_unit,
        window=(start, end),
        note=note,
    )


def _check_columns(reference: Mapping[str, Floats], model: Mapping[str, Floats], facts: CaseFacts) -> None:
    problems = []
    for owner, columns, needed in (
        ("reference", reference, REFERENCE_COLUMNS),
        ("model", model, MODEL_COLUMNS),
    ):
        missing = [name for name in needed if name not in columns]
        if missing:
            problems.append(f"Case {facts.case}: the {owner} must have the columns {', '.join(missing)}.")
        elif len(columns[needed[0]]) < 2:
            problems.append(f"Case {facts.case}: the {owner} must have at least two rows.")
    if facts.kind == "flat" and facts.brake_onset is None and facts.brake_onset_station is None:
        problems.append(f"Case {facts.case}: a flat case needs a time or a station of brake onset.")
    if problems:
        raise InputError(problems)


def _event_window(reference: Mapping[str, Floats], facts: CaseFacts) -> tuple[float, float, str]:
    time, station = reference["time"], reference["station"]
    if facts.kind == "flat":
        start = find_brake_onset(time, station, facts)
        stop = find_stop(time, reference["speed"], start)
        end = (time[-1] if stop is None else stop) + AFTER_STOP
    else:
        half = facts.hazard_length / 2
        entry = _crossing_time(time, station, facts.hazard_center - half - AROUND_FEATURE)
        if entry is None:
            raise InputError(f"Case {facts.case}: the reference never reaches the road feature.")
        start = entry
        leave = _crossing_time(time, station, facts.hazard_center + half + facts.wheelbase + AROUND_FEATURE)
        end = np.inf if leave is None else leave
    if end <= time[-1] + 1e-9:
        return start, float(end), ""
    what = "one second after the stop" if facts.kind == "flat" else "behind the rear axle's exit"
    note = f"The window ends {what}, the reference at {time[-1]:.3f} s; scored to there."
    return start, float(time[-1]), note


def _event_error(
    reference: Mapping[str, Floats], model: Mapping[str, Floats], model_time: Floats, facts: CaseFacts
) -> tuple[float, str]:
    if facts.kind != "flat":
        speeds = [
            _speed_at(t, c["station"], c["speed"], facts.hazard_center)
            for t, c in ((reference["time"], reference), (model_time, model))
        ]
        return abs(speeds[1] - speeds[0]) * 3.6, "km/h"
    distances = []
    for t, columns in ((reference["time"], reference), (model_time, model)):
        onset = find_brake_onset(t, columns["station"], facts)
        stop = find_stop(t, columns["speed"], onset)
        if stop is None and columns is model:
            raise InputError(
                f"Case {facts.case}: the model must come to a stop within its record, but goes "
                f"{columns['speed'][-1]:.2f} m/s at {t[-1]:.3f} s; simulate longer."
            )
        ends = np.interp([onset, t[-1] if stop is None else stop], t, columns["station"])
        distances.append(float(ends[1] - ends[0]))
    if facts.stopping_distance is not None:
        distances[0] = facts.stopping_distance
    return abs(distances[1] - distances[0]), "m"


def find_brake_onset(time: Floats, station: Floats, facts: CaseFacts) -> float:
    """Return when a trace brakes: the case's time, or when it reaches the case's station [s].

    Parameters
    ----------
    time, station : of the trace [s], [m]
    facts : of the case
    """
    if facts.brake_onset is not None:
        return facts.brake_onset
    onset = _crossing_time(time, station, facts.brake_onset_station or 0.0)
    if onset is None:
        raise InputError(
            f"Case {facts.case}: no brake onset, station {facts.brake_onset_station} m is never reached."
        )
    return onset


def find_stop(time: Floats, speed: Floats, onset: float) -> float | None:
    """Return the first time from the brake's onset on at which the vehicle stands [s]; None if it never does.

    Parameters
    ----------
    time, speed : of the trace [s], [m/s]
    onset : of the brake [s]
    """
    standing = np.flatnonzero((speed <= STOP_SPEED) & (time >= onset))
    return float(time[standing[0]]) if standing.size else None


def _crossing_time(time: Floats, station: Floats, mark: float) -> float | None:
    """Time at which `station` first reaches `mark` [s]."""
    beyond = np.flatnonzero(station >= mark)
    if not beyond.size:
        return None
    k = int(beyond[0])
    return float(time[0] if k == 0 else np.interp(mark, station[k - 1 : k + 1], time[k - 1 : k + 1]))


def _speed_at(time: Floats, station: Floats, speed: Floats, mark: float) -> float:
    """Speed at a station [m/s]; 0 for a vehicle that stops short of it."""
    when = _crossing_time(time, station, mark)
    return 0.0 if when is None else float(np.interp(when, time, speed))


def summarise_groups(
    cases: Sequence[CaseAgreement], controls: Mapping[str, str]
) -> dict[str, dict[str, Any]]:
    """Return what `summarise_cases` says of each group of the paper's tables that has a case.

    Parameters
    ----------
    cases : of one split
    controls : weather, brake or road, whichever a case varies, by its name
    """
    kinds = [(kind, [c for c in cases if c.kind == kind]) for kind in ("flat", "hump", "depression")]
    varied = [(name, [c for c in cases if controls[c.case] == name]) for name in ("weather", "brake", "road")]
    groups = [*kinds, ("all", cases), *varied]
    return {name: summarise_cases(members) for name, members in groups if members}


def summarise_cases(cases: Sequence[CaseAgreement]) -> dict[str, Any]:
    """Return ``cases``, their number; ``mean`` and ``maximum`` by figure; ``event_unit``, m or km/h.

    Where cases mix both units, the unit is empty and the event error is None.

    Parameters
    ----------
    cases : at least one
    """
    units = {case.event_unit for case in cases}
    values = {figure: [getattr(case, figure) for case in cases] for figure in FIGURES}
    mean = {figure: float(np.mean(of_cases)) for figure, of_cases in values.items()}
    mixed = {"event_error": None} if len(units) > 1 else {}
    return {
        "cases": len(cases),
        "mean": mean | mixed,
        "maximum": {figure: max(of_cases) for figure, of_cases in values.items()} | mixed,
        "event_unit": "" if mixed else units.pop(),
    }
