"""Brake command, pressure over time, and the proportional ABS with its rate limit."""

from dataclasses import dataclass
from math import inf, isfinite
from typing import NamedTuple

from numba.extending import register_jitable

from tasks.errors import InputError


class PressureProfile(NamedTuple):
    """A brake command in the form that the kernels take; infinity stands for never.

    Parameters
    ----------
    peak : pressure after the ramp [MPa]
    ramp, hold, release : durations [s]
    onset_time : onset by time [s]
    onset_station : onset by the front axle's route position [m]
    """

    peak: float
    ramp: float
    hold: float
    release: float
    onset_time: float
    onset_station: float


@dataclass(frozen=True, kw_only=True)
class BrakeCommand:
    """Ramp, hold and release of the brake pressure (paper, Appendix B).

    Parameters
    ----------
    peak_pressure_mpa : pressure after the ramp; 0 coasts [MPa]
    ramp_s : rise time [s]
    onset_s : onset by time, or None [s]
    onset_station_m : onset by the front axle's route position, or None [m]
    hold_s : time at the peak, or None to hold to the end [s]
    release_s : fall time after the hold [s]

    Raises
    ------
    InputError
        For a negative or infinite value, or a braking command without exactly one onset.
    """

    peak_pressure_mpa: float
    ramp_s: float
    onset_s: float | None
    onset_station_m: float | None
    hold_s: float | None
    release_s: float

    def __post_init__(self) -> None:
        problems = []
        for name in ("peak_pressure_mpa", "ramp_s", "onset_s", "hold_s", "release_s"):
            value = getattr(self, name)
            if value is not None and not (isfinite(value) and value >= 0):
                problems.append(f"brake {name} must be a finite number of 0 or more; it is {value}")
        if self.onset_station_m is not None and not isfinite(self.onset_station_m):
            problems.append(f"brake onset_station_m must be a finite number; it is {self.onset_station_m}")
        if self.peak_pressure_mpa > 0 and (self.onset_s is None) == (self.onset_station_m is None):
            problems.append(
                "braking needs exactly one of onset_s and onset_station_m;"
                f" they are {self.onset_s} and {self.onset_station_m}"
            )
        if problems:
            raise InputError(problems)

    @property
    def profile(self) -> PressureProfile:
        """Return the command as numbers for the kernels; a command without pressure has no onset."""
        brakes = self.peak_pressure_mpa > 0
        return PressureProfile(
            peak=self.peak_pressure_mpa,
            ramp=self.ramp_s,
            hold=inf if self.hold_s is None else self.hold_s,
            release=self.release_s,
            onset_time=self.onset_s if brakes and self.onset_s is not None else inf,
            onset_station=self.onset_station_m if brakes and self.onset_station_m is not None else inf,
        )


@register_jitable(cache=True, forceinline=True)
def compute_brake_pressure(since_onset: float, profile: PressureProfile) -> float:
    """Return the commanded brake pressure p_b [MPa].

    Parameters
    ----------
    since_onset : time since the brake onset; negative before it [s]
    profile : brake command
    """
    if since_onset < 0.0:
        return 0.0
    if since_onset < profile.ramp:
        return profile.peak * since_onset / profile.ramp
    falling = since_onset - profile.ramp - profile.hold
    if falling <= 0.0:
        return profile.peak
    if falling >= profile.release:
        return 0.0
    return profile.peak * (1.0 - falling / profile.release)


@register_jitable(cache=True, forceinline=True)
def find_onset_by_position(time: float, station: float, speed: float, profile: PressureProfile) -> float:
    """Return the time of the brake onset once its position is passed, else infinity [s].

    The position is passed between two samples; the time of passing is that of the present speed.

    Parameters
    ----------
    time : time since the start of the run [s]
    station : route position of the front axle [m]
    speed : speed of the vehicle, v [m/s]
    profile : brake command
    """
    if station < profile.onset_station or speed <= 0.0:
        return inf
    return max(time - (station - profile.onset_station) / speed, 0.0)


@register_jitable(cache=True, forceinline=True)
def compute_abs_command(braking_slip: float, target_slip: float, release_width: float) -> float:
    """Return the share of the brake torque that the proportional ABS asks for, q_cmd [1] (paper, Eq. app_abs_command).

    Parameters
    ----------
    braking_slip : kappa [1]
    target_slip : kappa* [1]
    release_width : delta, relative to the target [1]
    """
    share = (target_slip * (1.0 + release_width) - braking_slip) / (release_width * target_slip)
    return min(max(share, 0.0), 1.0)


@register_jitable(cache=True, forceinline=True)
def limit_abs_rate(command: float, scale: float, build_step: float, release_step: float) -> float:
    """Return the ABS torque scale q after one step: the command within the rate limits [1] (paper, Appendix B).

    With limits of 1 or more a step this is the algebraic rule q = q_cmd exactly.

    Parameters
    ----------
    command : q_cmd, in [0, 1] [1]
    scale : q before the step [1]
    build_step, release_step : largest rise and fall within the step [1]
    """
    return min(max(command, scale - release_step), scale + build_step)
