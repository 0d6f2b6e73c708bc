"""Two sheets of stills: the same place in every weather; a road feature before, at and after contact, and its twin."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flows.making.seal import PREVIEW_CLIPS, pick_evenly
from flows.store.address import open_for_reading
from flows.store.frames import read_clip
from flows.store.layout import Layout
from flows.store.outputs import Outputs
from flows.store.sealed import read_manifest
from flows.store.telemetry import read_columns
from tasks.errors import InputError
from tasks.render.contact_sheet import draw_picture_sheet, encode_png

WEATHER_FIELDS = ("weather", "precipitation_mm_h", "snow_accumulation_h")
BEFORE_M, AFTER_M = 5.0, 1.0
"""Way from the front axle to a feature's start, and from its end to the axle, in the outer stills [m]."""

Picture = tuple[str, NDArray[np.uint8]]


def draw_sheets(dataset: str, out: str, *, station: float = 12.0) -> dict[str, Any]:
    """Draw what a dataset's grid allows of the two sheets.

    Parameters
    ----------
    dataset : a finished dataset
    out : folder for weather.png and hazards.png
    station : where along the route the weathers are shown [m]

    Raises
    ------
    InputError
        The folder holds no finished dataset, or its grid has neither two weathers nor a road feature.
    """
    results = Outputs(out, "sheets", "weather.png", "hazards.png")
    layout = open_for_reading(dataset)
    if not layout.manifest.is_file():
        raise InputError(f"{dataset}: must be a finished dataset; it has no manifest.json")
    clips = read_manifest(layout)["clips"]
    weathers = [row for row in _by_everything_but_weather(clips) if len(row) > 1]
    hazards = pick_evenly([clip for clip in clips if clip["scenario"]["hazard_height_m"]], PREVIEW_CLIPS)
    drawn = {
        "weather": [
            [_draw_still(layout, clip, station, clip["label"]) for clip in row]
            for row in pick_evenly(weathers, PREVIEW_CLIPS)
        ],
        "hazards": [_draw_contact(layout, clip, clips) for clip in hazards],
    }
    if not any(drawn.values()):
        raise InputError(f"{dataset}: must have two weathers of one drive, or a road feature; it has neither")
    written = {}
    for name, rows in drawn.items():
        if rows:
            file = f"{name}.png"
            results.write(file, encode_png(draw_picture_sheet(rows)))
            written[name] = str(results.path(file))
    return written


def _by_everything_but_weather(clips: Sequence[Mapping[str, Any]]) -> list[list[Mapping[str, Any]]]:
    groups: dict[tuple[Any, ...], list[Mapping[str, Any]]] = {}
    for clip in clips:
        rest = tuple(value for key, value in sorted(clip["scenario"].items()) if key not in WEATHER_FIELDS)
        groups.setdefault(rest, []).append(clip)
    return list(groups.values())


def _draw_contact(
    layout: Layout, clip: Mapping[str, Any], clips: Sequence[Mapping[str, Any]]
) -> list[Picture]:
    """Before, at and after contact; beside them the place before contact on the flat twin, where there is one."""
    scenario = clip["scenario"]
    half, center = scenario["hazard_length_m"] / 2, scenario["hazard_center_m"]
    places = {clip["label"]: center - half - BEFORE_M, "contact": center, "after": center + half + AFTER_M}
    stills = [_draw_still(layout, clip, place, caption) for caption, place in places.items()]
    twins = [other for other in clips if is_flat_twin(other, clip)]
    return stills + [_draw_still(layout, twin, center - half - BEFORE_M, twin["label"]) for twin in twins[:1]]


def is_flat_twin(other: Mapping[str, Any], clip: Mapping[str, Any]) -> bool:
    """Whether a clip is another's flat control: the same drive, weather and seed, without the road feature.

    Parameters
    ----------
    other, clip : rows of a manifest's ``clips``
    """
    same = all(
        other["scenario"][key] == value
        for key, value in clip["scenario"].items()
        if not key.startswith("hazard_")
    )
    return same and other["seed"] == clip["seed"] and not other["scenario"]["hazard_height_m"]


def _draw_still(layout: Layout, clip: Mapping[str, Any], station: float, caption: str) -> Picture:
    """The frame nearest to a station, and a caption with the body's pitch in it."""
    columns = read_columns(layout.telemetry / "frames", clip["clip_id"], ["station", "pitch"])
    frame = int(np.argmin(np.abs(columns["station"] - station)))
    pitch = np.rad2deg(columns["pitch"][frame])
    return f"{caption}  {pitch:.2f} deg", read_clip(layout.frames, clip["index"], "rgb")[frame]
