"""Motion metrics of a video against a reference trajectory (paper, Appendix A.5 and A.6), one function a step.

The paper does not print its smoothing window. A window that smooths the estimate alone is itself an error, so each
metric takes the window as an argument, and the same metric of a perfect estimate is its floor.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import savgol_filter

from tasks.errors import InputError
from tasks.eval.body_agreement import rms
from tasks.eval.poses.rigid import Floats

WINDOWS: tuple[int | None, ...] = (None, 5, 7, 9)
"""Smoothing windows for which figures are reported [frames]."""
PAPER_OPENING = 2.2
"""When the paper's event window opens (Appendix A.5) [s]: 2.2 to 3.8 s holds 25 frames at 16 and 17 at 10 a second."""

ORDER, GRID = 2, 101
"""Of the Savitzky-Golay polynomial, and samples of the common progress grid of the path error [1]."""
LEAST_RESPONSE = 1e-9
"""Pitch below which two clips are one [rad]: what rounding leaves of a difference of equal angles."""


@dataclass(frozen=True, kw_only=True)
class MotionProtocol:
    """Fixed choices of Appendix A.5, but for the opening of the event window, which the caller gives.

    Parameters
    ----------
    event : event window from its opening [s]
    before, after : flanking intervals of the local baseline, from the same opening [s]
    """

    event: tuple[float, float] = (0.0, 1.6)
    before: tuple[float, float] = (-0.5, -0.05)
    after: tuple[float, float] = (1.65, 2.1)


def smooth_signal(values: Floats, window: int | None) -> Floats:
    """Smooth by Savitzky and Golay what is known; without a window return a copy.

    Parameters
    ----------
    values : [F] NaN where they are not known: before or after, and not within, those that are [any]
    window : odd, above `ORDER`, None for no smoothing [frames]

    Raises
    ------
    InputError
        If fewer frames are known than the window holds.
    """
    smoothed = values.copy()
    if window is None:
        return smoothed
    known = np.isfinite(values)
    if known.sum() < window:
        raise InputError(f"A smoothing window of {window} frames needs as many; known are {known.sum()}.")
    smoothed[known] = savgol_filter(values[known], window, ORDER)
    return smoothed


def normalised_progress(forward: Floats, window: int | None) -> Floats:
    """Return a monocular forward coordinate as braking progress in [0, 1].

    It is smoothed, given the sign with which it ends ahead, min-max normalised, smoothed again, made monotone by its
    running maximum, and clipped.

    Parameters
    ----------
    forward : [F] recovered forward coordinate on the common frame grid, any scale and sign [1]
    window : of the smoothing [frames]

    Raises
    ------
    InputError
        If the car does not move.
    """
    x = smooth_signal(forward, window)
    x = x * (1.0 if x[-1] >= x[0] else -1.0)
    if not np.ptp(x) > 0:
        raise InputError("Progress cannot be normalised: the recovered car does not move.")
    x = smooth_signal((x - x.min()) / np.ptp(x), window)
    return np.clip(np.maximum.accumulate(x), 0.0, 1.0)


def reference_progress(station: Floats) -> Floats:
    """Return the reference station, shifted to start at zero and divided by its maximum.

    Parameters
    ----------
    station : [F] at the frame times [m]
    """
    way = station - station[0]
    return way / way.max()


def weather_error(
    forward: Floats, control_forward: Floats, station: Floats, control_station: Floats, window: int | None
) -> float:
    """E_weather: RMSE of the change of normalised progress against the dry control [1].

    Parameters
    ----------
    forward, control_forward : [F] recovered, of the condition and of its dry control [any]
    station, control_station : [F] the reference's, at the same times [m]
    window : smoothing of the recovered coordinates [frames]
    """
    seen = compare_progress(forward, control_forward, window)
    return rms(seen - (reference_progress(station) - reference_progress(control_station)))


def compare_progress(forward: Floats, control_forward: Floats, window: int | None) -> Floats:
    """Return the change of normalised progress from the dry control [1].

    Parameters
    ----------
    forward, control_forward, window : as in `weather_error`
    """
    return normalised_progress(forward, window) - normalised_progress(control_forward, window)


def isolate_event(
    times: Floats, pitch: Floats, opening: float, protocol: MotionProtocol
) -> tuple[Floats, NDArray[np.bool_]]:
    """Return the pitch less the line through the flanks of the event window, and which frames lie in it, [F].

    Parameters
    ----------
    times : [F] [s]
    pitch : [F] [rad]
    opening : when the event window opens [s]
    protocol : windows and flanks

    Raises
    ------
    InputError
        If the clip does not hold the window and both flanks.
    """
    since = times - opening

    def in_span(span: tuple[float, float]) -> NDArray[np.bool_]:
        return (since >= span[0] - 1e-9) & (since <= span[1] + 1e-9)

    before, after, event = in_span(protocol.before), in_span(protocol.after), in_span(protocol.event)
    used = before | after | event
    if not np.isfinite(pitch[used]).all():
        known = times[np.isfinite(pitch)].max(initial=0.0)
        raise InputError(
            f"The event window opens at {opening:.2f} s; the pitch must be known from"
            f" {opening + protocol.before[0]:.2f} to {opening + protocol.after[1]:.2f} s and is to {known:.2f} s."
        )
    if before.sum() < 2 or after.sum() < 2 or event.sum() < 3:
        raise InputError(
            f"The event window opens at {opening:.2f} s; the clip must hold"
            f" {opening + protocol.before[0]:.2f} to {opening + protocol.after[1]:.2f} s and ends at {times[-1]:.2f} s."
        )
    flanks = before | after
    slope, level = np.polyfit(since[flanks], pitch[flanks], 1)
    return pitch - (level + slope * since), event


def event_response(times: Floats, pitch: Floats, opening: float, protocol: MotionProtocol) -> Floats:
    """Return the pitch in the event window less the line through its two flanks, [N] in the unit of `pitch`.

    Parameters
    ----------
    times, pitch, opening, protocol : as in `isolate_event`
    """
    response, event = isolate_event(times, pitch, opening, protocol)
    return response[event]


def geometry_error(
    times: Floats, pitch: Floats, reference: Floats, opening: float, window: int | None
) -> float:
    """E_geometry: RMSE of the event's pitch over the RMS of the reference's; 1 without any response [1].

    The baseline is taken from both, so that a perfect estimate scores 0 without smoothing; the reference is
    neither smoothed nor shifted.

    Parameters
    ----------
    times : [F] [s]
    pitch, reference : [F] recovered and reference pitch, one sign convention [rad]
    opening : when the event window opens [s]
    window : smoothing of the recovered pitch [frames]
    """
    chosen = MotionProtocol()
    meant = event_response(times, reference, opening, chosen)
    seen = event_response(times, smooth_signal(pitch, window), opening, chosen)
    return rms(seen - meant) / rms(meant)


def path_error(path: Floats, control: Floats) -> float:
    """E_path: RMS difference of normalised lateral coordinates on a common grid of normalised progress [1].

    Parameters
    ----------
    path, control : [F, 2] forward and lateral coordinate of a clip and of its dry control, any scale [1]
    """
    u = np.linspace(0.0, 1.0, GRID)
    lateral = []
    for track in (path, control):
        way = np.maximum.accumulate(track[:, 0] - track[0, 0])
        extent = way[-1]
        moved = np.concatenate([[True], np.diff(way) > 0])
        lateral.append(np.interp(u, way[moved] / extent, (track[moved, 1] - track[0, 1]) / extent))
    return rms(lateral[0] - lateral[1])


def motion_retention(
    source: Floats, source_braking: Floats, edited: Floats, edited_braking: Floats,
    event: tuple[int, int] = (16, 42),
) -> float:  # fmt: skip
    """Absolute correlation of the road event's pitch in an editor's input and output [1].

    The matching braking pitch is subtracted from each, and the line through the frames outside the event.

    Parameters
    ----------
    source, edited : [F] pitch recovered from input and output [rad]
    source_braking, edited_braking : [F] the same of the flat-road braking clips [rad]
    event : first and last frame of the event [1]

    Raises
    ------
    InputError
        If the pitch of a pair of clips does not differ in the event, so that there is nothing to correlate.
    """
    inside = slice(event[0], event[1] + 1)
    curves = []
    for pitch, braking in ((source, source_braking), (edited, edited_braking)):
        change = pitch - braking
        frame = np.arange(len(change))
        outside = (frame < event[0]) | (frame > event[1])
        curves.append((change - np.polyval(np.polyfit(frame[outside], change[outside], 1), frame))[inside])
    flat = [
        f"The {name} clips must differ in pitch in the event; they do not: give the drive over the road feature and the"
        " one that brakes on the flat road."
        for name, curve in zip(("source", "edited"), curves, strict=True)
        if np.ptp(curve) < LEAST_RESPONSE
    ]
    if flat:
        raise InputError(flat)
    return float(abs(np.corrcoef(curves[0], curves[1])[0, 1]))
