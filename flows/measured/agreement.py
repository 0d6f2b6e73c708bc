"""Agreement of the vehicle model with reference traces, as the paper's Appendix A.2 measures it."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from catalogs.entries import load
from catalogs.references import ReferenceCase, Traces, read_reference
from catalogs.studies.agreement import find_printed_name, put_beside_print
from catalogs.vehicles import open_vehicle
from flows.measured.trajectory_figure import draw_trajectories
from flows.pages.figures import Figure
from flows.pages.static import as_svg
from flows.pages.writer import Section, Table, write_page
from flows.store.outputs import Outputs
from tasks.eval.agreement_groups import summarise_by_control, summarise_groups
from tasks.eval.state_agreement import CaseAgreement, case_agreement
from tasks.eval.stop_agreement import stop_agreement
from tasks.surface.state import SurfaceState
from tasks.vehicle.parameters import Vehicle
from tasks.vehicle.rollout import Mode, Rollout, simulate_scenario

PAPER = ("paper-reference", "paper")
"""The paper's vehicle and mode, drawn beside any other."""

BY = dict.fromkeys(("flat", "hump", "depression"), "road")
"""What a group's cases have in common, by its name; other names are those of what the cases vary."""
STOP_FIGURES = ("braking_time_error_s", "slip_distance_error_m")


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
        stop = stop_agreement(columns, ride.columns, case.facts(model.wheelbase))
        stops = dict.fromkeys(STOP_FIGURES) if stop is None else asdict(stop)
        rows.append({"split": case.split} | asdict(scored) | {"window": list(scored.window)} | stops)
    controls = {case.case: case.control for case, _ in reference}
    groups = [
        {"split": split, "by": BY.get(name, name), "name": name, "cases": group.count, "mean": _make_plain(group.mean),
         "maximum": _make_plain(group.maximum), "event_unit": group.event_unit,
         "group": name, "count": group.count, **_make_plain(group.mean)}
        for split, cases in splits.items()
        for name, group in (summarise_groups(cases) | summarise_by_control(cases, controls)).items()
    ]  # fmt: skip
    braked = {case.split for case, _ in reference if case.braked and case.hazard_height_m != 0}
    for group in groups:
        group["road_cases_brake"] = group["split"] in braked
        if group["group"] == "flat":
            group |= _average_stops([row for row in rows if row["split"] == group["split"]])
    overall = summarise_groups([case for cases in splits.values() for case in cases])["all"].mean
    return {
        "cases": rows,
        "groups": groups,
        "mean": _make_plain(overall),
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


def _make_plain(figures: dict[str, float]) -> dict[str, float | None]:
    """JSON has no NaN: a figure that a group cannot have is null."""
    return {name: None if value != value else value for name, value in figures.items()}
