"""Errors put into sound clips: in stored columns, or by a generator that drives another car than it states."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from flows.making.clip import collect_motion_figures
from studies.physics_judge.clips import StudyClip, make_clip
from tasks.render.camera import body_poses

Tables = tuple[dict[str, NDArray[Any]], dict[str, NDArray[Any]]]
SURFACE = ("film_depth_mm", "snow_depth_mm", "snow_coverage", "surface_friction", "tyre_peak")
Error = Callable[[StudyClip], Tables]


def edit(clip: StudyClip, **columns: NDArray[Any]) -> Tables:
    """Return both tables with other columns; the rig stays where it was."""
    shown = {name: column[clip.frames["tick"]] for name, column in columns.items()}
    return clip.ticks | columns, clip.frames | shown


def edit_with_poses(clip: StudyClip, **columns: NDArray[Any]) -> Tables:
    """Return both tables with other columns, which the rig follows."""
    ticks, frames = edit(clip, **columns)
    return ticks, frames | {"T_world_rig": pose(clip, frames)}


def pose(clip: StudyClip, frames: dict[str, NDArray[Any]], more_pitch: float = 0.0) -> NDArray[np.float64]:
    """Return the rig's poses [F, 16] of a frame table, with a pitch [rad] on top."""
    car = clip.constants.car
    found = body_poses(
        clip.route, frames["station"], frames["heave"], frames["pitch"] + more_pitch,
        cg_behind_front_axle=car["cg_to_front_axle"], cg_height=car["cg_height"],
    )  # fmt: skip
    return found.reshape(-1, 16)


def drive(clip: StudyClip, scenario: dict[str, Any] | None = None, **car: float) -> Tables:
    """Return the tables of another scenario, or of a car whose numbers are scaled."""
    stated, vehicle, mode = clip.rides
    other = replace(vehicle, **{name: getattr(vehicle, name) * factor for name, factor in car.items()})
    seconds = (len(clip.ticks["speed"]) - 1) / 1000
    made = make_clip(replace(stated, **(scenario or {})), other, mode, duration_s=seconds)
    return made.ticks, made.frames | {name: clip.frames[name] for name in SURFACE}


def state_outcome(clip: StudyClip, ticks: dict[str, NDArray[Any]]) -> dict[str, Any]:
    """Return the clip's row as whoever made the error writes it: stated inputs, and outcomes of the ticks.

    Parameters
    ----------
    clip : as its generator states it
    ticks : columns with the error
    """
    standing = np.flatnonzero(ticks["speed"] <= 0)
    station, seconds = ticks["station"], 0.001 * np.arange(len(ticks["speed"]))
    way = station[-1] - np.interp(clip.facts["brake_onset_s"], seconds, station)
    stop = {"stop_time": 0.001 * standing[0], "stopping_distance": way} if len(standing) else {}
    return clip.facts | {**collect_motion_figures(ticks), **stop}


def move_poses(clip: StudyClip, change: Callable[[NDArray[np.float64]], NDArray[np.float64]]) -> Tables:
    """Return both tables with other rig poses [F, 4, 4]."""
    poses = change(clip.frames["T_world_rig"].reshape(-1, 4, 4).copy())
    return clip.ticks, clip.frames | {"T_world_rig": poses.reshape(-1, 16)}


def _shift(
    poses: NDArray[np.float64], rows: slice | int, metres: tuple[float, float, float]
) -> NDArray[np.float64]:
    poses[rows, :3, 3] += np.array(metres)
    return poses


def _turn(poses: NDArray[np.float64], degrees: float) -> NDArray[np.float64]:
    cos, sin = np.cos(np.deg2rad(degrees)), np.sin(np.deg2rad(degrees))
    yaw = np.eye(4)
    yaw[:2, :2] = [[cos, -sin], [sin, cos]]
    return poses @ yaw


def _lag_wheel(clip: StudyClip, seconds: float = 0.02) -> Tables:
    t, share = clip.ticks, 0.001 / seconds
    start = [(1 - share) * t["wheel_speed_f"][0]]
    omega = lfilter([share], [1, share - 1], t["wheel_speed_f"], zi=start)[0] * (t["speed"] > 0)
    lowest = -1.0 if clip.rides[2] == "coupled" else 0.0
    slip = (t["speed"] - clip.constants.car["wheel_radius"] * omega) / np.maximum(t["speed"], 0.5)
    return edit(clip, wheel_speed_f=omega, braking_slip_f=np.clip(slip, lowest, 1.0))


def _drift_while_held(clip: StudyClip) -> Tables:
    t = clip.ticks
    time = t["t_ns"] * 1e-9
    speed = t["speed"] - 0.01 * np.minimum(time, clip.facts["brake_onset_s"]) * (t["speed"] > 1)
    station = t["station"] + np.concatenate([[0.0], np.cumsum(np.diff(time) * (speed - t["speed"])[1:])])
    return edit_with_poses(clip, speed=speed, station=station)


def _freeze_scale(clip: StudyClip) -> Tables:
    t, frozen = clip.ticks, np.where(clip.ticks["speed"] > 0, 0.8, clip.ticks["abs_scale_f"])
    with np.errstate(invalid="ignore", divide="ignore"):
        ratio = np.where(t["abs_scale_f"] > 0, frozen / t["abs_scale_f"], 1.0)
    return edit(clip, abs_scale_f=frozen, brake_torque_f=t["brake_torque_f"] * ratio)


def _freeze_load(clip: StudyClip) -> Tables:
    load = clip.ticks["axle_load_f"].copy()
    begin = int(np.argmax(np.abs(np.diff(load))))
    load[begin : begin + 50] = load[begin]
    return edit(clip, axle_load_f=load)


def _smooth_acceleration(clip: StudyClip) -> Tables:
    a = clip.ticks["longitudinal_acceleration"]
    return edit(
        clip, longitudinal_acceleration=np.convolve(np.pad(a, 10, mode="edge"), np.ones(21) / 21, "valid")
    )


def _creep(clip: StudyClip) -> Tables:
    speed = clip.ticks["speed"].copy()
    speed[speed <= 0] = 0.01
    return edit(clip, speed=speed)


def _count_wheels(clip: StudyClip) -> Tables:
    t = clip.ticks
    rolled = clip.constants.car["wheel_radius"] * t["wheel_speed_r"]
    way = np.concatenate([[0.0], np.cumsum(0.0005 * (rolled[1:] + rolled[:-1]))])
    return edit_with_poses(clip, station=way)


def _show_next_tick(clip: StudyClip) -> Tables:
    rows = np.minimum(clip.frames["tick"] + 1, len(clip.ticks["speed"]) - 1)
    frames = clip.frames | {name: column[rows] for name, column in clip.ticks.items()}
    return clip.ticks, frames | {"T_world_rig": pose(clip, frames)}


def _swap_axles(clip: StudyClip) -> Tables:
    t = clip.ticks
    names = ("wheel_speed", "braking_slip", "tyre_force")
    return edit(clip, **{f"{n}_{a}": t[f"{n}_{b}"] for n in names for a, b in ("fr", "rf")})


def _mirror_loads(clip: StudyClip) -> Tables:
    t = clip.ticks
    mirrored = {axle: 2 * clip.constants.static_load(axle) - t[f"tyre_load_{axle}"] for axle in "fr"}
    return edit(clip, **{f"tyre_load_{axle}": np.maximum(load, 0.0) for axle, load in mirrored.items()})


def _stamp_late(clip: StudyClip) -> Tables:
    late = clip.ticks["t_ns"] + 1_000_000 * (np.arange(len(clip.ticks["t_ns"])) > 700)
    return edit(clip, t_ns=late)


ERRORS: dict[str, Error] = {
    "torque 3 % high": lambda c: edit(c, brake_torque_f=c.ticks["brake_torque_f"] * 1.03),
    "load moves to the wrong side": _mirror_loads,
    "axles swapped": _swap_axles,
    "pitch nose-up": lambda c: edit_with_poses(c, pitch=-c.ticks["pitch"], pitch_rate=-c.ticks["pitch_rate"]),
    "heave 1 cm off": lambda c: edit_with_poses(c, heave=c.ticks["heave"] + 0.01),
    "camera 5 cm too high": lambda c: move_poses(c, lambda p: _shift(p, slice(None), (0, 0, 0.05))),
    "jump of 2 cm": lambda c: move_poses(c, lambda p: _shift(p, 3, (0.02, 0, 0))),
    "time stamps a tick late": _stamp_late,
    "slip clipped": lambda c: edit(c, braking_slip_f=np.minimum(c.ticks["braking_slip_f"], 0.05)),
    "friction of the neighbouring rate": lambda c: drive(
        c, {"precipitation_mm_h": 1.25 * c.rides[0].precipitation_mm_h}
    ),
    "held speed drifts": _drift_while_held,
    "ABS scale frozen": _freeze_scale,
    "road 3 cm farther on": lambda c: drive(c, {"hazard_center_m": c.rides[0].hazard_center_m + 0.03}),
    "mass 1 % high": lambda c: drive(c, sprung_mass=1.01),
    "wheel speed lags 20 ms": _lag_wheel,
    "static pitch twice": lambda c: (
        c.ticks,
        c.frames | {"T_world_rig": pose(c, c.frames, c.facts["static_pitch"])},
    ),
    "coasts twice as hard": lambda c: drive(c, coast_deceleration=2.0),
    "brake a tick late": lambda c: drive(c, {"brake_onset_s": c.rides[0].brake_onset_s + 0.001}),  # type: ignore[operator]
    "rear axle 2 cm back": lambda c: drive(c, cg_to_rear_axle=1 + 0.02 / c.constants.car["cg_to_rear_axle"]),
    "dampers 3 % soft": lambda c: drive(c, suspension_damping_f=0.97, suspension_damping_r=0.97),
    "pitch inertia 3 % high": lambda c: drive(c, pitch_inertia=1.03),
    "centre of gravity 1 % high": lambda c: drive(c, cg_height=1.01),
    "brake share 2 % off": lambda c: drive(c, front_brake_share=1.02),
    "tyre 2 % stiff": lambda c: drive(c, tyre_stiffness_f=1.02),
    "axle load frozen for 50 ms": _freeze_load,
    "station counted from the wheels": _count_wheels,
    "frames show the next tick": _show_next_tick,
    "rig yawed by 0.2 deg": lambda c: move_poses(c, lambda p: _turn(p, 0.2)),
    "poses a frame late": lambda c: move_poses(c, lambda p: np.concatenate([p[:1], p[:-1]])),
    "acceleration smoothed": _smooth_acceleration,
    "tyre's height 2 % off": lambda c: edit(c, tyre_force_f=c.ticks["tyre_force_f"] * 1.02),
    "creeps after the stop": _creep,
    "ramp 10 % short": lambda c: drive(c, {"ramp_s": 0.9 * c.rides[0].ramp_s}),
    "wheel inertia 5 % high": lambda c: drive(c, wheel_inertia_f=1.05, wheel_inertia_r=1.05),
    "gravity 9.79": lambda c: drive(c, gravity=9.79 / 9.81),
}
"""Every error by its name."""
