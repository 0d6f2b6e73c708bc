"""A number that a joint fit may move, and which of them a campaign can show."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tasks.campaign.campaign import CHANNELS, SESSION, Campaign
from tasks.identification.inference.forward import RunModel, simulate_run
from tasks.identification.rules import JointRules
from tasks.vehicle.effects.library import Effect
from tasks.vehicle.effects.table import build_parameter_vector
from tasks.vehicle.parameters import compute_surface_response

GAIN = "pressure_gain"
FRICTION = "friction"
ROAD = "road"
"""Group of what is common to the slopes of all runs, where an accelerometer told them."""
GRIP = "grip"
"""Group of what makes the tyres' limit depend on how they are driven."""
CALIBRATED = ("gain", FRICTION, "radius", ROAD)
"""Groups of numbers that re-tuning moves."""
AT_BOUND = 0.005
"""Share of its range within which a number lies at an end of it [1]."""
WEAKEST = -0.9
"""Change of the brake gain below which no brakes are left [1]."""
SMOOTHED = 0.3
"""Time over which a deceleration is averaged before its peak is taken [s]."""


@dataclass(frozen=True, kw_only=True)
class JointNumber:
    """A number of the table of effects with the prior of a car that is hardly known.

    Parameters
    ----------
    name : of the table of effects
    sigma : of the prior about the vehicle file's value [unit of the table]
    lower, upper : where the fit must stay [unit of the table]
    group : numbers of one group stand in for each other on few runs
    removable : must earn its place
    needs : channels of which one must be measured
    effect : of the library, whose first number it is
    of_pressure : sigma is a share of the largest brake pressure of the training runs
    of_grade : sigma and bounds are in tolerances that the campaign gives for the slope of its road
    free_with : channels without any of which it is never free, but may explain the runs in the place of another number
    stands_in : it is never free, or none of those was measured
    weather : kind of weather on which alone it acts
    """

    name: str
    sigma: float
    lower: float
    upper: float
    group: str
    removable: bool
    needs: tuple[str, ...]
    effect: Effect
    of_pressure: bool = False
    of_grade: bool = False
    free_with: tuple[str, ...] = ()
    stands_in: bool = False
    weather: str | None = None

    @property
    def may_go(self) -> bool:
        """Whether it is taken away at a bound or where prediction contradicts it: other physics may stand behind it."""
        return self.removable or self.group == ROAD

    def is_at_bound(self, value: float) -> bool:
        """Whether a value lies where the fit had to stop, other than at the vehicle file's.

        Parameters
        ----------
        value : of a fit [unit of the table]
        """
        near = AT_BOUND * (self.upper - self.lower)
        return any(end != 0.0 and abs(value - end) < near for end in (self.lower, self.upper))

    def say(self, value: float) -> str:
        """Return the finding in plain words.

        Parameters
        ----------
        value : that was found [unit of the table]
        """
        return self.effect.say({self.name: value})


def choose_numbers(
    numbers: Sequence[JointNumber], campaign: Campaign, models: Sequence[RunModel], rules: JointRules
) -> tuple[JointNumber, ...]:
    """Return the numbers that the channels and manoeuvres of a campaign can show.

    Parameters
    ----------
    numbers : of the catalogue
    campaign : measured runs
    models : of its training runs
    rules : of the joint fit
    """
    chosen = []
    engine = any(run.drive_torque is not None for run in campaign.runs)
    known = {*campaign.channels, *(["drive_torque"] if engine else [])}
    weakest = find_weakest_gain(campaign)
    stops = sum(shows_brake_curve(model, rules) for model in models)
    for number in numbers:
        if not any(need in campaign.channels for need in number.needs):
            continue
        if (
            number.name == "fade"
            and np.ptp([run.disc_rise for run in campaign.train]) < rules.least_disc_range
        ):
            continue  # discs of one temperature show no fade
        if number.group == "curve" and stops < rules.fewest_curve_stops:
            continue  # one stop gives a gain and a delay, and no curve
        if number.group in (FRICTION, GRIP) and not any(
            saturates_tyres(model, rules) or (weakest is not None and reaches_limit(model, rules, weakest))
            for model in _find_runs_on(number, numbers, models)
        ):
            continue
        if number.group == ROAD and not any(
            run.felt_slope and run.road_slope is None for run in campaign.train
        ):
            continue  # flat, or the map knows its slopes
        if number.of_grade:
            doubt = campaign.tolerances.session[SESSION.index("slope")]
            number = replace(
                number, sigma=doubt * number.sigma, lower=doubt * number.lower, upper=doubt * number.upper,
                of_grade=False,
            )  # fmt: skip
        if number.of_pressure:
            largest = max(float(model.pressure.max()) for model in models)
            number = replace(
                number, sigma=number.sigma * max(largest, rules.least_pressure_range), of_pressure=False
            )
        chosen.append(
            replace(
                number,
                stands_in=number.stands_in or (bool(number.free_with) and known.isdisjoint(number.free_with)),
            )
        )
    return tuple(chosen)


def free_numbers(
    shown: Sequence[JointNumber], models: Sequence[RunModel], rules: JointRules
) -> list[tuple[JointNumber, ...]]:
    """Return the sets of numbers that a fit may move together; others only stand in for one of them.

    A late speed and a late brake look the same where no accelerometer was measured, and a lag and a dead time are one
    delay until a log is quick enough to tell them apart. Resistances are one lump until a car has coasted down: there
    is a set for each of them, because a lump of the wrong shape makes other numbers wrong. Air drag that stands for an
    electric motor's drag at 8 m/s leaves a bent brake curve.

    Parameters
    ----------
    shown : that the campaign can show
    models : of its training runs
    rules : of the joint fit
    """
    late = [n for n in shown if n.group == "delay" and not n.stands_in]
    other_delays = set(late[1:]) if models[0].run.interval > rules.delay_interval else set()
    free = tuple(n for n in shown if not n.stands_in and n not in other_delays)
    resistances = [n for n in free if n.group == "resistance"]
    if len(resistances) < 2 or any(coasts_down(model, rules) for model in models):
        return [free]
    return [tuple(n for n in free if n is one or n not in resistances) for one in resistances]


def coasts_down(model: RunModel, rules: JointRules) -> bool:
    """Whether a run loses speed without brake and throttle, over so wide a range that resistances differ.

    Parameters
    ----------
    model : the run
    rules : of the joint fit
    """
    run, speed = model.run, model.measured[:, CHANNELS.index("speed")]
    driven = run.throttle is not None and bool(np.max(run.throttle[: model.samples]) > rules.closed_throttle)
    lost = float(speed[0] - speed[-1]) > rules.coasted_share * float(speed[0])
    return not model.pressure.any() and not driven and lost


def shows_brake_curve(model: RunModel, rules: JointRules) -> bool:
    """Whether a run brakes hard enough to show something of the brake's curve.

    Parameters
    ----------
    model : the run
    rules : of the joint fit
    """
    return measure_peak_deceleration(model) > rules.braking_deceleration


def _find_runs_on(
    number: JointNumber, numbers: Sequence[JointNumber], models: Sequence[RunModel]
) -> list[RunModel]:
    """Return the runs that tell a number of the tyres' limit: those of its weather, and of what no other stands for.

    Runs of one kind of weather alone tell the friction that is common to all.
    """
    kinds = {model.run.weather for model in models}
    own = {n.weather for n in numbers if n.weather is not None} if len(kinds) > 1 else set()
    if number.weather is None:
        return [model for model in models if model.run.weather not in own]
    if number.group == FRICTION and number.weather not in own:
        return []
    return [model for model in models if model.run.weather == number.weather]


def find_weakest_gain(campaign: Campaign) -> float | None:
    """Return by how much the brakes may be weaker than the file's [1]; None where a signal is no pressure of its own.

    Parameters
    ----------
    campaign : measured runs with their tolerances
    """
    tolerance = campaign.tolerances.session[SESSION.index(GAIN)]
    return max(-tolerance, WEAKEST) if campaign.brake_signal == "brake_pressure" else None


def reaches_limit(model: RunModel, rules: JointRules, gain: float) -> bool:
    """Whether the front wheels of the vehicle file come to the limit of their tyres for some time in a run.

    Parameters
    ----------
    model : the run
    rules : of the joint fit
    gain : of the brakes beside the file's [1]
    """
    scale = simulate_run(model, build_parameter_vector({GAIN: gain})).column("abs_scale_f")
    return bool(np.sum(scale < 1.0) * model.run.interval > rules.limited_time)


def saturates_tyres(model: RunModel, rules: JointRules) -> bool:
    """Whether a run decelerates harder than the tyres of the model allow.

    Parameters
    ----------
    model : the run
    rules : of the joint fit
    """
    tyre = compute_surface_response(model.vehicle, model.run.weather, model.surface_friction).tyre
    return measure_peak_deceleration(model) > rules.saturation_ratio * tyre.peak * model.vehicle.gravity


def measure_peak_deceleration(model: RunModel) -> float:
    """Return the largest measured decrease of speed over a short time [m/s2].

    Parameters
    ----------
    model : the run
    """
    speed = model.measured[:, CHANNELS.index("speed")]
    lag = max(round(SMOOTHED / model.run.interval), 1)
    if len(speed) <= lag:
        return 0.0
    return float(np.max(speed[:-lag] - speed[lag:])) / (lag * model.run.interval)
