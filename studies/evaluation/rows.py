"""Rows of figures, and the clip with which a clip is compared."""

import re
from collections.abc import Callable, Iterator
from typing import Any, TypedDict, Unpack

import numpy as np

from catalogs.scenario import OPTIONAL_FIELDS, SCENARIO_FIELDS
from studies.evaluation.judged_clip import JudgedClip, Row
from studies.evaluation.metrics.video_motion import WINDOWS
from tasks.errors import InputError
from tasks.surface.weather import DRY, WEATHERS

Scored = tuple[float | None, float]
"""A figure and its floor."""


class FigureDetails(TypedDict, total=False):
    """Further columns of a figure; each may be left out.

    Parameters
    ----------
    note : why a value is missing, or how to read it
    window : of the smoothing; None for none [frames]
    floor : score of a perfect estimate [unit]
    uncertainty : standard uncertainty of the value [unit]
    paper : figure that the paper prints for the same clips [unit]
    averaged : number of figures of which it is the mean; None for a single figure [1]
    seed_std : of a mean, sample standard deviation over visual seeds [unit]
    """

    note: str
    window: int | None
    floor: float | None
    uncertainty: float | None
    paper: float | None
    averaged: int | None
    seed_std: float | None


def figure_row(
    metric: str,
    method: str,
    condition: str,
    value: float | None,
    unit: str,
    **details: Unpack[FigureDetails],
) -> Row:
    """Return one figure of an evaluation; a missing one says why.

    Parameters
    ----------
    metric, method, condition : what was measured, by what, on what
    value : None or not finite where it is missing [unit]
    unit : of value, floor and uncertainty
    details : as of `FigureDetails`
    """
    note, uncertainty = details.get("note", ""), details.get("uncertainty")
    finite = value is not None and np.isfinite(value)
    return {
        "metric": metric,
        "method": method,
        "condition": condition,
        "value": value if finite else None,
        "unit": unit,
        "paper": details.get("paper"),
        "window": details.get("window") or 0,
        "floor": details.get("floor"),
        "uncertainty": uncertainty if uncertainty is not None and np.isfinite(uncertainty) else None,
        "note": note if finite or note else "not a number",
        "averaged": details.get("averaged"),
        "seed_std": details.get("seed_std"),
    }


def windowed_rows(
    metric: str, method: str, condition: str, compute: Callable[[int | None], Scored], note: str = ""
) -> Iterator[Row]:
    """Return a figure [1] at every width of smoothing, beside what a perfect pose would score.

    Parameters
    ----------
    metric, method, condition : as of `figure_row`
    compute : value and floor at a width [frames]; the value is None where a pose is missing
    note : why it is missing, or how to read it; what `compute` raises as `InputError` takes its place
    """
    for window in WINDOWS:
        value, floor, said = None, None, note
        try:
            value, floor = compute(window)
        except InputError as fault:
            said = str(fault)
        yield figure_row(metric, method, condition, value, "1", note=said, window=window, floor=floor)


def read_visual_seed(label: str) -> str:
    """The visual seed in a clip's label; empty in a dataset of one seed."""
    found = re.search(r"(?:^|/)seed-(\d+)$", label)
    return found[1] if found else ""


def find_control(clip: JudgedClip, clips: list[JudgedClip], *, weather: bool) -> JudgedClip | None:
    """Return the clip of the same visual seed that differs only by a dry sky, or by a flat road; None if there is none.

    Parameters
    ----------
    clip : to be held against it
    clips : of the dataset
    weather : whether the sky or the road is the difference
    """
    free = {"weather", "precipitation_mm_h", "snow_accumulation_h", "falling"} if weather else {
        "hazard_center_m", "hazard_length_m", "hazard_height_m"
    }  # fmt: skip
    held = {*SCENARIO_FIELDS, *OPTIONAL_FIELDS} - free
    seed = read_visual_seed(clip.facts["label"])
    for other in (c for c in clips if read_visual_seed(c.facts["label"]) == seed):
        plain = other.facts["weather"] == DRY if weather else other.facts["hazard_height_m"] == 0
        if (
            plain
            and other is not clip
            and all(_are_equal(clip.facts.get(k), other.facts.get(k)) for k in held)
        ):
            return None if weather and clip.facts["weather"] == DRY else other
    return None


def group_weather_families(clips: list[JudgedClip]) -> Iterator[tuple[str, str, list[JudgedClip]]]:
    """Clips of one drive in dry weather and at two rates or more of one kind: kind, condition and the clips, dry first.

    Parameters
    ----------
    clips : of the dataset
    """
    for control in (c for c in clips if c.facts["weather"] == DRY):
        for kind in WEATHERS:
            family = [
                c for c in clips if c.facts["weather"] == kind and find_control(c, [control], weather=True) is control
            ]  # fmt: skip
            levels = [control, *family]
            if len({c.facts["precipitation_mm_h"] for c in levels}) >= 3:
                yield kind, f"{kind}: {control.facts['label'].partition('/')[2] or 'all'}", levels


def _are_equal(a: Any, b: Any) -> bool:
    return bool(a == b or (a != a and b != b))
