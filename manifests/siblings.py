"""Counterfactual pairs: clips of one dataset that differ in exactly one control, and the changes it causes."""

from array import array
from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations, pairwise
from math import nan
from typing import Any

import numpy as np

CONTROLS: dict[str, tuple[str, ...]] = {
    "weather": ("weather", "precipitation_mm_h", "snow_accumulation_h", "falling", "visual_range_m"),
    "light": ("sky", "sun_azimuth_deg", "sun_elevation_deg"),
    "speed": ("initial_speed_km_h",),
    "braking": (
        "peak_pressure_mpa",
        "ramp_s",
        "hold_s",
        "release_s",
        "brake_onset_s",
        "brake_onset_m",
        "hold_speed",
    ),
    "road": ("hazard_center_m", "hazard_length_m", "hazard_height_m"),
    "scene": ("scene",),
    "road users": ("objects",),
}
"""The scenario's fields by what an experimenter turns: q, u (speed and braking) and g of Eq. overall_pipeline."""
FIGURES = ("surface_friction", "tyre_peak", "stopping_distance", "peak_pitch")
ALL_PAIRS_UP_TO = 32
"""Larger groups of siblings pair each clip with the first and with the next, so that pairs stay as many as clips."""


def iterate_pairs(clips: Sequence[Mapping[str, Any]]) -> Iterator[dict[str, Any]]:
    """Yield every pair that differs in exactly one control, in the order of the dataset; visual seeds make no pair.

    Rows have the keys of ``PAIR_CHANNELS``; a change is b minus a, NaN where either has no such figure.

    Parameters
    ----------
    clips : records with ``clip_id``, ``label``, ``scenario`` and ``figures``
    """
    # indices in compact arrays: a million pairs as tuples would outweigh the clips
    first, second, turned = array("i"), array("i"), array("b")
    names = sorted(CONTROLS)
    for code, control in enumerate(names):
        for group in _group_clips(clips, control):
            for i, j in _choose_pairs(group):
                first.append(i)
                second.append(j)
                turned.append(code)
    for index in np.lexsort((np.asarray(turned), np.asarray(second), np.asarray(first))):
        a, b, control = clips[first[index]], clips[second[index]], names[turned[index]]
        if _list_differing(a, b, control):
            yield _make_pair(a, b, control)


def _group_clips(clips: Sequence[Mapping[str, Any]], control: str) -> Iterator[list[int]]:
    """Clips that are alike in all other controls."""
    others = [name for other, names in CONTROLS.items() if other != control for name in names]
    groups: dict[tuple[Any, ...], list[int]] = {}
    for index, clip in enumerate(clips):
        groups.setdefault(tuple(_read_control(clip, name) for name in others), []).append(index)
    yield from groups.values()


def _choose_pairs(group: Sequence[int]) -> list[tuple[int, int]]:
    if len(group) <= ALL_PAIRS_UP_TO:
        return list(combinations(group, 2))
    return sorted({(group[0], other) for other in group[1:]} | set(pairwise(group)))


def _list_differing(a: Mapping[str, Any], b: Mapping[str, Any], control: str) -> list[str]:
    return [name for name in CONTROLS[control] if _read_control(a, name) != _read_control(b, name)]


def _read_control(clip: Mapping[str, Any], name: str) -> Any:
    """Return the value of a field, as text where it is a list; None where the scenario has none."""
    value = clip["scenario"].get(name)
    return repr(value) if isinstance(value, list) else value


def _make_pair(a: Mapping[str, Any], b: Mapping[str, Any], control: str) -> dict[str, Any]:
    names = {
        "clip_id_a": a["clip_id"],
        "clip_id_b": b["clip_id"],
        "label_a": a["label"],
        "label_b": b["label"],
        "control": control,
        "differs": ", ".join(_list_differing(a, b, control)),
    }
    changes = {
        f"{name}_change": _compute_change(a["figures"].get(name), b["figures"].get(name)) for name in FIGURES
    }
    return names | changes


def _compute_change(a: float | None, b: float | None) -> float:
    return nan if a is None or b is None else float(b) - float(a)
