"""A figure's row, and which clip a clip is held against."""

import re
from collections.abc import Iterator
from typing import Any

import numpy as np

from catalogs.scenario import SCENARIO_FIELDS
from flows.judging.judged_clip import JudgedClip, Row
from tasks.surface.weather import DRY, WEATHERS


def figure_row(
    metric: str, method: str, condition: str, value: float | None, unit: str, *, note: str = "",
    window: int | None = None, floor: float | None = None, uncertainty: float | None = None,
    paper: float | None = None, averaged: int | None = None, seed_std: float | None = None,
) -> Row:  # fmt: skip
    """One figure of an evaluation; a missing one says why.

    Parameters
    ----------
    metric, method, condition : what was measured, by what, on what
    value : None or not finite where it is missing [unit]
    unit : of value, floor and uncertainty
    note : why a value is missing, or how to read it
    window : of the smoothing; None for none [frames]
    floor : what a perfect estimate scores [unit]
    uncertainty : standard [unit]
    paper : what the paper prints for the same clips [unit]
    averaged : how many figures it is a mean of; None for a single figure [1]
    seed_std : of a mean, sample standard deviation over visual seeds [unit]
    """
    finite = value is not None and np.isfinite(value)
    return {
        "metric": metric,
        "method": method,
        "condition": condition,
        "value": value if finite else None,
        "unit": unit,
        "paper": paper,
        "window": window or 0,
        "floor": floor,
        "uncertainty": uncertainty if uncertainty is not None and np.isfinite(uncertainty) else None,
        "note": note if finite or note else "not a number",
        "averaged": averaged,
        "seed_std": seed_std,
    }


def visual_seed(label: str) -> str:
    """The visual seed in a clip's label; empty in a dataset of one seed."""
    found = re.search(r"(?:^|/)seed-(\d+)$", label)
    return found[1] if found else ""


def control_of(clip: JudgedClip, clips: list[JudgedClip], *, weather: bool) -> JudgedClip | None:
    """The clip of one visual seed that differs in nothing but a dry sky, or a flat road; None if there is none.

    Parameters
    ----------
    clip : to be held against it
    clips : of the dataset
    weather : whether the sky or the road is the difference
    """
    free = {"weather", "precipitation_mm_h", "snow_accumulation_h"} if weather else {
        "hazard_center_m", "hazard_length_m", "hazard_height_m"
    }  # fmt: skip
    held = set(SCENARIO_FIELDS) - free
    seed = visual_seed(clip.facts["label"])
    for other in (c for c in clips if visual_seed(c.facts["label"]) == seed):
        plain = other.facts["weather"] == DRY if weather else other.facts["hazard_height_m"] == 0
        if plain and other is not clip and all(_same(clip.facts.get(k), other.facts.get(k)) for k in held):
            return None if weather and clip.facts["weather"] == DRY else other
    return None


def weather_families(clips: list[JudgedClip]) -> Iterator[tuple[str, str, list[JudgedClip]]]:
    """Clips of one drive in dry weather and at two rates or more of one kind: kind, condition and the clips, dry first.

    Parameters
    ----------
    clips : of the dataset
    """
    for control in (c for c in clips if c.facts["weather"] == DRY):
        for kind in WEATHERS:
            family = [
                c for c in clips if c.facts["weather"] == kind and control_of(c, [control], weather=True) is control
            ]  # fmt: skip
            levels = [control, *family]
            if len({c.facts["precipitation_mm_h"] for c in levels}) >= 3:
                yield kind, f"{kind}: {control.facts['label'].partition('/')[2] or 'all'}", levels


def _same(a: Any, b: Any) -> bool:
    return bool(a == b or (a != a and b != b))
