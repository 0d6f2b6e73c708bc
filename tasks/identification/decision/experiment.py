"""The next experiment: the planned run that separates two fitted explanations best."""

from dataclasses import dataclass, replace

import numpy as np

from tasks.campaign.channels import describe_brake
from tasks.campaign.planned_runs import make_planned_run, plan_experiments
from tasks.identification.inference.derivatives import differentiate_run
from tasks.identification.inference.evidence import Evidence
from tasks.identification.inference.fit import Fit
from tasks.identification.inference.forward import predict_channels, prepare_run
from tasks.identification.inference.noise import whiten_channels
from tasks.surface.state import SurfaceParameters
from tasks.vehicle.effects.table import PARAMETER_INDEX
from tasks.vehicle.parameters import Vehicle


@dataclass(frozen=True, kw_only=True)
class Experiment:
    """A planned run and the evidence that it is expected to give.

    Parameters
    ----------
    between : names of the two explanations
    plan : description of the run
    expected_d2 : squared distance between their whitened predictions with nuisances projected out; each unit is half
        a unit of log likelihood, so 20 from one run decides [1]
    """

    between: tuple[str, str]
    plan: str
    expected_d2: float


def plan_next_experiment(
    evidence: Evidence,
    first: Fit,
    second: Fit,
    between: tuple[str, str],
    vehicle: Vehicle,
    surface: SurfaceParameters,
    brake_signal: str = "brake_pressure",
) -> Experiment | None:
    """Return the planned run with the largest nuisance-marginalised D2 between two fits; None if all are alike.

    Parameters
    ----------
    evidence : the runs, and the noise of their sensors and the priors of the planned one
    first, second : fitted explanations
    between : what each names that the other does not
    vehicle, surface : the judged model
    brake_signal : that was logged
    """
    rho, sigma = evidence.sensors
    theta, slots = first.compose()
    other, other_slots = second.compose()
    planned = []
    brake_gain = vehicle.brake_gain * (1.0 + theta[PARAMETER_INDEX["pressure_gain"]])
    for plan, drive in plan_experiments(brake_gain / (vehicle.wheel_radius * vehicle.mass)):
        plan += f", {describe_brake(abs(drive.peak), brake_signal)}" if drive.peak else ""
        run = make_planned_run(drive, plan, interval=evidence.train[0].model.run.interval)
        if (sampled := evidence.train[0].model.sampled) is not None:
            run = replace(run, sampled=np.resize(sampled, run.response.shape))
        model = prepare_run(run, vehicle, surface)
        predicted = predict_channels(model, theta, slots=slots)
        # prepared again with the predicted speed, so that the run ends where the vehicle is slow
        model = prepare_run(replace(model.run, response=predicted), vehicle, surface)
        change = predict_channels(model, other, slots=other_slots) - predict_channels(
            model, theta, slots=slots
        )
        planned.append((plan, model, whiten_channels(change, rho, sigma, model.sampled)))
    best = ("", evidence.rules.least_expected_d2)
    # what the nuisances take away makes a distance smaller only: the largest come first, and the rest are not taken
    for plan, model, change in sorted(planned, key=lambda run: -float(run[2] @ run[2])):
        if float(change @ change) <= best[1]:
            break
        expected = differentiate_run(
            model, rho, sigma, theta, (), evidence.tolerances, evidence.disturbance, slots
        )
        q = expected.project_on_nuisances(change)
        session = expected.session.T @ expected.session - expected.session_q.T @ expected.session_q
        session += np.diag(1.0 / np.square(evidence.session_sigma))
        shared = expected.session.T @ change - expected.session_q.T @ q
        distance = float(change @ change - q @ q - shared @ np.linalg.solve(session, shared))
        if distance > best[1]:
            best = (plan, distance)
    return Experiment(between=between, plan=best[0], expected_d2=best[1]) if best[0] else None
