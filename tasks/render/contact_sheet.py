"""A contact sheet: one row per clip, one column per time, with speed and pitch curves beside the pictures."""

from collections.abc import Mapping, Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

TILE_WIDTH, CURVE_WIDTH, MARGIN, CAPTION = 300, 240, 6, 20
INK, FAINT, PAPER = (40, 40, 40), (200, 200, 200), 250
FONT = (cv2.FONT_HERSHEY_SIMPLEX, 0.38, 1)
"""Face, scale, thickness."""
CURVE_COLOURS = {"speed": (30, 90, 200), "pitch": (200, 70, 20)}

Row = tuple[str, Sequence[NDArray[np.uint8]], Mapping[str, NDArray[np.float64]]]


def draw_contact_sheet(rows: Sequence[Row], frames: Sequence[int], frame_rate_hz: float) -> NDArray[np.uint8]:
    """Draw the sheet.

    Parameters
    ----------
    rows : label, pictures uint8 [H, W, 3] at ``frames``, and curves by name (speed [m/s], pitch [rad]) per frame
    frames : frame numbers of the columns; the first column has the row's label in place of its time
    frame_rate_hz : [Hz]

    Returns
    -------
    uint8 [H, W, 3] RGB
    """
    height, width = rows[0][1][0].shape[:2]
    tile = (TILE_WIDTH, round(TILE_WIDTH * height / width))
    step_x, step_y = tile[0] + MARGIN, tile[1] + MARGIN + CAPTION
    sheet = np.full(
        (len(rows) * step_y + MARGIN, len(frames) * step_x + CURVE_WIDTH + 2 * MARGIN, 3), PAPER, np.uint8
    )
    limits = {name: _curve_limits([row[2][name] for row in rows]) for name in CURVE_COLOURS}
    for i, (label, pictures, curves) in enumerate(rows):
        top = i * step_y + MARGIN
        for j, (frame, picture) in enumerate(zip(frames, pictures, strict=True)):
            left = j * step_x + MARGIN
            small = cv2.resize(picture, tile, interpolation=cv2.INTER_AREA)
            sheet[top + CAPTION : top + CAPTION + tile[1], left : left + tile[0]] = small
            caption = label if j == 0 else f"{frame / frame_rate_hz:.1f} s"
            # a label may be longer than its picture is wide: times stand at the right
            shift = 0 if j == 0 else tile[0] - cv2.getTextSize(caption, *FONT)[0][0]
            _put_text(sheet, caption, (left + shift, top + CAPTION - 6))
        left = len(frames) * step_x + MARGIN
        box = sheet[top + CAPTION : top + CAPTION + tile[1], left : left + CURVE_WIDTH]
        _draw_curves(box, curves, limits)
        for part, (name, colour) in enumerate(CURVE_COLOURS.items()):
            origin = (left + part * CURVE_WIDTH // len(CURVE_COLOURS), top + CAPTION - 6)
            _put_text(sheet, _legend_text(name, limits[name]), origin, colour)
    return sheet


def draw_picture_sheet(rows: Sequence[Sequence[tuple[str, NDArray[np.uint8]]]]) -> NDArray[np.uint8]:
    """Draw captioned pictures in rows.

    Parameters
    ----------
    rows : caption and picture uint8 [H, W, 3] of each column; rows may be of different length

    Returns
    -------
    uint8 [H, W, 3] RGB
    """
    height, width = rows[0][0][1].shape[:2]
    tile = (TILE_WIDTH, round(TILE_WIDTH * height / width))
    step_x, step_y = tile[0] + MARGIN, tile[1] + MARGIN + CAPTION
    columns = max(len(row) for row in rows)
    sheet = np.full((len(rows) * step_y + MARGIN, columns * step_x + MARGIN, 3), PAPER, np.uint8)
    for i, row in enumerate(rows):
        for j, (caption, picture) in enumerate(row):
            top, left = i * step_y + MARGIN, j * step_x + MARGIN
            small = cv2.resize(picture, tile, interpolation=cv2.INTER_AREA)
            sheet[top + CAPTION : top + CAPTION + tile[1], left : left + tile[0]] = small
            _put_text(sheet, caption, (left, top + CAPTION - 6))
    return sheet


def encode_png(picture: NDArray[np.uint8]) -> bytes:
    """Return the PNG bytes of an RGB picture."""
    done, content = cv2.imencode(".png", picture[..., ::-1])
    assert done
    return content.tobytes()


def _curve_limits(curves: list[NDArray[np.float64]]) -> tuple[float, float]:
    low, high = min(c.min() for c in curves), max(c.max() for c in curves)
    return float(low), float(high) if high > low else float(low) + 1.0


def _legend_text(name: str, limits: tuple[float, float]) -> str:
    if name == "speed":
        return f"speed 0-{limits[1] * 3.6:.0f} km/h"
    return f"pitch {np.degrees(limits[0]):.1f}..{np.degrees(limits[1]):.1f} deg"


def _draw_curves(
    box: NDArray[np.uint8],
    curves: Mapping[str, NDArray[np.float64]],
    limits: Mapping[str, tuple[float, float]],
) -> None:
    height, width = box.shape[:2]
    canvas = np.ascontiguousarray(box)
    cv2.rectangle(canvas, (0, 0), (width - 1, height - 1), FAINT)
    for name, colour in CURVE_COLOURS.items():
        low, high = limits[name] if name == "pitch" else (0.0, limits[name][1])
        x = np.linspace(2, width - 3, len(curves[name]))
        y = (height - 4) * (1 - (curves[name] - low) / (high - low)) + 2
        cv2.polylines(
            canvas, [np.stack([x, y], axis=1).round().astype(np.int32)], False, colour, 1, cv2.LINE_AA
        )
    box[:] = canvas


def _put_text(
    sheet: NDArray[np.uint8], text: str, origin: tuple[int, int], colour: tuple[int, int, int] = INK
) -> None:
    face, scale, thickness = FONT
    cv2.putText(sheet, text, origin, face, scale, colour, thickness, cv2.LINE_AA)
