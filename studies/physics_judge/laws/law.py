"""Laws that stored telemetry must satisfy, each as a residual over its tolerance at every tick.

A tolerance is the error of sampling a 0.5 ms solution at 1 kHz, estimated from the data beside the tick, or else
rounding. No tolerance is tuned to the size of a fault.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studies.physics_judge.laws.constants import (
    ClipColumns,
    Constants,
    Floats,
    find_climb,
    raised_cosine,
)
from studies.physics_judge.laws.coupled import find_hits, spread
from studies.physics_judge.laws.half_step import (
    INNER_STEP,
    HalfStep,
    find_brake_onset,
    find_held_rows,
)
from studies.physics_judge.laws.tyres import find_curve

ROUNDING = 1e-9
"""Relative error that double-precision sums of a run may carry [1]."""


ASKED = "clips.peak_pressure_mpa clips.ramp_s"
"""Columns that decide the brake pressure between ticks."""


LEAP = 0.2
"""Change of the brake pressure within a tick, over its largest value, that no ramp makes [1]."""
SHAKEN = 0.5
"""Share of its load at rest by which a shaken axle's load changes [1]."""


@dataclass(frozen=True, kw_only=True)
class Law:
    """One law, evaluated on one clip.

    Parameters
    ----------
    name : the law in words
    columns : the columns that it relates, as table.column
    excess : largest residual over its tolerance; above 1 the law is broken [1]
    at : row of the largest excess [1]
    size : the residual there, in the unit of ``of`` [any]
    of : the column that the residual is one of
    """

    name: str
    columns: frozenset[str]
    excess: float
    at: int
    size: float
    of: str

    @property
    def broken(self) -> bool:
        """Whether the telemetry breaks it; a law that cannot be evaluated is broken."""
        return not self.excess <= 1.0

    def moved_to(self, rows: NDArray[np.int64]) -> "Law":
        """Return the law with its row counted in the table.

        Parameters
        ----------
        rows : rows of the table that were judged [1]
        """
        return replace(self, at=int(rows[self.at]))


def evaluate_law(
    name: str, columns: str, residual: Floats, tolerance: Floats | float, table: str = "ticks"
) -> Law | None:
    """Return a law from its residual; None where no row can be judged.

    Parameters
    ----------
    name : what it says
    columns : names, separated by blanks; those without a table are of ``table``; the residual is one of the first
    residual, tolerance : [N], in its unit; NaN residuals of masked rows must be left out before [any]
    table : default table
    """
    residual = np.atleast_1d(residual)
    if residual.size == 0:
        return None
    excess = np.abs(residual) / tolerance
    worst = int(np.argmax(np.where(np.isfinite(excess), excess, np.inf)))
    names = [c if "." in c else f"{table}.{c}" for c in columns.split()]
    value = float(excess[worst])
    return Law(
        name=name, columns=frozenset(names), excess=value if np.isfinite(value) else np.inf, at=worst,
        size=abs(float(residual[worst])), of=names[0],
    )  # fmt: skip


def rounding_tolerance(*terms: Floats) -> Floats:
    """Return the tolerance of an algebraic law: rounding of its terms, at least that of the largest in the clip.

    Parameters
    ----------
    terms : [N] the law's terms, in one unit [any]
    """
    size = np.sum([np.abs(term) for term in terms], axis=0)
    return ROUNDING * (size + 1e-3 * size.max() + 1e-12)


def wheel_laws(clip: ClipColumns, axle: str, half: HalfStep) -> list[Law | None]:
    """Return the laws of slip, tyre force, brake torque, ABS and torque balance of one axle (paper, Appendix B).

    Parameters
    ----------
    clip : what is judged
    axle : f or r
    half : state half a tick after each tick
    """
    ticks, facts, constants = clip
    car, curve = constants.car, find_curve(facts, constants)
    v, omega = ticks["speed"], ticks[f"wheel_speed_{axle}"]
    kappa, force = ticks[f"braking_slip_{axle}"], ticks[f"tyre_force_{axle}"]
    torque, q, load = (ticks[f"{c}_{axle}"] for c in ("brake_torque", "abs_scale", "tyre_load"))
    radius, inertia = car["wheel_radius"], car[f"wheel_inertia_{axle}"]
    target, width = curve.target_slip, car["abs_release_width"]

    slip = np.clip((v - radius * omega) / np.maximum(v, car["slip_speed_floor"]), 0.0, 1.0)
    grip = curve.friction(kappa, load)
    asked = np.clip((target * (1 + width) - kappa) / (width * target), 0.0, 1.0)
    gain = constants.brake_share(axle) * car["brake_gain"]

    rate = (radius * force - torque) / inertia
    rolls = np.flatnonzero((v[1:] > 0) & (v[:-1] > 0))
    after = half.rate[axle][rolls]
    step = np.diff(omega)[rolls] - half.change[axle][rolls]
    uncertainty = radius / inertia * half.load_uncertainty[axle][rolls]
    integration_tolerance = INNER_STEP * (uncertainty + 1e-6 * (np.abs(after) + np.abs(rate[rolls]) + 1.0))
    jolt = np.where(find_leaps(ticks), spread(np.abs(np.diff(rate, prepend=rate[:1])), 3), 0.0)
    integration_tolerance = integration_tolerance + 2 * INNER_STEP * jolt[1:][rolls] + 2e-6
    x = f"_{axle}"
    laws = [
        evaluate_law(f"slip of wheel speed, {axle}", f"braking_slip{x} wheel_speed{x} speed", kappa - slip, 1e-9),
        evaluate_law(f"tyre force of slip and load, {axle}",
            f"tyre_force{x} braking_slip{x} tyre_load{x} clips.tyre_peak",
            force - grip * load, rounding_tolerance(force, load)),
        evaluate_law(f"brake torque of pressure, {axle}", f"brake_torque{x} abs_scale{x} brake_pressure_mpa",
            torque - q * gain * ticks["brake_pressure_mpa"], rounding_tolerance(torque) + 1e-9),
        evaluate_law(f"wheel torque balance, {axle}", f"wheel_speed{x} tyre_force{x} brake_torque{x} tyre_load{x} speed"
            f" longitudinal_acceleration {ASKED}",
            step, integration_tolerance),
        evaluate_law(f"wheel starts rolling, {axle}", f"wheel_speed{x} clips.initial_speed_km_h",
            omega[:1] - facts["initial_speed_km_h"] / 3.6 / radius, 3e-9),
    ]  # fmt: skip
    if car["abs_build_rate"] * INNER_STEP >= 1 and car["abs_release_rate"] * INNER_STEP >= 1:
        laws.append(
            evaluate_law(f"ABS command of slip, {axle}", f"abs_scale{x} braking_slip{x}", q - asked, 1e-7)
        )
    else:
        outside = np.maximum(np.maximum(-q, q - 1.0), 0.0)
        laws.append(evaluate_law(f"ABS within its bounds, {axle}", f"abs_scale{x}", outside, 1e-9))
    return laws


def motion_laws(clip: ClipColumns, half: HalfStep) -> list[Law | None]:
    """Return the laws of station, speed, forces, energy, loads and time (paper, Eq. app_longitudinal_complete).

    Parameters
    ----------
    clip : what is judged
    half : state half a tick after each tick
    """
    ticks, facts, constants = clip
    car, m, L = constants.car, constants.mass, constants.wheelbase
    s, v, a = ticks["station"], ticks["speed"], ticks["longitudinal_acceleration"]
    force = ticks["tyre_force_f"] + ticks["tyre_force_r"]
    load_f, load_r = ticks["tyre_load_f"], ticks["tyre_load_r"]
    road = ticks["road_force"]
    moves = v > 0
    both = np.flatnonzero(moves[1:] & moves[:-1]) + 1
    unseen = find_hits(ticks, constants) | find_leaps(ticks)
    met = np.where(unseen, spread(np.abs(np.diff(a, prepend=a[:1])), 3), 0.0)[1:]
    h = INNER_STEP
    coast = np.where(moves, car["coast_deceleration"], 0.0)
    climb, later_climb, open_climb = find_climb(ticks, constants)
    time = ticks["t_ns"]
    held = find_held_rows(1e-3 * np.arange(len(s), dtype=np.float64), facts, find_brake_onset(ticks, facts))
    net = np.where(held, 0.0, np.where(moves, (road - force) / m - climb, 0.0) - coast)

    later = half.acceleration
    uncertainty = (half.load_uncertainty["f"] + half.load_uncertainty["r"])[both - 1] / m
    between = v[:-1] + h * a[:-1]
    way = (np.diff(s) - 0.5 * h * (v[:-1] + 2 * between + v[1:]))[both - 1]
    gained = (np.diff(v) - h * (a[:-1] + later))[both - 1]
    power = 0.5 * h * (net[:-1] * (v[:-1] + between) + later * (between + v[1:]))
    unsure_power = h * v[1:] * (half.load_uncertainty["f"] + half.load_uncertainty["r"]) / m
    unsure_power = unsure_power + h * v[1:] * met
    unsure_energy = np.concatenate([[0.0], np.cumsum(unsure_power)])
    energy = 0.5 * (v**2 - v[0] ** 2) - np.concatenate([[0.0], np.cumsum(power)])
    rolling = np.flatnonzero(moves)
    drives = " ".join(
        f"{c}_{x}" for c in ("wheel_speed", "tyre_force", "brake_torque", "tyre_load") for x in "fr"
    )
    drives += f" {ASKED}"
    stays = np.flatnonzero(~moves)

    hump = facts["hazard_center_m"], facts["hazard_length_m"], facts["hazard_height_m"]
    slope_f, slope_r = raised_cosine(s, *hump)[1], raised_cosine(s - L, *hump)[1]
    uphill = np.where(moves, -load_f * slope_f - load_r * slope_r, 0.0)
    laws = [
        evaluate_law("time counts milliseconds", "t_ns", time - 1e6 * np.arange(len(time)), 0.5),
        evaluate_law("station starts at zero", "station", s[:1], 1e-9),
        evaluate_law("speed starts as commanded", "speed clips.initial_speed_km_h",
            v[:1] - facts["initial_speed_km_h"] / 3.6, 1e-9),
        evaluate_law("station is the integral of speed", "station speed longitudinal_acceleration", way, 1e-10),
        evaluate_law("station rests with the car", "station speed", np.diff(s)[stays[1:] - 1], 1e-9),
        evaluate_law("speed is the integral of acceleration", "speed longitudinal_acceleration " + drives,
            gained, h * (2 * uncertainty + met[both - 1] + open_climb[both - 1] + 1e-5)),
        evaluate_law("m dv/dt is the sum of forces",
            "longitudinal_acceleration tyre_force_f tyre_force_r road_force road_grade",
            a - net, rounding_tolerance(a, force / m, road / m)),
        evaluate_law("kinetic energy falls by the work done", "speed longitudinal_acceleration road_force " + drives,
            energy[rolling] / v[0], 2e-5 * v[0] + unsure_energy[rolling] / v[0]),
        evaluate_law("road force of load and slope", "road_force tyre_load_f tyre_load_r station clips.hazard_height_m"
            " clips.hazard_center_m clips.hazard_length_m", road - uphill, rounding_tolerance(load_f, load_r)),
    ]  # fmt: skip
    if constants.mode == "paper" and hump[2] == 0.0:
        # Euler's half step between two ticks follows from both speeds, and so does its load
        before = np.diff(v)[both - 1] / h - a[both - 1]
        lever_ratio = m * car["cg_height"] / L
        moved = lever_ratio * (before + later_climb[both - 1])
        weight = m * car["gravity"]
        for axle, load, sign in (("f", load_f, -1.0), ("r", load_r, 1.0)):
            lever = car["cg_to_rear_axle" if axle == "f" else "cg_to_front_axle"] / L
            expected = np.maximum(weight * lever + sign * moved, 0.0)
            laws.append(
                evaluate_law(f"analytic load transfer, {axle}", f"tyre_load_{axle} speed longitudinal_acceleration",
                    load[both] - expected, lever_ratio * open_climb[both - 1] + 1e-4)
            )  # fmt: skip
        laws.append(evaluate_law("tyre loads sum to the weight", "tyre_load_f tyre_load_r",
                        load_f + load_r - weight, 1e-6))  # fmt: skip
    else:
        laws += [
            evaluate_law(f"tyre load is the contact load, {axle}", f"tyre_load_{axle} axle_load_{axle}",
                ticks[f"tyre_load_{axle}"] - ticks[f"axle_load_{axle}"], 1e-6)
            for axle in "fr"
        ]  # fmt: skip
    return laws


def is_shaken(ticks: Mapping[str, Floats], constants: Constants) -> bool:
    """Return whether the road changes an axle's load by `SHAKEN` of that at rest.

    Parameters
    ----------
    ticks : columns of the tick table
    constants : car and pavement
    """
    changes = [np.abs(ticks[f"axle_load_{axle}"] / constants.static_load(axle) - 1.0).max() for axle in "fr"]
    return bool(max(changes) > SHAKEN) and bool(np.ptp(ticks["road_height_f"]) > 0)


def find_leaps(ticks: Mapping[str, Floats]) -> NDArray[np.bool_]:
    """Return the ticks about which the brake pressure jumps, and wheels with it, [N].

    Parameters
    ----------
    ticks : columns of the tick table
    """
    pressure = ticks["brake_pressure_mpa"]
    leaps = np.abs(np.diff(pressure, prepend=pressure[:1])) > LEAP * max(pressure.max(), 1e-9)
    return np.asarray(spread(leaps.astype(float), 3) > 0)


def finite_rows(columns: Mapping[str, NDArray[Any]]) -> list[str]:
    """Return the names of the columns that hold a value that is not finite.

    Parameters
    ----------
    columns : columns of a table
    """
    return [
        name for name, values in columns.items() if values.dtype.kind == "f" and not np.isfinite(values).all()
    ]
