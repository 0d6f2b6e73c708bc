"""A clip of a set brought beside its control and its claim: progress on the common grid, pitch at the clip's frames."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studies.video_sets.files import SOURCE
from studies.video_sets.motion import JudgedSet, SetMotion, check_motion
from tasks.errors import InputError

Floats = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class WeatherPair:
    """A weather clip and its dry control on the grid of the protocol.

    Parameters
    ----------
    grid : float64 [N] [s]
    way, dry_way : float64 [N] recovered, in any unit
    station, dry_station : float64 [N] claimed [m]
    """

    grid: Floats
    way: Floats
    dry_way: Floats
    station: Floats
    dry_station: Floats


def find_control_clip(judged: JudgedSet, seen: SetMotion) -> tuple[SetMotion | None, bool]:
    """Return the dry control of a weather clip, and whether it is the model's own; else the source's, if any.

    Parameters
    ----------
    judged : set
    seen : weather clip
    """
    clip, name = seen.clip, _name_control(judged)
    own = judged.find(clip.model, clip.seed, name, clip.method)
    return own or judged.find(SOURCE, "", name, clip.method), own is not None


def require_control_clip(judged: JudgedSet, seen: SetMotion) -> SetMotion:
    """Return the dry control of a weather clip, both with a pose in every frame.

    Parameters
    ----------
    judged : set
    seen : weather clip

    Raises
    ------
    InputError
        If there is none, or a frame of either has no pose.
    """
    check_motion(seen)
    control, _ = find_control_clip(judged, seen)
    if control is None:
        raise InputError(f"not run: {_name_control(judged)} is missing, of the model and of the source")
    check_motion(control)
    return control


def resample_onto_grid(times: Floats, values: Floats, grid: Floats) -> Floats:
    """Return a recovered coordinate at the times of the common grid, linear between frames.

    Parameters
    ----------
    times : [F] rising from 0 [s]
    values : [F] [any]
    grid : [N] rising from 0 [s]

    Raises
    ------
    InputError
        If the video ends before the grid does, by more than half a frame.
    """
    slack = 0.5 * float(np.median(np.diff(times)))
    if times[-1] < grid[-1] - slack:
        raise InputError(f"The video ends at {times[-1]:.2f} s; the protocol judges it to {grid[-1]:.2f} s.")
    return np.interp(grid, times, values)


def pair_with_control(judged: JudgedSet, seen: SetMotion) -> WeatherPair:
    """Return a weather clip and its control on the protocol's grid (paper, Appendix A.5).

    Parameters
    ----------
    judged : set
    seen : weather clip

    Raises
    ------
    InputError
        If a clip, a pose or a claim is missing, or a video ends before the grid does.
    """
    protocol, control = judged.protocol, require_control_clip(judged, seen)
    meant, dry = (judged.claims.get(name) for name in (seen.clip.clip, _name_control(judged)))
    if meant is None or dry is None:
        raise InputError(f"not run: claims of {seen.clip.clip} and {_name_control(judged)} are needed")
    steps = round(protocol.weather_duration.value / protocol.weather_interval.value)
    grid = np.linspace(0.0, steps * protocol.weather_interval.value, steps + 1)
    way, dry_way = (
        resample_onto_grid(m.times, m.motion.normalised_path[:, 0], grid) for m in (seen, control)
    )
    station, dry_station = (resample_onto_grid(c.time, c.station, grid) for c in (meant, dry))
    return WeatherPair(grid=grid, way=way, dry_way=dry_way, station=station, dry_station=dry_station)


def sample_claimed_pitch(judged: JudgedSet, seen: SetMotion) -> Floats:
    """Return the claimed pitch of a clip at its frames, NaN after the claim ends, float64 [F] [rad].

    Parameters
    ----------
    judged : set
    seen : clip with a road feature

    Raises
    ------
    InputError
        If the clip has no claim, or a frame has no pose.
    """
    check_motion(seen)
    claim = judged.claims.get(seen.clip.clip)
    if claim is None:
        raise InputError(f"not run: claims/{seen.clip.clip}.parquet is missing")
    return np.interp(seen.times, claim.time, claim.pitch, right=np.nan)


def _name_control(judged: JudgedSet) -> str:
    return f"weather/{judged.protocol.weather_control}"
