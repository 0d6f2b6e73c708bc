"""What drove the car before the brake, where no engine torque was logged: that part of a run is left out.

With a throttle in the log a run begins where it closes. Without one a driver who holds his speed until he brakes is
known by that speed. Taken for coasting, it hides a resistance, or makes it fit the stop alone.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tasks.campaign.campaign import CHANNELS, LEAST_SAMPLES, Campaign, Run
from tasks.identification.inference.forward import RunModel, predict_channels, prepare_run
from tasks.identification.rules import DecisionRules
from tasks.surface.state import SurfaceParameters
from tasks.vehicle.effects.slots import Slot
from tasks.vehicle.effects.table import EFFECT_TABLE
from tasks.vehicle.parameters import Vehicle

LIFT = 0.2
"""Time in which a driver lifts the throttle, centred on the brake where no throttle was measured [s]."""
SPEED = CHANNELS.index("speed")
FEWEST_SAMPLES, SURE = 5, 4.0
"""Samples before the brake, or under it, whose slope tells something, and its standard errors, for AR(1) noise [1]."""


def find_brake_onset(model: RunModel, share: float) -> int:
    """Return the first sample at which the driver brakes; the number of samples where he does not.

    Parameters
    ----------
    model : the run
    share : of the run's largest pressure from which he brakes [1]
    """
    pressure = model.pressure
    pressed = np.flatnonzero(pressure > share * pressure.max())
    return int(pressed[0]) if pressed.size else model.samples


def measure_drive(
    models: Sequence[RunModel], theta: NDArray[np.float64], slots: tuple[Slot, ...], share: float
) -> float:
    """Return the acceleration before the brake beyond a model's, root mean square over all runs on a flat road [m/s2].

    One that is not surely positive counts as none: what a model lacks slows the car down.

    Parameters
    ----------
    models : the runs
    theta : float64 [len(EFFECT_TABLE)] effects and sensor errors [units of the table]
    slots : forms
    share : of a run's largest pressure from which its driver brakes [1]
    """
    drives, spreads = [], []
    for model in models:
        onset = find_brake_onset(model, share)
        if onset < FEWEST_SAMPLES or onset == model.samples or model.run.hazard_length > 0.0:
            continue
        before = replace(model, samples=onset)
        residual = before.measured[:, SPEED] - predict_channels(before, theta, slots=slots)[:, SPEED]
        time = (np.arange(onset) - 0.5 * (onset - 1)) * model.run.interval
        spread = float(time @ time)
        drive = float(time @ residual) / spread
        error = float(np.std(residual - drive * time)) / np.sqrt(spread)
        drives.append(drive if drive > SURE * error else 0.0)
        spreads.append(spread)
    return float(np.sqrt(np.average(np.square(drives), weights=spreads))) if drives else 0.0


def leave_out_driving(
    campaign: Campaign, vehicle: Vehicle, surface: SurfaceParameters, rules: DecisionRules
) -> tuple[Campaign, float]:
    """Return a campaign without the parts of its runs in which an engine drove the car that nobody measured.

    Parameters
    ----------
    campaign : measured runs
    vehicle, surface : the model as it stands
    rules : when a throttle is closed, a driver brakes, and a car is driven

    Returns
    -------
    The campaign, and the acceleration before the brake if a driver without a throttle in the log held his speed, else 0
    [m/s2].
    """
    share = rules.brake_onset_share
    runs = _keep_parts(campaign.runs, lambda run: _find_closed_throttle(run, vehicle, surface, rules))
    models = [prepare_run(r, vehicle, surface) for r in runs if not r.held_out and r.throttle is None]
    drive = measure_drive(models, np.zeros(len(EFFECT_TABLE)), (), share)
    if drive <= rules.driven_acceleration:
        return replace(campaign, runs=runs), 0.0
    return begin_at_brake(replace(campaign, runs=runs), vehicle, surface, share), drive


def begin_at_brake(
    campaign: Campaign, vehicle: Vehicle, surface: SurfaceParameters, share: float
) -> Campaign:
    """Return a campaign whose stops on a flat road begin as the driver changes from throttle to brake.

    Parameters
    ----------
    campaign : measured runs
    vehicle, surface : the model as it stands
    share : of a run's largest pressure from which its driver brakes [1]
    """

    def find_stop(run: Run) -> tuple[int, int]:
        model = prepare_run(run, vehicle, surface)
        onset = find_brake_onset(model, share)
        if onset == model.samples or run.throttle is not None:
            return 0, len(run.pressure)
        return max(onset - round(0.5 * LIFT / run.interval), 0), len(run.pressure)

    return replace(campaign, runs=_keep_parts(campaign.runs, find_stop))


def _keep_parts(runs: Sequence[Run], find_part: Callable[[Run], tuple[int, int]]) -> tuple[Run, ...]:
    """Return runs cut to a part of them; one that is too short then, or crosses a road feature, stays whole."""
    kept = []
    for run in runs:
        first, end = find_part(run) if run.hazard_length == 0.0 else (0, len(run.pressure))
        whole = (first, end) == (0, len(run.pressure)) or end - first < LEAST_SAMPLES
        kept.append(run if whole else replace(run.begin_at(first, end), speed_before=run.speed[:first]))
    return tuple(kept)


def _find_closed_throttle(
    run: Run, vehicle: Vehicle, surface: SurfaceParameters, rules: DecisionRules
) -> tuple[int, int]:
    """Return the first sample from which the throttle is closed until the brake, and that behind which it opens again.

    A blip of the throttle while the driver changes down is part of the stop.
    """
    if run.throttle is None or run.drive_torque is not None:
        return 0, len(run.pressure)
    onset = find_brake_onset(prepare_run(run, vehicle, surface), rules.brake_onset_share)
    closed = run.throttle <= rules.closed_throttle
    opened, shut = np.flatnonzero(~closed[:onset]), np.flatnonzero(closed)
    return int(opened[-1]) + 1 if opened.size else 0, int(shut[-1]) + 1 if shut.size else 0
