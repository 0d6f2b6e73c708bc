"""Telemetry of a reference trace: the motion of another simulator, in the columns of a rollout.

The paper's CarSim-pose video reference (Appendix A.5) shows station, speed, pitch and the height of the centre of
gravity as the other simulator has them. What a trace does not hold stays NaN.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from tasks.conventions import TICK_CHANNELS
from tasks.vehicle.rollout import TICK_NS, Rollout

STANDING = 0.05
"""Speed below which a car stands [m/s] (paper, Appendix E)."""
ENDS_STANDING = 2 * STANDING
"""Speed up to which a trace ended with the stop [m/s]: its last sample may lie some ticks before `STANDING`."""
BEFORE_START = 0.05
"""Way before the route's start that is taken as its start [m]: the first samples of a car that moves from 0 s on."""
REST_S = 0.8
"""Time before which the height of the centre of gravity is that of rest [s] (paper, Appendix A.5)."""
MOVED = ("speed", "longitudinal_acceleration", "heave_rate", "pitch_rate", "braking_slip_f", "braking_slip_r")
"""Columns that are 0 of a car that stands after the end of its trace."""

Floats = NDArray[np.float64]


def replay_trace(
    trace: Mapping[str, Floats],
    *,
    duration_s: float,
    surface_friction: float,
    static_pitch_deg: float | None,
    brake_onset_s: float | None,
    stopping_distance_m: float | None,
) -> Rollout:
    """Return the motion of a trace as a rollout, linear between its rows.

    Of a trace that ends with a standing car the last row is held; of any other the rest of the rollout is NaN.

    Parameters
    ----------
    trace : columns of a reference trace with cg_height: time [s], station [m], speed [m/s], pitch [deg], slips [1],
        wheel loads [N], heights [m]; brake_pressure [MPa] and longitudinal_acceleration [m/s2] where it has them
    duration_s : length of the rollout, whole milliseconds [s]
    surface_friction : mu_c [1]
    static_pitch_deg : of the resting body, contained in the trace's pitch; None takes the trace's first [deg]
    brake_onset_s : None for a car that does not brake, or that brakes at a station [s]
    stopping_distance_m : None where there is none [m]
    """
    ticks = np.arange(round(duration_s * 1000) + 1, dtype=np.int64)
    t, time = ticks * (TICK_NS * 1e-9), trace["time"]
    static = float(np.deg2rad(trace["pitch"][0] if static_pitch_deg is None else static_pitch_deg))
    stands = trace["speed"][-1] <= ENDS_STANDING
    beyond = t > time[-1] + 1e-9

    def sample_column(values: Floats) -> Floats:
        return np.interp(t, time, values, right=values[-1] if stands else np.nan)

    height = trace["cg_height"]
    columns: dict[str, NDArray[np.generic]] = {
        "station": sample_column(np.maximum(trace["station"], 0.0)),
        "speed": sample_column(trace["speed"]),
        "pitch": sample_column(np.deg2rad(trace["pitch"]) - static),
        "heave": sample_column(height - np.median(height[time < max(REST_S, time[0] + 1e-9)])),
        "pitch_rate": sample_column(np.gradient(np.deg2rad(trace["pitch"]), time)),
        "heave_rate": sample_column(np.gradient(height, time)),
        "longitudinal_acceleration": sample_column(
            trace.get("longitudinal_acceleration", np.gradient(trace["speed"], time))
        ),
    }
    for axle in "fr":
        columns[f"braking_slip_{axle}"] = sample_column((trace[f"slip_{axle}l"] + trace[f"slip_{axle}r"]) / 2)
        load = sample_column(trace[f"wheel_load_{axle}l"] + trace[f"wheel_load_{axle}r"])
        columns |= {f"axle_load_{axle}": load, f"contact_{axle}": load > 0}
    if "brake_pressure" in trace:
        columns["brake_pressure_mpa"] = sample_column(trace["brake_pressure"])
    if stands:
        for name in MOVED:
            columns[name][beyond] = 0.0
    columns["t_ns"] = ticks * TICK_NS
    onset = np.nan if brake_onset_s is None else brake_onset_s
    slow = np.flatnonzero(trace["speed"] <= STANDING)
    return Rollout(
        columns={c.name: columns.get(c.name, np.full(len(ticks), np.nan)) for c in TICK_CHANNELS},
        mode="coupled",
        surface_friction=surface_friction,
        tyre_peak=np.nan,
        slip_stiffness=np.nan,
        target_slip=np.nan,
        static_pitch=static,
        brake_onset_time=onset,
        stop_time=float(time[slow[0]] if len(slow) else time[-1]) if stands or len(slow) else np.nan,
        stopping_distance=np.nan if stopping_distance_m is None else stopping_distance_m,
        calibration_extrapolated=False,
    )
