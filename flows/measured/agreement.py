"""Agreement of the vehicle model with reference traces, as the paper's Appendix A.2 measures it, and its figure."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from catalogs.entries import load
from catalogs.references import ReferenceCase, Traces, read_reference
from catalogs.studies.agreement import find_printed_name, put_beside_print
from catalogs.vehicles import open_vehicle
from flows.pages.figures import Figure, Line, Panel, Style
from flows.pages.static import as_svg
from flows.pages.writer import Section, Table, write_page
from flows.store.outputs import Outputs
from tasks.eval.state_agreement import CaseAgreement, case_agreement, summarise_cases, summarise_groups
from tasks.eval.stop_agreement import STOP_FIGURES, stop_agreement
from tasks.surface.state import SurfaceState
from tasks.vehicle.parameters import Vehicle
from tasks.vehicle.rollout import Mode, Rollout, simulate_scenario

PAPER = ("paper-reference", "paper")
"""The paper's vehicle and mode, drawn beside any other."""
BY = dict.fromkeys(("flat", "hump", "depression"), "road")
"""What a group's cases have in common, by its name; other names are those of what the cases vary."""
Curves = dict[str, NDArray[np.float64]]
QUANTITIES = {
    "speed": "speed [m/s]",
    "pitch": "pitch, nose down [deg]",
    "slip": "mean braking slip",
    "load": "load of a front wheel [N]",
}
"""The four quantities of the paper's figure, with their labels."""
POINTS = 800
"""Points of a curve that a figure of this size can show."""
STYLES = (Style("a"), Style("b"))


def measure_agreement(
    traces: str, *, vehicle: str = "paper-reference", mode: Mode | None = None, out: str | None = None
) -> dict[str, Any]:
    """Compare the vehicle model with reference traces by the paper's Appendix A.2 protocol.

    Parameters
    ----------
    traces : folder with cases.json and NAME.parquet or */NAME.parquet
    vehicle : catalogue name or file
    mode : paper or coupled; None takes the one a frozen vehicle was fitted in, and paper for any other
    out : folder for ``agreement.json``, ``agreement.html`` and a figure of each case, ``CASE.svg``; None writes none

    Raises
    ------
    InputError
        Listing every case whose trace or condition is missing.
    """
    reference = read_reference(Path(traces))
    files = (f"{case.case}.svg" for case, _ in reference)
    results = Outputs(out, "vehicle agreement", "agreement.json", "agreement.html", *files)
    file = open_vehicle(vehicle)
    model, provenance = file.build(), file.provenance
    chosen: Mode = mode or (provenance.mode if provenance else "paper")
    result = {"vehicle": vehicle, "mode": chosen} | agreement_of(model, reference, chosen)
    results.write_json("agreement.json", result)
    figures = []
    for (case, columns), row in zip(reference, result["cases"] if out else (), strict=False):
        rides = {f"{vehicle}, {chosen} mode": simulate_case(model, case, columns, chosen)}
        if (vehicle, chosen) != PAPER:
            rides[", ".join(PAPER) + " mode"] = simulate_case(
                load("vehicle", PAPER[0]), case, columns, "paper"
            )
        figures.append(draw_trajectories(case.case, columns, rides, row["window"]))
        results.write(f"{case.case}.svg", as_svg(figures[-1]))
    results.write("agreement.html", _write_agreement_page(result, figures))
    return result


def agreement_of(model: Vehicle, reference: list[tuple[ReferenceCase, Traces]], mode: Mode) -> dict[str, Any]:
    """Agreement of a vehicle with reference cases: a row a case, the groups of each split, the mean over all.

    Groups are those of the paper's tables: ``by`` road flat, hump and depression, ``by`` weather, brake or road the
    cases that vary it, and all. ``group``, ``count`` and the figures beside them repeat what the other keys say.
    ``beside_print`` has the paper's figure of the same split and group, or of the case with the same conditions.

    Parameters
    ----------
    model : the vehicle
    reference : cases and their traces
    mode : paper or coupled
    """
    rows: list[dict[str, Any]] = []
    splits: dict[str, list[CaseAgreement]] = {}
    for case, columns in reference:
        ride = simulate_case(model, case, columns, mode)
        scored = case_agreement(columns, ride.columns, case.facts(model.wheelbase), ride.static_pitch)
        splits.setdefault(case.split, []).append(scored)
        stop = stop_agreement(columns, ride.columns, case.facts(model.wheelbase)) or dict.fromkeys(
            STOP_FIGURES
        )
        rows.append(
            {"split": case.split}
            | asdict(scored)
            | {"window": list(scored.window)}
            | (stop or dict.fromkeys(STOP_FIGURES))
        )
    controls = {case.case: case.control for case, _ in reference}
    groups = [
        {"split": split, "by": BY.get(name, name), "name": name, **group,
         "group": name, "count": group["cases"], **group["mean"]}
        for split, cases in splits.items()
        for name, group in summarise_groups(cases, controls).items()
    ]  # fmt: skip
    braked = {case.split for case, _ in reference if case.braked and case.hazard_height_m != 0}
    for group in groups:
        group["road_cases_brake"] = group["split"] in braked
        if group["group"] == "flat":
            group |= _average_stops([row for row in rows if row["split"] == group["split"]])
    overall = summarise_cases([case for cases in splits.values() for case in cases])
    return {
        "cases": rows,
        "groups": groups,
        "mean": overall["mean"],
        "beside_print": put_beside_print(
            [
                *groups,
                *(
                    _stand_as_group(row, find_printed_name(case))
                    for row, (case, _) in zip(rows, reference, strict=True)
                ),
            ]
        ),
    }


def _write_agreement_page(result: Mapping[str, Any], figures: Sequence[Figure]) -> str:
    groups = [
        {"split": group["split"], "by": group["by"], "group": group["name"], "cases": group["cases"]}
        | group["mean"]
        | {f"largest {name}": value for name, value in group["maximum"].items()}
        for group in result["groups"]
    ]
    cases = [row | {"window": "{:.2f} to {:.2f} s".format(*row["window"])} for row in result["cases"]]
    return write_page(
        "muSync: agreement",
        "Agreement with reference traces",
        [
            Section(title="Figures of agreement", parts=[
                Table(title="Beside the paper's figures", rows=result["beside_print"]),
                Table(title="Groups: mean and largest", rows=groups),
                Table(title="Cases", rows=cases),
            ]),
            Section(title="Trajectories", parts=figures),
        ],
        lead=[f"Vehicle {result['vehicle']}, {result['mode']} mode, by the paper's Appendix A.2: on the reference's own"
        " time stamps, with the static pitch, without shift or fit. The paper's reference is CarSim; another one"
        " answers the same question of other data, so figures beside each other are no ranking."],
    )  # fmt: skip


def simulate_case(model: Vehicle, case: ReferenceCase, columns: Traces, mode: Mode) -> Rollout:
    """Return a vehicle's ride under the conditions of a reference case, for as long as its trace.

    Parameters
    ----------
    model : the vehicle
    case, columns : the reference and its trace
    mode : paper or coupled
    """
    return simulate_scenario(
        model, SurfaceState(kind=case.weather, friction=case.surface_coefficient), case.controls(), case.hazard(),
        mode=mode, duration_s=case.duration_s(columns),
    )  # fmt: skip


def _stand_as_group(row: dict[str, Any], printed: str) -> dict[str, Any]:
    """A case as a group of one, for the cases that the paper prints one by one."""
    one = {"group": row["case"], "paper_group": printed, "count": 1, "maximum": {}, "road_cases_brake": False}
    return row | one


def _average_stops(rows: list[dict[str, Any]]) -> dict[str, float]:
    """Mean absolute errors of the stops among a split's cases; nothing where none stops."""
    found = {name: [row[name] for row in rows if row[name] is not None] for name in STOP_FIGURES}
    return {name: sum(values) / len(values) for name, values in found.items() if values}


def draw_trajectories(
    case: str,
    reference: Mapping[str, NDArray[Any]],
    rides: Mapping[str, Rollout],
    window: tuple[float, float],
) -> Figure:
    """Draw the four quantities of a case over time, and below each the model less the reference.

    Parameters
    ----------
    case : its name
    reference : its trace, as `tasks.eval.state_agreement.case_agreement` takes it
    rides : of the models, by what they are called
    window : time that is scored [s]
    """
    thin = slice(None, None, max(len(reference["time"]) // POINTS, 1))
    time = reference["time"][thin]
    truth = {name: values[thin] for name, values in _read_reference(reference).items()}
    models = {
        ride_name: {
            name: np.interp(time, ride.columns["t_ns"] * 1e-9, values, right=np.nan)
            for name, values in _read_ride(ride).items()
        }
        for ride_name, ride in rides.items()
    }
    above, below = [], []
    for name, label in QUANTITIES.items():
        curves = [
            (ride_name, model[name], style)
            for style, (ride_name, model) in zip(STYLES, models.items(), strict=False)
        ]
        shown = [Line(name=ride_name, x=time, y=y, style=style) for ride_name, y, style in curves]
        left = [
            Line(name=ride_name, x=time, y=y - truth[name], style=style) for ride_name, y, style in curves
        ]
        reference_line = Line(name="reference", x=time, y=truth[name], style=Style("ink", "dashed"))
        above.append(Panel(y=label, lines=[reference_line, *shown], shaded=[window]))
        below.append(Panel(y="difference", lines=left, shaded=[window]))
    pairs = [[*above[k : k + 2], *below[k : k + 2]] for k in (0, 2)]
    return Figure(
        caption=f"{case}: reference, models, and what is left of each; shaded is what is scored",
        panels=[panel for pair in pairs for panel in pair],
        columns=2,
        linked=True,
        panel_px=190,
    )


def _read_reference(trace: Mapping[str, NDArray[Any]]) -> Curves:
    """Return the four quantities of a trace, the front wheels' and all wheels' means."""
    slips = [values for name, values in trace.items() if name.startswith("slip_")]
    loads = [values for name, values in trace.items() if name.startswith("wheel_load_f")]
    slip, load = np.mean(slips, axis=0), np.mean(loads, axis=0)
    return {"speed": trace["speed"], "pitch": trace["pitch"], "slip": slip, "load": load}


def _read_ride(ride: Rollout) -> Curves:
    """Return the four quantities of a rollout, in the units of a trace."""
    columns = ride.columns
    return {
        "speed": columns["speed"],
        "pitch": np.rad2deg(columns["pitch"] + ride.static_pitch),
        "slip": 0.5 * (columns["braking_slip_f"] + columns["braking_slip_r"]),
        "load": 0.5 * columns["axle_load_f"],
    }
