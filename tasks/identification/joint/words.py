"""Reasons of a joint verdict in plain words: on what it rests, and which run would tell more."""

from collections.abc import Sequence

import numpy as np

from tasks.campaign.campaign import CHANNELS, Campaign
from tasks.campaign.channels import BRAKE_SIGNALS, CHANNELS_BY_NAME
from tasks.identification.decision.answer import NamedEffect
from tasks.identification.inference.forward import RunModel
from tasks.identification.joint.calibration import has_few_runs
from tasks.identification.joint.numbers import JointNumber, coasts_down, saturates_tyres
from tasks.identification.joint.stops import Stop
from tasks.identification.rules import JointRules

SEPARATE = {
    "sensor": "log the speed by a second instrument",
    "resistance": "coast down from the highest speed to 5 m/s with the clutch open, and once in gear",
    "delay": "press the brake in steps from constant speed, logging at 100 Hz or more",
    "curve": "brake at three constant pressures from the same speed, below the limit of the tyres",
    "grip": "brake to the limit of the tyres on one wet road, from a high and from a low speed",
}
"""The run that tells numbers of one group apart."""

LEAST_DOUBT = 0.005
"""Standard deviation of a delay from which it is told that nobody knows when the driver lifts [s]."""


def tell_what_was_used(
    campaign: Campaign, train: Sequence[Stop], agreeing: tuple[int, int], rules: JointRules
) -> list[str]:
    """Return sentences on channels, inputs, range and stability.

    Parameters
    ----------
    campaign : measured runs
    train : those that were fitted
    agreeing : starts that reach the same fit, of all
    rules : of the joint fit
    """
    runs = campaign.runs
    inputs = [campaign.brake_signal.replace("_", " ")]
    inputs += ["engine torque"] if any(run.drive_torque is not None for run in runs) else []
    inputs += ["throttle"] if any(run.throttle is not None for run in runs) else []
    inputs += ["road slope"] if any(run.road_slope is not None for run in runs) else []
    speeds = np.concatenate([stop.model.measured[:, 0] for stop in train])
    pressure = max(float(stop.model.pressure.max()) for stop in train)
    seen = [CHANNELS[c].replace("_", " ") for c in train[0].channels]
    if any(run.speed_of_wheels for run in runs):
        seen[0] = "speed of the wheels"
    grip = (
        ""
        if any(saturates_tyres(stop.model, rules) for stop in train)
        else "; no run slowed down harder than the model's tyres allow"
    )
    stands_for = BRAKE_SIGNALS.get(campaign.brake_signal, 1.0)
    return [
        *(
            [
                f"a {inputs[0]} of {_tell_one(campaign.brake_signal)} is taken for {stands_for:g} MPa, and the gain is"
                " fitted"
            ]
            if stands_for != 1.0
            else []
        ),
        f"inputs that were measured: {', '.join(inputs)}; compared: {', '.join(seen)}",
        f"the training runs reach {speeds.min():.3g} to {speeds.max():.3g} m/s and {pressure:.3g} MPa{grip}: beyond"
        " that nothing is claimed",
        *(
            [
                f"the whole library of effects is searched from {rules.fewest_runs} training and {rules.fewest_runs}"
                f" held-out runs on; there are {len(campaign.train)} and {len(campaign.held_out)}"
            ]
            if has_few_runs(campaign, rules)
            else []
        ),
        f"{agreeing[0]} of {agreeing[1]} starts reach this fit"
        if agreeing[0]
        else f"of {agreeing[1]} further starts none reaches this fit, which explains more than theirs",
        "the held-out runs decide which numbers stay, so their error is not that of a blind test",
    ]


def _tell_one(brake_signal: str) -> str:
    """Return one of the unit of a signal that stands for the pressure: "1 N"; of a share "1" alone."""
    unit = CHANNELS_BY_NAME[brake_signal].unit
    return "1" if unit == "1" else f"1 {unit}"


def tell_rivals(
    effects: Sequence[NamedEffect], rivals: Sequence[tuple[str, NamedEffect]], shown: Sequence[JointNumber]
) -> list[str]:
    """Return a sentence for each rival: what these runs cannot tell apart, and the run that would.

    Parameters
    ----------
    effects : that are named
    rivals : of them, each with the name of the effect that it stands in for
    shown : numbers that the campaign can show
    """
    numbers = {n.name: n for n in shown}
    named = {effect.name: effect.parameters[0] for effect in effects}
    sentences = []
    for of, rival in rivals:
        one, other = named[of], rival.parameters[0]
        run = find_separating_run([numbers[one.name], numbers[other.name]])
        sentences.append(
            f"these runs cannot tell whether {numbers[one.name].say(one.value)} or"
            f" {numbers[other.name].say(other.value)}{'' if run is None else f': {run}'}"
        )
    return sentences


def tell_lumped_resistance(
    fitted: Sequence[JointNumber], models: Sequence[RunModel], rules: JointRules
) -> list[str]:
    """Return a sentence where one number stands for all resistance, because no run coasts down.

    Parameters
    ----------
    fitted : numbers that are left
    models : of the training runs
    rules : of the joint fit
    """
    lump = [n.name for n in fitted if n.group == "resistance"]
    if not lump or any(coasts_down(model, rules) for model in models):
        return []
    return [
        f"{lump[0]} stands for air, tyres and engine together, and its interval holds their sum alone: to tell them"
        f" apart, {SEPARATE['resistance']}"
    ]


def tell_guessed_lift(fitted: Sequence[JointNumber], doubt: float) -> list[str]:
    """Return a sentence where a delay is no surer than when the driver lifts, which no channel says.

    Parameters
    ----------
    fitted : numbers that are left
    doubt : standard deviation that this leaves a delay [s]
    """
    if doubt < LEAST_DOUBT or not any(n.group == "delay" for n in fitted):
        return []
    return [
        "no channel says when the driver lifts, which leaves a delay of the brakes a standard deviation of"
        f" {doubt:.2g} s: log the throttle or the engine's torque, or coast for a second before the brake"
    ]


def tell_unlogged_driver(train: Sequence[Stop]) -> list[str]:
    """Return a sentence where nobody knows what drove the car before the brake, for stops that are missed.

    Parameters
    ----------
    train : the training runs
    """
    if not any(stop.guesses_lift for stop in train):
        return []
    return [
        "no channel says what drove the car before the brake, or when the driver lifted, and the fit guesses it: log"
        " the throttle or the engine's torque, or coast for a second before the brake"
    ]


def find_separating_run(numbers: Sequence[JointNumber]) -> str | None:
    """Return the run that tells numbers apart, the first of `SEPARATE` for a group of theirs; None where none is known.

    Parameters
    ----------
    numbers : that these runs cannot tell apart
    """
    groups = {number.group for number in numbers}
    return next((run for group, run in SEPARATE.items() if group in groups), None)
