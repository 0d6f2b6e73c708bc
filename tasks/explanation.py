"""From the weather to the pixel in steps: every number of one stored frame, computed again from those before it.

Equation numbers are the paper's; S counts the supplement's.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import copysign, isclose, isnan
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tasks.conventions import CHANNELS_BY_NAME
from tasks.render.camera import Camera, body_poses
from tasks.scene.route import Route
from tasks.surface.road_profile import RoadHazard, road_slope
from tasks.surface.state import SurfaceParameters
from tasks.surface.weather import Weather, find_weather, surface_state
from tasks.surface.wet_friction import ANY_SPEED, WetGrip, compute_wet_share
from tasks.vehicle.model.axle_ports import compute_signed_slip
from tasks.vehicle.paper.low_speed import SteadyStop, find_rule_span
from tasks.vehicle.parameters import SurfaceResponse, Vehicle, compute_surface_response
from tasks.vehicle.rollout import Rollout
from tasks.vehicle.tyres.contract import compute_braking_slip, compute_tyre_friction, find_law

TOLERANCE = 1e-9
"""Largest difference from the stored number, relative to it, that rounding explains [1]."""
ROAD_POINT_M = 10.0
"""The road point whose shift is given lies this far ahead of the front axle [m]."""


@dataclass(frozen=True, kw_only=True)
class Step:
    """One number of the chain.

    Parameters
    ----------
    quantity : what it is
    symbol : the paper's
    equation : the paper's number
    formula : how it follows, with the values put in
    unit : of the numbers below
    recomputed : value computed again
    stored : value in the dataset; None where it holds none
    exact : whether the two must agree to rounding; a measurement need not
    """

    quantity: str
    symbol: str
    equation: str
    formula: str
    unit: str
    recomputed: float
    stored: float | None = None
    exact: bool = True

    @property
    def agrees(self) -> bool:
        """Whether the stored number is the recomputed one, or need not be."""
        if self.stored is None or isnan(self.stored) or not self.exact:
            return True
        return isclose(self.recomputed, self.stored, rel_tol=TOLERANCE, abs_tol=1e-12)


def surface_steps(
    weather: Weather, surface: SurfaceParameters, vehicle: Vehicle, row: Mapping[str, Any]
) -> list[Step]:
    """Weather to film or snow, to mu_c and mu_eff (paper, Eqs. 3, 5, 8, S21 to S23).

    Parameters
    ----------
    weather : of the clip
    surface : the pavement
    vehicle : holds the tyre's tables
    row : the stored frame
    """
    state = surface_state(weather, surface)
    response = compute_surface_response(vehicle, state.kind, state.friction)
    steps = []
    for one in find_weather(state.kind).derive(weather, state, surface):
        column = "surface_friction" if one.field == "friction" else one.field
        steps.append(Step(
            quantity=one.quantity, symbol=one.symbol, equation=one.equation, formula=one.formula,
            unit=CHANNELS_BY_NAME[column].unit, recomputed=getattr(state, one.field), stored=float(row[column]),
        ))  # fmt: skip
    efficiency = response.tyre.peak / state.friction
    return [
        *steps,
        Step(quantity="tyre peak", symbol="mu_eff", equation="8", unit="1",
             formula=f"eta_tire * mu_c = {efficiency:.6g} * {state.friction:.6g}",
             recomputed=response.tyre.peak, stored=float(row["tyre_peak"])),
    ]  # fmt: skip


def force_steps(
    vehicle: Vehicle, response: SurfaceResponse, hazard: RoadHazard, mode: str, row: Mapping[str, Any],
    grip: WetGrip = ANY_SPEED,
) -> list[Step]:  # fmt: skip
    """Slip, tyre forces, road force and dv/dt at the stored tick (paper, Eqs. 8, 9, S7 and S11).

    Parameters
    ----------
    vehicle, response : the vehicle and its tyres on the surface
    hazard : road feature
    mode : paper or coupled, which lets a wheel slip the other way too
    row : the stored frame
    grip : how friction depends on speed
    """
    slip_of, lowest = (compute_signed_slip, -1) if mode == "coupled" else (compute_braking_slip, 0)
    steps, forces = [], []
    speed, radius = float(row["speed"]), vehicle.wheel_radius
    standing = speed <= 0
    formula = find_law(type(response.tyre)).formula
    by_speed = 1.0 if grip == ANY_SPEED else compute_wet_share(speed, grip) / grip.reference
    if by_speed != 1.0:
        formula += f" * {by_speed:.4g}"
    for axle, name in (("f", "front"), ("r", "rear")):
        omega, load = float(row[f"wheel_speed_{axle}"]), float(row[f"tyre_load_{axle}"])
        kappa = slip_of(speed, radius * omega, vehicle.slip_speed_floor)
        mu = copysign(compute_tyre_friction(abs(kappa), load, response.tyre) * by_speed, kappa)
        law = formula.format(kappa=kappa, load=load, stiffness=response.slip_stiffness)
        forces.append(mu * load)
        steps += [
            Step(quantity=f"{name} braking slip", symbol=f"kappa_{axle}", equation="8", unit="1",
                 formula=f"clip(({speed:.5g} - {radius:g} * {omega:.5g}) / max({speed:.5g},"
                 f" {vehicle.slip_speed_floor:g}), {lowest}, 1)",
                 recomputed=kappa, stored=float(row[f"braking_slip_{axle}"])),
            Step(quantity=f"{name} tyre force", symbol=f"F_x,{axle}", equation="8, S7", unit="N",
                 formula=f"{law} * F_z = {mu:.5g} * {load:.6g}",
                 recomputed=mu * load, stored=float(row[f"tyre_force_{axle}"])),
        ]  # fmt: skip
    station = float(row["station"])
    slope_f, slope_r = road_slope([station, station - vehicle.wheelbase], hazard).tolist()
    load_f, load_r = float(row["tyre_load_f"]), float(row["tyre_load_r"])
    road = 0.0 if standing else 0.0 - load_f * slope_f - load_r * slope_r
    grade = float(row["road_grade"]) if np.isfinite(row["road_grade"]) else 0.0
    rate = 0.0 if standing else (road - sum(forces)) / vehicle.mass - vehicle.coast_deceleration
    lost = f"{vehicle.coast_deceleration:g}"
    if grade != 0.0 and not standing:
        rate -= vehicle.gravity * grade
        lost += f" - {vehicle.gravity:g} * {grade:.5g}"
    return [
        *steps,
        Step(quantity="road force", symbol="F_x,road", equation="9, S11", unit="N",
             formula="the vehicle stands" if standing else
             f"-{load_f:.6g} * {slope_f:.4g} - {load_r:.6g} * {slope_r:.4g}",
             recomputed=road, stored=float(row["road_force"])),
        Step(quantity="rate of speed", symbol="dv/dt", equation="9, S11", unit="m s-2",
             formula="the vehicle stands" if standing else
             f"({road:.5g} - {forces[0]:.6g} - {forces[1]:.6g}) / {vehicle.mass:g} - {lost}",
             recomputed=rate, stored=float(row["longitudinal_acceleration"])),
    ]  # fmt: skip


def pitch_steps(
    vehicle: Vehicle, response: SurfaceResponse, hazard: RoadHazard, row: Mapping[str, Any], ride: Rollout,
    steady: SteadyStop | None,
) -> list[Step]:  # fmt: skip
    """Brake moment at the tick, and the pitch and heave that the history up to it leaves (Eqs. 10, S15 to S17).

    Parameters
    ----------
    vehicle, response, hazard : as above
    row : the stored frame
    ride : the clip driven again from its scenario; the moment is given in paper mode only
    steady : how the end of its stop is kept steady; None takes the published rule literally
    """
    tick = int(row["tick"])
    steps = []
    if ride.mode == "paper":
        scale = response.pitch_scale * (1.0 if hazard.height_m == 0 else vehicle.coupled_pitch_scale)
        climb = vehicle.gravity * grade if np.isfinite(grade := float(row["road_grade"])) else 0.0
        d = max(-float(row["longitudinal_acceleration"]) - climb, min(-climb, 0.0))
        steps.append(Step(
            quantity=f"brake-pitch moment{_describe_rule(response, ride, steady, tick)}",
            symbol="M_b", equation="S16", unit="N m",
            formula=f"{scale:.5g} * {vehicle.sprung_mass:g} * {vehicle.cg_height:g} * {d:.5g}",
            recomputed=scale * vehicle.sprung_mass * vehicle.cg_height * d,
        ))  # fmt: skip
    return [
        *steps,
        *(Step(quantity=name, symbol=symbol, equation="10, S15", unit=unit,
               formula=f"half-car driven again from t = 0, tick {tick}",
               recomputed=float(ride.columns[name][tick]), stored=float(row[name]))
          for name, symbol, unit in (("pitch", "theta", "rad"), ("heave", "z_s", "m"))),
    ]  # fmt: skip


def _describe_rule(response: SurfaceResponse, ride: Rollout, steady: SteadyStop | None, tick: int) -> str:
    """Say when the low-speed rule acts, at a tick at which it may put another moment in the place of Eq. S16's."""
    if steady is not None and not steady.pitch_rule:
        return ""
    begin, end = find_rule_span(ride.brake_onset_time, ride.stop_time, response.hold_s, response.release_s)
    acts = begin <= float(ride.columns["t_ns"][tick]) * 1e-9 <= end
    return f" before the low-speed rule, which acts from {begin:.3f} s to {end:.3f} s" if acts else ""


def picture_steps(
    vehicle: Vehicle, camera: Camera, row: Mapping[str, Any], first: Mapping[str, Any], route: Route | None
) -> list[Step]:
    """Where pitch and heave put the camera, and what moves in the picture (paper, Eq. 11).

    Parameters
    ----------
    vehicle : turns about its centre of gravity
    camera : on the body
    row, first : the stored frame, and frame 0 of the clip
    route : of the scene; None where the scene is not at hand
    """
    heave, pitch = float(row["heave"]), float(row["pitch"])
    body = {"cg_behind_front_axle": vehicle.cg_to_front_axle, "cg_height": vehicle.cg_height}
    straight = Route(station=np.array([0.0, 1.0]), T_world_rig=np.tile(np.eye(4), (2, 1, 1)))
    still, moved = body_poses(straight, np.zeros(2), np.array([0.0, heave]), np.array([0.0, pitch]), **body)
    rest, now = still @ camera.T_rig_camera, moved @ camera.T_rig_camera
    far, near = np.array([1.0, 0.0, 0.0, 0.0]), np.array([ROAD_POINT_M, 0.0, 0.0, 1.0])
    steps = [
        Step(quantity=quantity, symbol="Delta v", equation="11", unit="px",
             formula=f"{_row_of(point, now, camera):.4f} - {_row_of(point, rest, camera):.4f}, down positive",
             recomputed=_row_of(point, now, camera) - _row_of(point, rest, camera))
        for quantity, point in (("shift of the horizon", far),
                                (f"shift of the road {ROAD_POINT_M:g} m ahead", near))
    ]  # fmt: skip
    if route is not None:
        pose = body_poses(
            route, np.array([float(row["station"])]), np.array([heave]), np.array([pitch]), **body
        )
        off = float(np.abs(pose[0].ravel() - np.asarray(row["T_world_rig"], float)).max())
        steps.append(Step(
            quantity="largest difference of an entry of the stored pose from P_0(s) with heave and pitch", symbol="P",
            equation="11", unit="m", formula="P_0(s) (+) (z_s, theta)", recomputed=off, stored=0.0,
        ))  # fmt: skip
    seen = float(row["recovered_pitch"])
    if np.isfinite(seen):
        steps.append(Step(
            quantity="pitch since frame 0, beside that recovered from the pixels", symbol="theta^", equation="11",
            unit="rad", formula=f"{pitch:.6g} - {float(first['pitch']):.6g}",
            recomputed=pitch - float(first["pitch"]), stored=seen, exact=False,
        ))  # fmt: skip
    return steps


def _row_of(point: NDArray[np.float64], T_rig_camera: NDArray[np.float64], camera: Camera) -> float:
    """Picture row of a point or, with last entry 0, of a direction [px]."""
    in_camera = np.linalg.inv(T_rig_camera) @ point
    return float((camera.K @ (in_camera[:3] / in_camera[2]))[1])
