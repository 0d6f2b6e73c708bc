"""The pattern of a house front: windows, doors and shops as rows and columns of one bay."""

from enum import IntEnum


class Part(IntEnum):
    """Part of a house front that a row or a column of a bay shows.

    A cell shows the lesser of its row and its column, so that glass lies within its frame, the frame within
    its surround and the surround within the wall; a band or a sign runs over the whole width.
    """

    WALL = 0
    TRIM = 1
    FRAME = 2
    GLASS = 3
    BAND = 4
    SIGN = 5
    PLINTH = 6


BAYS = ("window", "shop", "door")
"""Kinds of bay."""
Pattern = list[tuple[float, Part]]
"""Widths, or heights from the bottom up, of the parts [m]."""

BAND_HEIGHT = 0.16
"""Of the string course at a floor [m]."""
SIGN_BOTTOM, SIGN_HEIGHT = 2.85, 0.5
"""Of a shop's name board above the pavement [m]."""
_PLINTH = 0.55


def window_columns(bay: float, width: float) -> Pattern:
    """Return the columns of a two-casement window [m] in the middle of a bay [m]."""
    pane = (width - 0.18) / 2
    pier = ((bay - width) / 2 - 0.13, Part.WALL)
    surround, frame = (0.13, Part.TRIM), (0.065, Part.FRAME)
    return [
        pier,
        surround,
        frame,
        (pane, Part.GLASS),
        (0.05, Part.FRAME),
        (pane, Part.GLASS),
        frame,
        surround,
        pier,
    ]


def window_rows(storey_height: float, sill: float, height: float, *, banded: bool) -> Pattern:
    """Return the rows of a window [m] over its sill [m], below a wall up to the next floor [m]."""
    low, high = 0.66 * (height - 0.17), 0.34 * (height - 0.17)
    foot = (BAND_HEIGHT, Part.BAND if banded else Part.WALL)
    rows = [
        foot,
        (sill - BAND_HEIGHT - 0.1, Part.WALL),
        (0.1, Part.TRIM),
        *_glaze_opening(low, high),
        (0.17, Part.TRIM),
    ]
    return _fill_with_wall(rows, storey_height)


def ground_window_rows(storey_height: float, height: float) -> Pattern:
    """Return the rows of a ground-floor window [m] over a plinth, below a wall up to the next floor [m]."""
    low, high = 0.66 * (height - 0.17), 0.34 * (height - 0.17)
    rows = [
        (_PLINTH, Part.PLINTH),
        (0.5, Part.WALL),
        (0.1, Part.TRIM),
        *_glaze_opening(low, high),
        (0.2, Part.TRIM),
    ]
    return _fill_with_wall(rows, storey_height)


def shop_columns(bay: float) -> Pattern:
    """Return the columns of shop windows from pier to pier of a bay [m]."""
    pane = (bay - 0.6) / 2
    pier, frame = (0.2, Part.WALL), (0.075, Part.FRAME)
    return [pier, frame, (pane, Part.GLASS), (0.05, Part.FRAME), (pane, Part.GLASS), frame, pier]


def shop_rows(storey_height: float) -> Pattern:
    """Return the rows of a shop window over a low stall riser, a name board and wall up to the next floor [m]."""
    rows = [
        (0.4, Part.PLINTH),
        (0.07, Part.FRAME),
        (2.3, Part.GLASS),
        (0.08, Part.FRAME),
        (SIGN_HEIGHT, Part.SIGN),
    ]
    return _fill_with_wall(rows, storey_height)


def door_columns(bay: float) -> Pattern:
    """Return the columns of a double door in the middle of a bay [m]."""
    pier = ((bay - 1.66) / 2, Part.WALL)
    surround, frame, leaf = (0.16, Part.TRIM), (0.08, Part.FRAME), (0.57, Part.GLASS)
    return [pier, surround, frame, leaf, (0.04, Part.FRAME), leaf, frame, surround, pier]


def door_rows(storey_height: float) -> Pattern:
    """Return the rows of door leaves, the light above them and wall up to the next floor [m]."""
    rows = [
        (DOOR_HEIGHT, Part.GLASS),
        (0.07, Part.FRAME),
        (0.45, Part.GLASS),
        (0.07, Part.FRAME),
        (0.22, Part.TRIM),
    ]
    return _fill_with_wall(rows, storey_height)


DOOR_HEIGHT = 2.2
"""Height of the door leaves, which are wood where the pattern has glass [m]."""


def _glaze_opening(low: float, high: float) -> Pattern:
    frame = (0.06, Part.FRAME)
    return [frame, (low, Part.GLASS), (0.05, Part.FRAME), (high, Part.GLASS), frame]


def _fill_with_wall(rows: Pattern, total: float) -> Pattern:
    return [*rows, (total - sum(height for height, _ in rows), Part.WALL)]


def bay_patterns(
    height: float, bay: float, window: tuple[float, float]
) -> dict[str, tuple[Pattern, Pattern]]:
    """Return columns and rows of every kind of ground-floor bay.

    Parameters
    ----------
    height : of the ground storey [m]
    bay : width of the bay [m]
    window : width and height of the house's windows [m]
    """
    return {
        "shop": (shop_columns(bay), shop_rows(height)),
        "door": (door_columns(bay), door_rows(height)),
        "window": (window_columns(bay, window[0]), ground_window_rows(height, window[1])),
    }


def storey_pattern(
    height: float, bay: float, window: tuple[float, float], *, banded: bool
) -> tuple[Pattern, Pattern]:
    """Return columns and rows of an upper storey's bay, as `bay_patterns`; ``banded``: with a string course."""
    return window_columns(bay, window[0]), window_rows(height, 0.95, window[1], banded=banded)


def drop_thin_parts(pattern: Pattern, least: float) -> Pattern:
    """Return the pattern without parts thinner than ``least`` [m]; their neighbours share their width."""
    kept = [(size, part) for size, part in pattern if size >= least]
    stretch = sum(size for size, _ in pattern) / sum(size for size, _ in kept)
    return [(size * stretch, part) for size, part in kept]
