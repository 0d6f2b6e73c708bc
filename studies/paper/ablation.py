"""The paper's ablation (Section 4.4): stopping distance over the weather and pitch at a hump, coupling by coupling."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from catalogs.entries import load
from catalogs.references import Traces, read_reference
from catalogs.scenario import Scenario
from catalogs.studies import Condition
from catalogs.studies.ablation import AblationEntry, cut_coupling
from catalogs.variants import Variant
from catalogs.vehicles import open_vehicle
from flows.making.driving import simulate_drive
from flows.pages.static import as_svg
from flows.pages.writer import Section, Table, write_page
from flows.store.missing import null_missing
from flows.store.outputs import Outputs
from flows.store.telemetry import write_parquet
from studies.paper.ablation_figure import draw_ablation
from tasks.errors import InputError
from tasks.surface.state import SurfaceParameters
from tasks.surface.weather import find_weather
from tasks.vehicle.parameters import Vehicle
from tasks.vehicle.rollout import Mode, Rollout

STOP_S, PITCH_S = 15.0, 10.0
"""Length of a drive to the stop on the slipperiest road, and of one whose pitch is compared [s]."""
COUPLINGS: tuple[Variant, ...] = ("appearance-only", "vertical-only", "fixed-mu", "full")
"""Variants of the paper's figure, which cut a coupling or nothing; they hold for every vehicle mode."""

Rows = list[dict[str, Any]]


@dataclass(frozen=True, kw_only=True)
class Ablation:
    """Where the variants are compared.

    Parameters
    ----------
    stops : the braking condition at every rate, dry first, by kind of weather
    pitch : the condition whose pitch is compared
    reference_pitch_rmse_deg : printed distance of the full model from its reference [deg]
    """

    stops: dict[str, tuple[Scenario, ...]]
    pitch: Condition
    reference_pitch_rmse_deg: float


def load_ablation() -> Ablation:
    """The study of the paper's Section 4.4."""
    entry: AblationEntry = load("ablation")
    protocol = load("sensitivity study")[0]
    conditions = {condition.name: condition for condition in load("list of conditions")}
    dry = conditions[entry.stop_condition].scenario
    stops: dict[str, tuple[Scenario, ...]] = {}
    for study in protocol.weathers.values():
        hours = protocol.snow_accumulation_h if find_weather(study.kind).accumulates else 0.0
        rates = np.linspace(0.0, study.highest_rate, study.nominal_rates)[1:]
        stops[study.kind] = (
            dry,
            *(replace(dry, weather=study.kind, precipitation_mm_h=float(rate), snow_accumulation_h=hours)
              for rate in rates),
        )  # fmt: skip
    return Ablation(
        stops=stops,
        pitch=conditions[entry.pitch_condition],
        reference_pitch_rmse_deg=entry.reference_pitch_rmse.value,
    )


def run_ablation(
    *, out: str, vehicle: str = "paper-reference", mode: Mode | None = None, traces: str | None = None
) -> dict[str, Any]:
    """Cut one coupling at a time and report the figures that change.

    Parameters
    ----------
    out : folder for ablation.json, ablation.parquet (the pitch curves), ablation.svg and ablation.html
    vehicle : catalogue name or file
    mode : paper or coupled; None takes the one a frozen vehicle was fitted in, and paper for any other
    traces : folder of reference traces whose pitch stands for the oracle; None leaves it out

    Returns
    -------
    ``stops[]`` a row a variant and rate, ``pitch[]`` a row a variant, ``reference`` the oracle's figure or why
    there is none

    Raises
    ------
    InputError
        If the traces do not hold the condition that is compared.
    """
    results = Outputs(
        out, "lab ablation", "ablation.json", "ablation.parquet", "ablation.svg", "ablation.html"
    )
    file = open_vehicle(vehicle)
    study, car, surface = load_ablation(), file.build(), load("surface", "dense-asphalt")
    provenance = file.provenance
    chosen: Mode = mode or (provenance.mode if provenance else "paper")
    oracle = None if traces is None else oracle_trace(Path(traces), study.pitch)
    stops = stop_rows(study, car, surface, chosen)
    rides = {name: _simulate_variant(study.pitch, name, car, surface, chosen) for name in COUPLINGS}
    pitch = [pitch_row(name, ride, study.pitch, car) for name, ride in rides.items()]
    curves: dict[str, NDArray[np.float64]] = {
        name: np.rad2deg(ride.columns["pitch"] + ride.static_pitch) for name, ride in rides.items()
    }
    time = next(iter(rides.values())).columns["t_ns"] * 1e-9
    reference: dict[str, Any] = {"printed_pitch_rmse_deg": study.reference_pitch_rmse_deg}
    if oracle is None:
        reference["note"] = "not run: no reference traces given"
    else:
        curves["reference"] = np.interp(time, oracle["time"], oracle["pitch"], right=np.nan)
        reference |= {
            f"{name}_pitch_rmse_deg": _compute_rmse(curves[name], curves["reference"]) for name in COUPLINGS
        }
    result = {
        "vehicle": vehicle, "mode": chosen, "pitch_condition": study.pitch.name,
        "stops": stops, "pitch": pitch, "reference": reference,
    }  # fmt: skip
    results.write_json("ablation.json", result)
    table = {"time": time} | {f"pitch_deg_{name.replace('-', '_')}": c for name, c in curves.items()}
    write_parquet(null_missing(pa.table(table)), results.path("ablation.parquet"))
    figure = draw_ablation(stops, time, curves, {row["variant"]: row for row in pitch})
    results.write("ablation.svg", as_svg(figure))
    page = write_page(
        "muSync: ablation",
        "What each coupling is for",
        [
            Section(title="Stopping distance and pitch", parts=[figure]),
            Section(title="Pitch", parts=[
                Table(title="Against the reference", rows=[reference]), Table(title=study.pitch.name, rows=pitch),
            ]),
        ],
        lead=[f"The paper's Section 4.4 with {vehicle}, {chosen} mode: one coupling is cut at a time. The reference is"
        " an independent simulator's pitch, where traces were given."],
    )  # fmt: skip
    results.write("ablation.html", page)
    return result


def stop_rows(study: Ablation, car: Vehicle, surface: SurfaceParameters, mode: Mode) -> Rows:
    """Friction and stopping distance of every variant that brakes, at every rate.

    Parameters
    ----------
    study : where to compare
    car, surface : what drives and on what
    mode : paper or coupled
    """
    rows: Rows = []
    for kind, scenarios in study.stops.items():
        for variant in COUPLINGS:
            if variant == "vertical-only":
                continue
            for scenario in scenarios:
                held = replace(cut_coupling(scenario, variant), hold_speed=True)
                _, ride = simulate_drive(held, car, surface, mode, STOP_S)
                rows.append({
                    "variant": variant,
                    "weather": kind,
                    "precipitation_mm_h": scenario.precipitation_mm_h,
                    "surface_friction": ride.surface_friction,
                    "stopping_distance_m": ride.stopping_distance,
                })  # fmt: skip
    return rows


def pitch_row(variant: Variant, ride: Rollout, condition: Condition, car: Vehicle) -> dict[str, Any]:
    """When a variant meets the hump, how far its nose is down there and how far it dips in all.

    Parameters
    ----------
    variant : its name
    ride : its drive
    condition : with the hump
    car : that drives
    """
    scenario = condition.scenario
    near, far = (scenario.hazard_center_m + side * scenario.hazard_length_m / 2 for side in (-1, 1))
    station, time = ride.columns["station"], ride.columns["t_ns"] * 1e-9
    pitch = np.rad2deg(ride.columns["pitch"] + ride.static_pitch)
    met, left = (
        float(np.interp(edge, station, time)) if station[-1] > edge else None for edge in (near, far)
    )
    return {
        "variant": variant,
        "brake_onset_s": None if np.isnan(ride.brake_onset_time) else ride.brake_onset_time,
        "front_axle_meets_hump_s": met,
        "front_axle_leaves_hump_s": left,
        "rear_axle_meets_hump_s": (
            float(np.interp(near + car.wheelbase, station, time))
            if station[-1] > near + car.wheelbase
            else None
        ),
        "pitch_before_hump_deg": None if met is None else float(np.interp(met, time, pitch)),
        "peak_pitch_deg": float(pitch.max()),
        "stop_time_s": None if np.isnan(ride.stop_time) else ride.stop_time,
    }


def oracle_trace(folder: Path, condition: Condition) -> Traces:
    """The reference simulator's trace of a condition.

    Raises
    ------
    InputError
        If the folder has none.
    """
    for case, columns in read_reference(folder):
        if case.case == condition.name:
            return columns
    raise InputError(f"{folder}: the ablation compares the pitch of {condition.name}; no case has that name")


def _simulate_variant(
    condition: Condition, variant: Variant, car: Vehicle, surface: SurfaceParameters, mode: Mode
) -> Rollout:
    held = replace(cut_coupling(condition.scenario, variant), hold_speed=True)
    return simulate_drive(held, car, surface, mode, PITCH_S)[1]


def _compute_rmse(curve: NDArray[np.float64], reference: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.nanmean((curve - reference) ** 2)))
