"""Planned runs: the instructions to a test driver before anything is measured."""

from dataclasses import dataclass

import numpy as np

from tasks.campaign.campaign import CHANNELS, Run
from tasks.surface.weather import DRY, find_weather

INTERVAL = 0.01
"""Time between samples of a test bench [s]."""


@dataclass(frozen=True, kw_only=True)
class RunPlan:
    """One planned run.

    Parameters
    ----------
    weather, rate : weather and its rate [mm/h]
    speed : initial speed [m/s]
    peak : brake pressure after the ramp; negative pulses between it and 0.3 of it [MPa]
    duration : [s]
    disc_rise : [K]
    hazard : centre, length, height [m]
    """

    weather: str = DRY
    rate: float = 0.0
    speed: float
    peak: float
    duration: float = 6.0
    disc_rise: float = 20.0
    hazard: tuple[float, float, float] = (0.0, 0.0, 0.0)


GENTLE, SNOW_STOP, HARD, ABS_STOP = 1.4, 4.8, 5.7, 6.2
"""Decelerations that the brakes of planned runs would give if no tyre reached its limit [m/s2]."""


def plan_experiments(gain: float) -> tuple[tuple[str, RunPlan], ...]:
    """Return runs that any proving ground allows, each with its words, from which one separates two hypotheses.

    Parameters
    ----------
    gain : deceleration of the car per brake pressure [m/s2/MPa]
    """
    gentle, snow, hard, limit = (round(d / gain, 1) for d in (GENTLE, SNOW_STOP, HARD, ABS_STOP))
    return (
        ("coast down from 36 m/s for 12 s", RunPlan(speed=36.0, peak=0.0, duration=12.0)),
        ("coast down from 12 m/s for 12 s", RunPlan(speed=12.0, peak=0.0, duration=12.0)),
        (
            "hard stop from 33 m/s with cold discs",
            RunPlan(speed=33.0, peak=hard, duration=7.0),
        ),
        (
            "hard stop from 33 m/s with hot discs",
            RunPlan(speed=33.0, peak=hard, duration=7.0, disc_rise=350.0),
        ),
        ("gentle stop from 14 m/s", RunPlan(speed=14.0, peak=gentle, duration=9.0)),
        ("pulsed braking from 28 m/s", RunPlan(speed=28.0, peak=-hard, duration=7.0)),
        (
            "ABS stop from 22 m/s in rain of 10 mm/h",
            RunPlan(weather="rain", rate=10.0, speed=22.0, peak=limit),
        ),
        (
            "ABS stop from 14 m/s on snow",
            RunPlan(weather="snow", rate=2.0, speed=14.0, peak=snow),
        ),
        (
            "roll over a hump of 3.7 m and 75 mm at 11 m/s",
            RunPlan(speed=11.0, peak=0.0, duration=5.0, hazard=(15.0, 3.7, 0.075)),
        ),
    )


def make_planned_run(
    drive: RunPlan, name: str, direction: int = 1, *, held_out: bool = False, interval: float = INTERVAL
) -> Run:
    """Return the run of a plan, with its pressure trace and initial speed but no other response.

    Parameters
    ----------
    drive : the plan
    name : of the run
    direction : along (1) or against (-1) the route
    held_out : belongs to the runs that no fit may read
    interval : between samples [s]
    """
    count = round(drive.duration / interval)
    t = np.arange(count) * interval
    pressure = abs(drive.peak) * np.clip((t - 1.0) / 0.3, 0.0, 1.0)
    if drive.peak < 0:
        pressure *= np.where((t > 1.5) & (((t - 1.5) % 1.0) < 0.5), 0.3, 1.0)
    response = np.zeros((count, len(CHANNELS)))
    response[:, CHANNELS.index("speed")] = drive.speed
    hours = 1.0 if find_weather(drive.weather).accumulates else 0.0
    return Run(
        name=name, held_out=held_out, weather=drive.weather, precipitation_mm_h=drive.rate,
        snow_accumulation_h=hours, direction=direction, disc_rise=drive.disc_rise,
        hazard_center=drive.hazard[0], hazard_length=drive.hazard[1], hazard_height=drive.hazard[2],
        interval=interval, pressure=pressure, response=response,
    )  # fmt: skip
