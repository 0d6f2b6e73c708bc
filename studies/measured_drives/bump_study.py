"""A bump study on a campaign: which road features its pitch rate gives away, and with which car."""

from dataclasses import asdict
from typing import Any

import numpy as np

from catalogs.entries import load
from flows.store.outputs import Outputs
from studies.measured_drives.brake_dive import pitch_mode
from studies.measured_drives.drives import read_drives
from studies.measured_drives.plans import load_plan
from studies.measured_drives.road_bump import fit_feature, fit_feature_and_car, passage_of
from studies.measured_drives.sensor_agreement import measure_sensor_agreement
from tasks.errors import InputError

NEEDED = ("speed", "pitch", "pitch_rate", "vertical_acceleration", "longitudinal_acceleration")


def bump_study(
    campaign: str, *, study: str = "comma2k19", vehicle: str | None = None, out: str | None = None
) -> dict[str, Any]:
    """Find the road feature of each window, the car fitted on the first window and kept.

    Parameters
    ----------
    campaign : campaign folder with pitch rate, vertical acceleration and speed
    study : bump study by name or YAML file
    vehicle : to start from, by name or YAML file; None takes the campaign's
    out : folder for ``bump_study.json``; None writes none

    Returns
    -------
    ``sensors`` (how the channels agree), ``windows[]`` with a fit of the uncalibrated and of the calibrated car,
    ``pitch_mode`` of both, ``units``.

    Raises
    ------
    InputError
        If the run or a channel is missing, or a window lies outside the run.
    """
    results = Outputs(out, "lab bump-study", "bump_study.json")
    plan = load_plan("bump study", study)
    recorded = read_drives(campaign, needed=NEEDED)
    drive = next((drive for drive in recorded.drives if drive.name == plan.run), None)
    if drive is None:
        names = ", ".join(drive.name for drive in recorded.drives)
        raise InputError(f"{recorded.name}: the study needs the run {plan.run}; there are: {names}")
    length = (len(drive.columns["speed"]) - 1) * drive.interval
    outside = [window.name for window in plan.windows if window.from_s < 0 or window.to_s > length]
    if outside:
        raise InputError([f"{plan.run}: window {name} must lie within 0 to {length:g} s" for name in outside])
    base = load("vehicle", vehicle or recorded.vehicle)
    passages = [passage_of(drive.columns, drive.interval, w.from_s, w.to_s) for w in plan.windows]
    _, car = fit_feature_and_car(passages[0], base)
    agreement = measure_sensor_agreement(drive.columns, drive.interval)
    result: dict[str, Any] = {
        "campaign": recorded.name,
        "vehicle": base.name,
        "sensors": None if agreement is None else asdict(agreement),
        "pitch_mode": {"uncalibrated": _mode(base), "calibrated": _mode(car)},
        "windows": [
            {
                "window": window.name,
                "speed_m_s": float(np.mean(np.diff(passage.station)) / passage.interval),
                "uncalibrated": asdict(fit_feature(passage, base)),
                "calibrated": asdict(fit_feature(passage, car)),
            }
            for window, passage in zip(plan.windows, passages, strict=True)
        ],
        "units": {"rate_rmse": "deg/s", "rate_rms": "deg/s", "peak_pitch": "deg", "feature": "m"},
    }
    results.write_json("bump_study.json", result)
    return result


def _mode(vehicle: Any) -> dict[str, float]:
    frequency, damping_ratio = pitch_mode(vehicle)
    return {"frequency_hz": frequency, "damping_ratio": damping_ratio}
