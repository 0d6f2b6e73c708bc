"""Which of a clip's numbers move when one catalogue line is changed: the clip is driven again for each line."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from catalogs.scenario import Scenario, find_scenario_problems
from catalogs.studies.ablation import cut_coupling
from catalogs.variants import Variant
from catalogs.weather.grip import GRIP_SECTIONS
from flows.making.catalogue import Catalogue
from flows.making.driving import (
    collect_ranged_figures,
    collect_surface_figures,
    hazard_of,
    peak_lateral_demand,
    simulate_drive,
    surface_of,
    weather_of,
)
from flows.running.progress import progress_bar
from flows.store.layout import write_atomically
from manifests.explain import REACHES, VEHICLE, kind_of_input
from studies.lineage.kept_lines import Line, is_number, scale_line
from tasks.conventions import TICK_CHANNELS
from tasks.errors import InputError
from tasks.explanation import Step, force_steps, pitch_steps, surface_steps
from tasks.render.camera import body_poses
from tasks.scene.route import Route
from tasks.studies.label_ranges import label_ranges, sampled_friction
from tasks.surface.state import SurfaceState
from tasks.vehicle.parameters import compute_surface_response
from tasks.vehicle.rollout import Mode, Rollout, compute_lift_times

SMALL, LARGE = (1.01, 0.99), (2.0, 0.5)
"""Factors on a line's numbers [1]: a small one, the second where a rule forbids the first; and where that moves no
tick, large ones, which cross a threshold that lies far from the value."""
TICKS = frozenset(channel.name for channel in TICK_CHANNELS)
STUDY = "study.yaml"
ASKED = "asked for"
"""File of the lines that are no catalogue's: the numbers that the grid asks for."""


@dataclass(frozen=True, kw_only=True)
class Asked:
    """The drive that is repeated.

    Parameters
    ----------
    scenario, mode, variant, duration_s : of the clip
    route : of the scene; None where the scene is not at hand, and a straight road stands in for it
    """

    scenario: Scenario
    mode: Mode
    variant: Variant
    duration_s: float
    route: Route | None


@dataclass(frozen=True, kw_only=True)
class Drive:
    """A clip, driven again: the scenario and surface that are driven, the ride, and every number by its column."""

    scenario: Scenario
    state: SurfaceState
    ride: Rollout
    numbers: Mapping[str, Any]


@dataclass(frozen=True, kw_only=True)
class Moved:
    """Columns that move when a line is changed, in the order of `Drive.numbers`.

    Parameters
    ----------
    line : that was changed
    columns : that a small change moves; None where the line is no number, or no rule lets it be changed by itself
    beyond : that only a large change moves
    """

    line: Line
    columns: tuple[str, ...] | None
    beyond: tuple[str, ...] = ()


def drive_clip(asked: Asked, entries: Catalogue) -> Drive:
    """Drive a clip; its numbers are those of its ticks, poses, figures and label ranges.

    Parameters
    ----------
    asked : the drive
    entries : that it is driven with
    """
    vehicle, surface = entries.vehicle, entries.surface
    driven = cut_coupling(asked.scenario, asked.variant, entries.families)
    how = asked.mode, asked.duration_s, entries.steady, entries.grade
    state, ride = simulate_drive(driven, vehicle, surface, *how)
    ranges = label_ranges(
        sampled_friction(weather_of(driven), surface, entries.study),
        lambda mu: collect_ranged_figures(simulate_drive(driven, vehicle, surface, *how, friction=mu)[1]),
    )
    seen = surface_of(asked.scenario, surface)
    station = ride.columns["station"]
    route = asked.route or lay_straight_route(float(station.max()))
    poses = body_poses(
        # the telemetry may go on beyond the route, where no frame is
        route, np.minimum(station, route.length), ride.columns["heave"], ride.columns["pitch"],
        cg_behind_front_axle=vehicle.cg_to_front_axle, cg_height=vehicle.cg_height,
    )  # fmt: skip
    figures = {
        "stop_time": ride.stop_time,
        "stopping_distance": ride.stopping_distance,
        "peak_pitch": float(ride.columns["pitch"].max()),
        **compute_lift_times(ride.columns),
        "lateral_demand": peak_lateral_demand(ride, route),
        "static_pitch": ride.static_pitch,
    }
    numbers = {
        **collect_surface_figures(seen, ride),
        **ride.columns,
        "T_world_rig": poses,
        **figures,
        **ranges,
    }
    return Drive(scenario=driven, state=state, ride=ride, numbers=numbers)


def lay_straight_route(length: float) -> Route:
    """A level route straight ahead, which stands in for that of a scene.

    Parameters
    ----------
    length : that it must have [m]
    """
    station = np.array([0.0, max(length, 1.0)])
    T_world_rig = np.tile(np.eye(4), (2, 1, 1))
    T_world_rig[:, 0, 3] = station
    return Route(station=station, T_world_rig=T_world_rig)


def list_steps(asked: Asked, entries: Catalogue, drive: Drive) -> list[Step]:
    """Return the steps by which the numbers of the hardest braked tick follow, as of `musync explain`.

    Parameters
    ----------
    asked, entries, drive : the clip as driven
    """
    tick = int(np.argmin(drive.ride.columns["longitudinal_acceleration"]))
    row = {name: column[tick] for name, column in drive.ride.columns.items()} | {"tick": tick}
    row |= collect_surface_figures(drive.state, drive.ride)
    vehicle, hazard = entries.vehicle, hazard_of(drive.scenario)
    response = compute_surface_response(vehicle, drive.state.kind, drive.state.friction)
    return [
        *surface_steps(weather_of(drive.scenario), entries.surface, vehicle, row),
        *force_steps(vehicle, response, hazard, asked.mode, row, drive.state.grip),
        *pitch_steps(vehicle, response, hazard, row, drive.ride, entries.steady),
    ]


def is_driven(line: Line) -> bool:
    """Whether a line can move numbers of the drive; other lines are of the picture and its check alone."""
    if line.file.startswith("weather/"):
        return line.place[0] in GRIP_SECTIONS
    return line.file in (ASKED, STUDY) or VEHICLE in REACHES.get(kind_of_input(line.file), ())


def move_lines(asked: Asked, kept: Mapping[str, bytes], lines: Sequence[Line], before: Drive) -> list[Moved]:
    """Change each line in turn and drive the clip again.

    Parameters
    ----------
    asked : the drive
    kept : the dataset's catalogue files by their name under ``inputs/``
    lines : to change
    before : the drive with no line changed
    """
    with TemporaryDirectory() as folder:
        inputs = Path(folder)
        for name, content in kept.items():
            write_atomically(inputs / name, content)
        moved = []
        with progress_bar("lineage", len(lines)) as advance:
            for line in lines:
                moved.append(_move_line(asked, kept, line, before, inputs))
                advance(line.key)
        return moved


def _move_line(asked: Asked, kept: Mapping[str, bytes], line: Line, before: Drive, inputs: Path) -> Moved:
    tried: list[tuple[float, set[str]]] = []
    for factor in (*SMALL, *LARGE) if is_number(line.value) else ():
        small = {name for at, names in tried if at in SMALL for name in names}
        if (factor in SMALL and tried) or small & TICKS:
            continue
        try:
            changed, entries = _change_line(asked, kept, line, factor, inputs)
            tried.append((factor, _find_moved(before.numbers, drive_clip(changed, entries).numbers)))
        except InputError:
            continue
        finally:
            if line.file in kept:
                (inputs / line.file).write_bytes(kept[line.file])
    if not tried:
        return Moved(line=line, columns=None)
    near = {name for factor, names in tried if factor in SMALL for name in names}
    far = {name for _, names in tried for name in names} - near
    return Moved(
        line=line,
        columns=tuple(name for name in before.numbers if name in near),
        beyond=tuple(name for name in before.numbers if name in far),
    )


def _change_line(
    asked: Asked, kept: Mapping[str, bytes], line: Line, factor: float, inputs: Path
) -> tuple[Asked, Catalogue]:
    if line.file != ASKED:
        (inputs / line.file).write_bytes(scale_line(line.file, kept[line.file], line.place, factor))
        return asked, Catalogue(inputs, named=asked.scenario.scene)
    scenario = replace(asked.scenario, **{line.key: line.value * factor})
    if problems := find_scenario_problems(scenario):
        raise InputError(problems)
    return replace(asked, scenario=scenario), Catalogue(inputs, named=asked.scenario.scene)


def _find_moved(before: Mapping[str, Any], after: Mapping[str, Any]) -> set[str]:
    return {name for name in before if not _is_equal(before[name], after[name])}


def _is_equal(a: Any, b: Any) -> bool:
    x, y = np.asarray(a), np.asarray(b)
    return x.shape == y.shape and np.array_equal(x, y, equal_nan=x.dtype.kind == "f")


def list_asked(scenario: Scenario, units: Mapping[str, str], grid: str) -> list[Line]:
    """Return the numbers that the grid asks for, as lines; what is not asked for, or 0, is none.

    Parameters
    ----------
    scenario : of the clip
    units : of the fields
    grid : its name
    """
    return [
        Line(file=ASKED, place=(name,), value=value, unit=units[name], source=f"asked for by the grid {grid}")
        for name, value in scenario.as_row().items()
        if is_number(value) and value
    ]
