"""Laws of a clip's row: what the scenario commands of brake and road, the surface, and the outcome."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from studies.physics_judge.laws.constants import (
    DT,
    SURFACE_FORMS,
    ClipColumns,
    Constants,
    Floats,
    derive_surface,
    pressure_at,
    raised_cosine,
)
from studies.physics_judge.laws.half_step import find_brake_onset, pressure_shape
from studies.physics_judge.laws.law import ROUNDING, Law, evaluate_law

AT_A_STEP = 1e-9
"""Time about a tick within which a command that jumps has either value [s]."""

LAST_PASS = 2e-6
"""Way between the last two passes over a road feature [m]."""

LITERAL_PASS = 1e-2
"""The same where the published steps are taken literally: they swing about a stop, and five passes are all [m]."""


def command_laws(ticks: Mapping[str, Floats], facts: Mapping[str, Any]) -> list[Law | None]:
    """Return the law of the brake pressure as the scenario commands it.

    Parameters
    ----------
    ticks : columns of the tick table
    facts : the clip's row
    """
    time: Floats = 1e-3 * np.arange(len(ticks["speed"]), dtype=np.float64)
    onset = find_brake_onset(ticks, facts)
    peak, ramp, hold, lasting = pressure_shape(facts)
    pressure = ticks["brake_pressure_mpa"]
    around = [
        pressure_at(time - onset + late, peak, ramp, hold, lasting) for late in (-AT_A_STEP, 0.0, AT_A_STEP)
    ]
    wanted = np.clip(pressure, np.min(around, axis=0), np.max(around, axis=0))
    steepest = peak / max(ramp, 1e-3)
    by_place = facts["brake_onset_m"] is not None and np.isfinite(facts["brake_onset_m"])
    slack = 1e-9 + (steepest * 1e-5 if by_place else 0.0)
    release = "" if np.isinf(hold) else " clips.hold_s clips.release_s"
    columns = f"brake_pressure_mpa clips.peak_pressure_mpa clips.ramp_s clips.brake_onset_s{release}"
    if by_place:
        columns = columns.replace("brake_onset_s", "brake_onset_m")
    return [evaluate_law("brake pressure as commanded", columns, pressure - wanted, slack)]


def road_height_laws(clip: ClipColumns) -> list[Law | None]:
    """Return the laws of the road heights under both axles.

    Parameters
    ----------
    clip : what is judged
    """
    ticks, facts, constants = clip
    s, v = ticks["station"], ticks["speed"]
    laws = []
    hump = facts["hazard_center_m"], facts["hazard_length_m"], facts["hazard_height_m"]
    moves = v > 0
    way = LITERAL_PASS if constants.steady_limit == 0 else LAST_PASS
    for axle, behind in (("f", 0.0), ("r", constants.wheelbase)):
        height, before, after = (raised_cosine(s - behind + shift, *hump)[0] for shift in (0.0, -way, way))
        apart = np.maximum(np.abs(before - height), np.abs(after - height))
        laws.append(
            evaluate_law(f"road height as commanded, {axle}", f"road_height_{axle} station clips.hazard_height_m"
                " clips.hazard_center_m clips.hazard_length_m",
                (ticks[f"road_height_{axle}"] - height)[moves], (apart + 1e-9)[moves])
        )  # fmt: skip
    return laws


def surface_laws(facts: Mapping[str, Any], constants: Constants) -> list[Law | None]:
    """Film, snow, friction and the tyre's peak, mu_eff = eta mu_c (paper, Appendix E).

    Parameters
    ----------
    facts : the clip's row
    constants : car and pavement
    """
    expected = derive_surface(
        facts["weather"], facts["precipitation_mm_h"], facts["snow_accumulation_h"], constants.surface
    )
    feeds = SURFACE_FORMS[facts["weather"]].feeds
    tyre = constants.tyres[facts["weather"]]
    eta = tyre.at(tyre.efficiency, facts["surface_friction"])
    laws = [
        evaluate_law(f"{name} of the precipitation", f"clips.{name} {feeds.get(name, '')}",
            np.array([facts[name] - value]), ROUNDING * (1 + abs(value)))
        for name, value in expected.items()
    ]  # fmt: skip
    peak = np.array([facts["tyre_peak"] - eta * facts["surface_friction"]])
    laws.append(evaluate_law("mu_eff is eta mu_c", "clips.tyre_peak clips.surface_friction", peak, ROUNDING))
    return laws


def outcome_laws(clip: ClipColumns) -> list[Law | None]:
    """Return the laws of stop, distance, peaks, ABS and wheel lift, each computed again.

    Parameters
    ----------
    clip : what is judged
    """
    ticks, facts, constants = clip
    s, v, pitch = ticks["station"], ticks["speed"], ticks["pitch"]
    laws = [
        evaluate_law("peak pitch is the largest", "clips.peak_pitch pitch", pitch.max() - facts["peak_pitch"], 1e-12),
        evaluate_law("peak deceleration is the largest", "clips.peak_deceleration longitudinal_acceleration",
            max(0.0, -ticks["longitudinal_acceleration"].min()) - np.array([facts["peak_deceleration"]]), 1e-12),
        evaluate_law("peak pitch rate is the largest", "clips.peak_pitch_rate pitch_rate",
            np.abs(ticks["pitch_rate"]).max() - np.array([facts["peak_pitch_rate"]]), 1e-12),
        evaluate_law("peak slip is the larger axle's", "clips.peak_slip braking_slip_f braking_slip_r",
            max(ticks[f"braking_slip_{axle}"].max() for axle in "fr") - np.array([facts["peak_slip"]]), 1e-12),
        evaluate_law("ABS time is time of a reduced torque", "clips.abs_time abs_scale_f abs_scale_r",
            np.array([facts["abs_time"] - DT * np.sum((ticks["abs_scale_f"] < 1) | (ticks["abs_scale_r"] < 1))]),
            0.5 * DT),
        evaluate_law("static pitch is the car's", "clips.static_pitch",
            np.array([facts["static_pitch"] - constants.car["static_pitch"]]), 1e-9),
    ]  # fmt: skip
    laws += [
        evaluate_law(f"wheel lift is time without contact, {axle}", f"clips.wheel_lift_time_{axle} contact_{axle}",
            np.array([facts[f"wheel_lift_time_{axle}"] - DT * np.sum(np.asarray(ticks[f"contact_{axle}"]) < 0.5)]),
            0.5 * DT)
        for axle in "fr"
    ]  # fmt: skip
    standing = np.flatnonzero(v <= 0)
    if standing.size:
        laws.append(
            evaluate_law("stop time is the first standing tick", "clips.stop_time speed",
                np.array([facts["stop_time"] - DT * standing[0]]), DT)
        )  # fmt: skip
        onset = find_brake_onset(ticks, facts)
        if np.isfinite(onset):
            way = s[-1] - np.interp(onset, DT * np.arange(len(s)), s)
            laws.append(
                evaluate_law("stopping distance from the onset", "clips.stopping_distance station",
                    np.array([facts["stopping_distance"] - way]), 1e-5)
            )  # fmt: skip
    return laws
