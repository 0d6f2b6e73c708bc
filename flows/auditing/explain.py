"""Why one frame of a dataset is as it is: its numbers computed again, step by step, beside those stored."""

from collections.abc import Mapping
from dataclasses import asdict
from math import isfinite
from typing import Any

import numpy as np

from catalogs.scenario import Scenario
from catalogs.scenes import load_route
from catalogs.studies.ablation import cut_coupling
from catalogs.variants import warn_of_variant
from flows.making.catalogue import Catalogue
from flows.making.driven import refuse_driven
from flows.making.driving import collect_surface_depths, controls_of, hazard_of, surface_of, weather_of
from flows.making.input_changes import refuse_changed_records
from flows.making.locations import find_scene
from flows.making.plan import ClipPlan, Plan, read_plan
from flows.making.traced import refuse_traced
from flows.reading.suggestions import suggest_clips
from flows.reading.views import VIEWS
from flows.store.address import open_for_reading, want_telemetry
from flows.store.outputs import Outputs
from flows.store.sealed import read_manifest
from flows.store.telemetry import list_columns, read_columns
from tasks.conventions import TICK_CHANNELS
from tasks.errors import InputError
from tasks.explanation import Step, force_steps, picture_steps, pitch_steps, surface_steps
from tasks.scene.route import Route
from tasks.surface.state import SurfaceState
from tasks.vehicle.parameters import compute_surface_response
from tasks.vehicle.rollout import compute_lift_times, simulate_scenario


def explain_frame(dataset: str, clip: str, frame: int, *, out: str | None = None) -> dict[str, Any]:
    """Rain rate -> film -> mu_c -> mu_eff -> force -> dv/dt -> pitch -> pixel shift of one frame.

    Parameters
    ----------
    dataset : a sealed dataset folder
    clip : label or id of the clip
    frame : frame number in the clip, from 0 [1]
    out : folder for ``explain.json`` and ``explain.txt``; None writes none

    Returns
    -------
    ``steps[]`` with quantity, symbol, paper equation, formula, unit, ``recomputed`` and ``stored``; ``agrees``,
    whether all that must be equal is; ``wheel_lift_time_f`` and ``_r`` of the clip [s]; ``effects`` that the vehicle
    adds to the paper's equations: where there are any, a step that they enter differs by what they do.

    Raises
    ------
    InputError
        The folder is no sealed dataset, or has no such clip or frame.
    """
    results = Outputs(out, "explain", "explain.json", "explain.txt")
    layout = open_for_reading(dataset, want_telemetry)
    manifest, plan = read_manifest(layout), read_plan(layout.root)
    refuse_changed_records(layout, manifest)
    refuse_traced(plan.inputs, dataset, "explain")
    refuse_driven(plan.inputs, dataset, "explain")
    problems: list[str] = []
    planned = None
    try:
        planned = find_planned_clip(plan, clip, dataset)
    except InputError as error:
        problems += error.problems
    if not 0 <= frame < plan.settings.frames:
        problems.append(f"frame must lie in 0 to {plan.settings.frames - 1}; it is {frame}")
    if problems or planned is None:
        raise InputError(problems)
    scenario, variant = planned.scenario, plan.settings.variant
    folder = layout.telemetry / "frames" / f"family={scenario.weather}"
    names = [channel.name for channel in VIEWS["frames"]]
    columns = read_columns(folder, planned.clip_id, names, most=plan.settings.frames)
    row, first = ({name: column[i] for name, column in columns.items()} for i in (frame, 0))
    stored = set(list_columns(folder))
    empty = [
        c.name for c in TICK_CHANNELS for at in (row, first)
        if c.name in stored and not np.isfinite(at[c.name]).all()
    ]  # fmt: skip
    if empty:
        raise InputError(
            f"{folder}: every tick must have every number; frame {frame} or 0 of clip {planned.label} has none in"
            f" {', '.join(dict.fromkeys(empty))}: musync lab repair makes the table again"
        )
    catalogue = Catalogue(layout.inputs, named=scenario.scene)
    vehicle, surface, steady = catalogue.vehicle, catalogue.surface, catalogue.steady
    mode = plan.settings.vehicle_mode
    driven = cut_coupling(scenario, variant, catalogue.families)
    if variant != "full":  # the stored depths are those of the picture, which the motion does not follow from
        row = row | collect_surface_depths(surface_of(driven, surface))
    hazard = hazard_of(driven)
    state = SurfaceState(
        kind=driven.weather,
        friction=float(row["surface_friction"]),
        snow_depth_mm=float(row["snow_depth_mm"]),
        grip=surface_of(driven, surface).grip,
    )
    ride = simulate_scenario(
        vehicle, state, controls_of(driven), hazard, mode=mode, duration_s=plan.duration_s, steady=steady,
        grade=catalogue.grade,
    )  # fmt: skip
    response = compute_surface_response(vehicle, state.kind, state.friction)
    route = find_route(plan.record_of(scenario.scene))
    steps = [
        *surface_steps(weather_of(driven), surface, vehicle, row),
        *force_steps(vehicle, response, hazard, mode, row, state.grip),
        *pitch_steps(vehicle, response, hazard, row, ride, steady),
        *picture_steps(vehicle, catalogue.camera_of(int(planned.seed)), row, first, route),
    ]  # fmt: skip
    result = {
        "dataset": str(layout.root),
        "run_id": manifest["run_id"],
        "clip_id": planned.clip_id,
        "label": planned.label,
        "frame": frame,
        "t_s": int(row["t_ns"]) / 1e9,
        "vehicle_mode": mode,
        "variant": variant,
        "effects": sorted(vehicle.effects) + [form.name for form in vehicle.forms],
        "asked": _list_scenario(scenario),
        "steps": [_as_row(step) for step in steps],
        "agrees": all(step.agrees for step in steps),
        **compute_lift_times(ride.columns),
    }
    results.write_json("explain.json", result)
    results.write("explain.txt", format_text(result))
    return result


def format_text(result: Mapping[str, Any]) -> str:
    """The chain in lines for people.

    Parameters
    ----------
    result : of `explain_frame`
    """
    asked = ", ".join(f"{name} {value:g}" if isinstance(value, float) else value
                      for name, value in result["asked"].items())  # fmt: skip
    lines = [
        f"{result['label']} frame {result['frame']}, t = {result['t_s']:g} s, {result['vehicle_mode']} mode",
        asked,
        *([warning] if (warning := warn_of_variant(result["variant"])) else []),
    ]
    for step in result["steps"]:
        lines.append(f"{step['quantity']}  [Eq. {step['equation']}]")
        value = f"{step['symbol']} = {step['formula']} = {step['recomputed']:.6g} {step['unit'].removeprefix('1')}"
        if step["stored"] is None:
            lines.append(f"    {value.rstrip()}")
        else:
            word = "is stored" if step["agrees"] and step["exact"] else f"stored: {step['stored']:.6g}"
            lines.append(f"    {value.rstrip()}; {word}")
    if result["effects"]:
        lines.append(f"the vehicle adds to these equations: {', '.join(result['effects'])}")
    front, rear = (result[f"wheel_lift_time_{axle}"] * 1000 for axle in "fr")
    if front or rear:
        lines.append(
            f"wheels leave the road in this clip: the front axle for {front:.0f} ms, the rear for {rear:.0f} ms"
            + (
                "; road and brake response are added all the same, which is exact only in contact (Appendix B)"
                if result["vehicle_mode"] == "paper"
                else ""
            )
        )
    lines.append("all stored numbers follow" if result["agrees"] else "some stored numbers do not follow")
    return "\n".join(lines) + "\n"


def find_planned_clip(plan: Plan, clip: str, dataset: str) -> ClipPlan:
    """Return the clip of a plan that has this label or id.

    Raises
    ------
    InputError
        If there is none, with the labels that come near.
    """
    for planned in plan.clips:
        if clip in (planned.clip_id, planned.label):
            return planned
    raise suggest_clips(dataset, [clip], [planned.label for planned in plan.clips])


def _as_row(step: Step) -> dict[str, Any]:
    """A step as JSON has it: a number that is none is not represented."""
    row = asdict(step) | {"agrees": step.agrees}
    return {name: None if isinstance(v, float) and not isfinite(v) else v for name, v in row.items()}


def _list_scenario(scenario: Scenario) -> dict[str, Any]:
    row = scenario.as_row()
    return {
        name: v for name, v in row.items() if v not in (None, 0.0) and (isinstance(v, str) or isfinite(v))
    }


def find_route(scene: Mapping[str, str]) -> Route | None:
    """The scene's route; None where the scene has moved away, which leaves one step out."""
    try:
        return load_route(find_scene(scene))
    except InputError:
        return None
