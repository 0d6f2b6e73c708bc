"""A frame with traces of the vehicle's telemetry below it, up to the time of the frame."""

from collections.abc import Mapping
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

STRIP_HEIGHT = 84
"""Height of the traces below the picture [px]."""
_PAPER, _INK, _FAINT = (24, 26, 30), (235, 235, 235), (95, 98, 105)
_CAPTION = 14


@dataclass(frozen=True, kw_only=True)
class Trace:
    """One trace.

    Parameters
    ----------
    column : name of the telemetry column
    caption : what stands over it
    unit : of what is shown
    factor : shown value over the column's [unit over the column's unit]
    colour : RGB [1]
    """

    column: str
    caption: str
    unit: str
    factor: float
    colour: tuple[int, int, int]


TRACES = (
    Trace(column="speed", caption="speed", unit="km/h", factor=3.6, colour=(120, 180, 255)),
    Trace(column="braking_slip_f", caption="front slip", unit="", factor=1.0, colour=(255, 210, 110)),
    Trace(column="pitch", caption="pitch", unit="deg", factor=180 / np.pi, colour=(255, 140, 110)),
    Trace(column="axle_load_f", caption="front load", unit="kN", factor=1e-3, colour=(150, 220, 150)),
    Trace(column="brake_pressure_mpa", caption="brake", unit="MPa", factor=1.0, colour=(210, 160, 240)),
)


def add_traces(
    picture: NDArray[np.uint8], columns: Mapping[str, NDArray[np.float64]], frame: int
) -> NDArray[np.uint8]:
    """Return the picture over a strip with one small plot per trace, bright up to this frame and faint after it.

    Parameters
    ----------
    picture : uint8 [H, W, 3] sRGB
    columns : the clip's telemetry, one value a frame
    frame : the one that is shown

    Returns
    -------
    uint8 [H + STRIP_HEIGHT, W, 3]
    """
    width = picture.shape[1]
    strip = np.full((STRIP_HEIGHT, width, 3), _PAPER, np.uint8)
    for k, trace in enumerate(TRACES):
        left, right = k * width // len(TRACES) + 4, (k + 1) * width // len(TRACES) - 4
        values = trace.factor * columns[trace.column]
        _draw_plot(strip, trace, values, frame, left, right)
    return np.concatenate([picture, strip])


def _draw_plot(
    strip: NDArray[np.uint8], trace: Trace, values: NDArray[np.float64], frame: int, left: int, right: int
) -> None:
    low, high = min(float(values.min()), 0.0), float(values.max())
    high = high if high > low else low + 1.0
    top, bottom = 2 * _CAPTION + 2, STRIP_HEIGHT - 5
    x = np.linspace(left, right, len(values))
    y = bottom - (values - low) / (high - low) * (bottom - top)
    points = np.stack([x, y], axis=1).round().astype(np.int32)
    _draw_line(strip, points, _FAINT)
    _draw_line(strip, points[: frame + 1], trace.colour)
    cv2.circle(strip, tuple(points[frame].tolist()), 2, _INK, -1, cv2.LINE_AA)
    _write_text(strip, trace.caption, (left, _CAPTION - 2), trace.colour)
    _write_text(
        strip, f"{values[frame]:.{_decimal_places(high)}f} {trace.unit}", (left, 2 * _CAPTION - 2), _INK
    )


def _decimal_places(largest: float) -> int:
    return 0 if largest >= 20 else 1 if largest >= 2 else 2


def _draw_line(strip: NDArray[np.uint8], points: NDArray[np.int32], colour: tuple[int, int, int]) -> None:
    cv2.polylines(strip, [points], False, colour, 1, cv2.LINE_AA)


def _write_text(
    strip: NDArray[np.uint8], text: str, origin: tuple[int, int], colour: tuple[int, int, int]
) -> None:
    cv2.putText(strip, text, origin, cv2.FONT_HERSHEY_SIMPLEX, 0.36, colour, 1, cv2.LINE_AA)
