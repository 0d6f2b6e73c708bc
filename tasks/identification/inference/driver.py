"""A driver who holds his speed until he brakes: told by the speed before the brake, which is then left out.

Without a throttle or an engine torque in the log nobody knows what drove the car there. Taken for coasting, it hides a
resistance, or makes it fit the stop alone.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tasks.campaign.campaign import CHANNELS, Campaign, Run
from tasks.identification.inference.forward import RunModel, predict_channels, prepare_run
from tasks.surface.state import SurfaceParameters
from tasks.vehicle.effects.slots import Slot
from tasks.vehicle.parameters import Vehicle

LIFT = 0.2
"""Time in which a driver lifts the throttle, centred on the brake where no throttle was measured [s]."""
SPEED = CHANNELS.index("speed")


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
    """Return the acceleration before the brake that a model leaves open, over all runs on a flat road [m/s2].

    Parameters
    ----------
    models : the runs
    theta : float64 [len(EFFECT_TABLE)] effects and sensor errors [units of the table]
    slots : forms
    share : of a run's largest pressure from which its driver brakes [1]
    """
    moment = spread = 0.0
    for model in models:
        onset = find_brake_onset(model, share)
        if onset in (0, model.samples) or model.run.hazard_length > 0.0:
            continue
        before = replace(model, samples=onset)
        residual = before.measured[:, SPEED] - predict_channels(before, theta, slots=slots)[:, SPEED]
        time = (np.arange(onset) - 0.5 * (onset - 1)) * model.run.interval
        moment, spread = moment + float(time @ residual), spread + float(time @ time)
    return moment / spread if spread > 0.0 else 0.0


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

    def begin(run: Run) -> Run:
        model = prepare_run(run, vehicle, surface)
        onset = find_brake_onset(model, share)
        if onset == model.samples or run.hazard_length > 0.0:
            return run
        return run.begin_at(max(onset - round(0.5 * LIFT / run.interval), 0))

    return replace(campaign, runs=tuple(begin(run) for run in campaign.runs))
