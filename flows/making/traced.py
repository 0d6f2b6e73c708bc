"""Clips that show the motion of reference traces in place of the vehicle model's: the paper's reference-pose video."""

import json
from collections.abc import Iterable, Sequence
from pathlib import Path

from catalogs.grids import Grid
from catalogs.reference_match import find_case
from catalogs.references import CG_HEIGHT, ReferenceCase, Traces, read_reference, trace_file
from catalogs.scenario import Scenario
from catalogs.sentences import cap_problems
from flows.making.driving import weather_of
from manifests.manifest import TRACES, is_traced
from tasks.errors import InputError
from tasks.studies.label_ranges import PERCENTILES
from tasks.surface.state import SurfaceParameters
from tasks.surface.weather import surface_state
from tasks.vehicle.replayed_trace import BEFORE_START, ENDS_STANDING, replay_trace
from tasks.vehicle.rollout import Rollout

CASES = "cases.json"

Reference = Sequence[tuple[ReferenceCase, Traces]]


def read_trace_inputs(
    grid: Grid, folder: Path, surface: SurfaceParameters | None
) -> tuple[dict[str, bytes], list[str]]:
    """Return the files of a folder of traces that the clips of a grid show, and what stands against it.

    Parameters
    ----------
    grid : with its scenarios
    folder : of reference traces
    surface : the grid's pavement; None where it is faulty, and no case can be found

    Returns
    -------
    Name under ``inputs/`` to the file's bytes; one sentence for each problem.
    """
    try:
        reference = read_reference(folder)
    except InputError as error:
        return {}, list(error.problems)
    if surface is None:
        return {}, []
    traces = {case.case: columns for case, columns in reference}
    used: dict[str, ReferenceCase] = {}
    problems: list[str] = []
    last = grid.settings.telemetry_s
    for label, scenario in grid.scenarios:
        try:
            friction = surface_state(weather_of(scenario), surface).friction
            case = find_case([case for case, _ in reference], scenario, friction)
        except InputError as error:
            problems += [f"{folder}: scenario {label}: {problem}" for problem in error.problems]
            continue
        used[case.case] = case
        if (problem := _find_gap(case.case, traces[case.case], last)) is not None:
            problems.append(f"{folder}: scenario {label}: {problem}")
    rows = [case.model_dump(mode="json", exclude_none=True) for case in used.values()]
    files = {f"{TRACES}/{CASES}": json.dumps(rows, indent=1, sort_keys=True).encode() + b"\n"}
    files |= {f"{TRACES}/{name}.parquet": trace_file(folder, name).read_bytes() for name in used}
    return ({} if problems else files), cap_problems(problems)


def replay_drive(
    scenario: Scenario, surface: SurfaceParameters, reference: Reference, duration_s: float
) -> Rollout:
    """Return the motion of the reference case that has the conditions of a scenario.

    Parameters
    ----------
    scenario : of the clip
    surface : pavement
    reference : cases and their traces
    duration_s : length of the telemetry [s]

    Raises
    ------
    InputError
        If no case has the conditions.
    """
    state = surface_state(weather_of(scenario), surface)
    found = find_case([case for case, _ in reference], scenario, state.friction)
    columns = next(columns for case, columns in reference if case.case == found.case)
    return replay_trace(
        columns,
        duration_s=duration_s,
        surface_friction=state.friction,
        static_pitch_deg=found.static_pitch_deg,
        brake_onset_s=found.brake_onset_s if found.braked else None,
        stopping_distance_m=found.stopping_distance_m,
    )


def unknown_ranges() -> dict[str, float]:
    """Return the label ranges of a clip whose car cannot be driven on another surface: not represented."""
    names = ("surface_friction", "stopping_distance", "peak_pitch")
    return {f"{name}_p{percentile:02d}": float("nan") for name in names for percentile in PERCENTILES}


def refuse_traced(inputs: Iterable[str], origin: object, command: str) -> None:
    """Refuse a dataset whose motion no vehicle of this project made.

    Parameters
    ----------
    inputs : names of its frozen inputs
    origin : what messages call the dataset
    command : that computes the motion again

    Raises
    ------
    InputError
        If the dataset shows the motion of traces.
    """
    if is_traced(inputs):
        raise InputError(
            f"{origin}: its motion is that of reference traces (generate --poses), which no vehicle model made;"
            f" musync {command} needs a dataset that muSync drove"
        )


def _find_gap(name: str, trace: Traces, last: float) -> str | None:
    """Why a trace cannot give the telemetry from 0 to a last time [s]; None if it can."""
    if CG_HEIGHT not in trace:
        return f"case {name} needs the column {CG_HEIGHT} [m], from which the camera's heave is taken; it is missing"
    time, speed = trace["time"], trace["speed"]
    if time[0] > 1e-9:
        return f"case {name} must begin at 0 s; it begins at {time[0]:g} s"
    if (first := trace["station"].min()) < -BEFORE_START:
        return f"case {name} must drive from station 0 on; it begins at {first:.2f} m"
    if time[-1] < last - 1e-9 and speed[-1] > ENDS_STANDING:
        return (
            f"case {name} ends at {time[-1]:g} s with {speed[-1]:.2f} m/s, before the telemetry ends at {last:g} s:"
            " make shorter clips, or give a longer trace"
        )
    return None
