"""What a verdict rests on: inputs and range of a log, and its faults that look exactly like a named effect."""

from collections.abc import Collection, Sequence
from math import sin

import numpy as np

from tasks.campaign.campaign import Campaign
from tasks.campaign.channels import BRAKE_SIGNALS, CHANNELS_BY_NAME, describe_brake
from tasks.identification.decision.answer import NamedEffect
from tasks.identification.inference.evidence import RunEvidence


def describe_log_faults(
    campaign: Campaign, named: Sequence[NamedEffect], rivals: Collection[str]
) -> list[str]:
    """Return a sentence for each fault that a named effect may be, and on a brake or throttle that rests above 0.

    Parameters
    ----------
    campaign : measured runs
    named : effects that are named
    rivals : names of effects that cannot be distinguished from them
    """
    names, sentences = {effect.name for effect in named}, []
    if "brake_dead_time" in names and "sensor_speed_delay" not in rivals:
        sentences.append(
            "brakes that answer late look the same as responses that are all logged late by one time: check that the"
            " brake signal and the others share a clock"
        )
    if "brake_fade" in names | set(rivals) and any(run.braking_heat for run in campaign.runs):
        hottest = max(run.disc_rise for run in campaign.runs)
        sentences.append(
            f"no disc temperature was measured: the runs begin up to {hottest:.0f} K above ambient by the braking"
            " before them, with discs of the model's heat capacity; a fade per 100 K is of these"
        )
    if any(run.felt_slope and run.road_slope is None for run in campaign.runs):
        slopes = [100.0 * sin(run.felt_slope) for run in campaign.runs]
        sentences.append(
            f"no slope of the road was mapped: by what the accelerometer reads beyond the rate of speed the runs are on"
            f" slopes of {min(slopes):.1f} to {max(slopes):.1f} %, each run on one, beside what all have in common"
        )
    if campaign.throttle_rest:
        sentences.append(
            f"the throttle rests at {campaign.throttle_rest:.3f} while the brake is applied: counted from there"
        )
    if campaign.brake_rest:
        signal = CHANNELS_BY_NAME[campaign.brake_signal]
        level = campaign.brake_rest / BRAKE_SIGNALS[signal.name]
        sentences.append(
            f"the {signal.name.replace('_', ' ')} rests at {level:.3f}{'' if signal.unit == '1' else f' {signal.unit}'}"
            " while the car does not brake, in all training runs alike: taken for its zero; brakes that need as much to"
            " begin would look the same"
        )
    elif campaign.resting_gauge:
        sentences.append(campaign.resting_gauge)
    return sentences


def describe_inputs(campaign: Campaign, train: Sequence[RunEvidence]) -> list[str]:
    """Return sentences on the inputs of a log, the channels that were compared, and how far the training runs reach.

    Parameters
    ----------
    campaign : measured runs
    train : training runs
    """
    brake = campaign.brake_signal.replace("_", " ")
    inputs = [brake]
    inputs += ["engine torque"] if any(run.drive_torque is not None for run in campaign.runs) else []
    inputs += ["throttle"] if any(run.throttle is not None for run in campaign.runs) else []
    inputs += ["road slope"] if any(run.road_slope is not None for run in campaign.runs) else []
    compared = [name.replace("_", " ") for name in campaign.channels]
    if any(run.speed_of_wheels for run in campaign.runs):
        compared[0] = "speed of the wheels"
    speed = np.concatenate([run.model.measured[:, 0] for run in train])
    pressure = max(float(run.model.pressure.max()) for run in train)
    sentences = [
        f"inputs that were measured: {', '.join(inputs)}; compared: {', '.join(compared)}",
        f"the training runs reach {speed.min():.3g} to {speed.max():.3g} m/s and"
        f" {describe_brake(pressure, campaign.brake_signal)}: beyond that nothing is claimed",
    ]
    if BRAKE_SIGNALS.get(campaign.brake_signal, 1.0) == 1.0:
        return sentences
    signal = CHANNELS_BY_NAME[campaign.brake_signal]
    unit = "" if signal.unit == "1" else f" {signal.unit}"
    stands_for = (
        f"a {brake} of 1{unit} is taken for {BRAKE_SIGNALS[signal.name]:g} MPa, and the gain is fitted"
    )
    return [stands_for, *sentences]
