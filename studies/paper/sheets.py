"""Two sheets of stills: one place of each street in every weather; a road feature before, at and after contact."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flows.making.plan import read_plan
from flows.making.seal import PREVIEW_CLIPS, pick_evenly
from flows.reading.frames import Frames, open_frames
from flows.store.address import open_for_reading
from flows.store.outputs import Outputs
from flows.store.sealed import read_manifest, refuse_changed_clips, require_frames
from flows.store.telemetry import read_columns
from manifests.records import Manifest
from tasks.errors import InputError
from tasks.render.contact_sheet import draw_picture_sheet, encode_png

WEATHER_FIELDS = ("weather", "precipitation_mm_h", "snow_accumulation_h")
BEFORE_M, AFTER_M = 5.0, 1.0
"""Way from the front axle to a feature's start, and from its end to the axle, in the outer stills [m]."""

STATION_M = 12.0
"""Where the weathers are shown if nobody says so [m]."""

Picture = tuple[str, NDArray[np.uint8]]


def draw_sheets(
    dataset: str, out: str, *, station: float | None = None, beside: Sequence[str] | None = None
) -> dict[str, Any]:
    """Draw what a dataset's grid allows of the two sheets; further datasets add a row of their weathers each.

    Parameters
    ----------
    dataset : a finished dataset
    out : folder for weather.png and hazards.png
    station : where along the route the weathers are shown; None takes `STATION_M`, or as far as all clips come [m]
    beside : finished datasets of other streets

    Raises
    ------
    InputError
        A folder holds no finished dataset with frames, the first one's grid has neither two weathers nor a road
        feature, another's has one weather only, no clip comes to the station, or what is shown is not as recorded.
    """
    results = Outputs(out, "lab sheets", "weather.png", "hazards.png")
    (frames, manifest), *others = _open_finished([dataset, *(beside or ())])
    clips = manifest["clips"]
    features = pick_evenly([clip for clip in clips if clip["scenario"]["hazard_height_m"]], PREVIEW_CLIPS)
    hazards = [[clip, *[other for other in clips if is_flat_twin(other, clip)][:1]] for clip in features]
    weathers = [[(frames, clip) for clip in row] for row in pick_evenly(_list_weathers(clips), PREVIEW_CLIPS)]
    if not hazards and not weathers:
        raise InputError(f"{dataset}: must have two weathers of one drive, or a road feature; it has neither")
    for name, (street, record) in zip(beside or (), others, strict=True):
        more = _list_weathers(record["clips"])
        if not more:
            raise InputError(
                f"{name}: must have two weathers of one drive, to stand beside {dataset}; it has not"
            )
        weathers.append([(street, clip) for clip in more[0]])
    for street, record in [(frames, manifest), *others]:
        shown = [clip for row in weathers for at, clip in row if at is street]
        shown += [clip for row in hazards for clip in row] if street is frames else []
        refuse_changed_clips(street.layout, record, shown, "frames")
    place = _choose_station(station, [drive for row in weathers for drive in row])
    drawn = {
        "weather": [[_draw_still(*drive, place, drive[1]["label"]) for drive in row] for row in weathers],
        "hazards": [_draw_contact(frames, *row) for row in hazards],
    }
    written = {}
    for name, rows in drawn.items():
        if rows:
            file = f"{name}.png"
            results.write(file, encode_png(draw_picture_sheet(rows)))
            written[name] = str(results.path(file))
    return written


def _open_finished(datasets: Sequence[str]) -> list[tuple[Frames, Manifest]]:
    """Return the frames of each dataset with its manifest; every folder that holds none is reported."""
    layouts = [open_for_reading(dataset) for dataset in datasets]
    lacking = [name for name, layout in zip(datasets, layouts, strict=True) if not layout.manifest.is_file()]
    if lacking:
        raise InputError([f"{name}: must be a finished dataset; it has no manifest.json" for name in lacking])
    manifests = [read_manifest(layout) for layout in layouts]
    for name, manifest in zip(datasets, manifests, strict=True):
        require_frames(manifest, name)
    opened = [open_frames(layout, manifest) for layout, manifest in zip(layouts, manifests, strict=True)]
    return list(zip(opened, manifests, strict=True))


def _list_weathers(clips: Sequence[Mapping[str, Any]]) -> list[list[Mapping[str, Any]]]:
    """Return the clips of each drive that was made in two weathers or more."""
    groups: dict[tuple[Any, ...], list[Mapping[str, Any]]] = {}
    for clip in clips:
        rest = tuple(value for key, value in sorted(clip["scenario"].items()) if key not in WEATHER_FIELDS)
        groups.setdefault(rest, []).append(clip)
    return [row for row in groups.values() if len(row) > 1]


def _choose_station(asked: float | None, drives: Sequence[tuple[Frames, Mapping[str, Any]]]) -> float:
    """Return the station to show [m]: the one asked for, else `STATION_M` or as far as all clips come.

    Raises
    ------
    InputError
        If no clip comes to the one that is asked for.
    """
    ways = [_read_rows(frames, clip, ["station"])["station"] for frames, clip in drives]
    if asked is None:
        return float(min([STATION_M, *(way[-1] for way in ways)]))
    if ways and not any(way[0] <= asked <= way[-1] for way in ways):
        first, last = min(way[0] for way in ways), max(way[-1] for way in ways)
        raise InputError(
            f"--station must lie in {first:.1f} to {last:.1f} m, where a clip of the sheet has frames; it is {asked:g}"
        )
    return asked


def _read_rows(frames: Frames, clip: Mapping[str, Any], names: list[str]) -> dict[str, NDArray[Any]]:
    rows = read_plan(frames.layout.root).settings.frames
    return read_columns(frames.layout.telemetry / "frames", clip["clip_id"], names, most=rows)


def _draw_contact(frames: Frames, clip: Mapping[str, Any], *twin: Mapping[str, Any]) -> list[Picture]:
    """Before, at and after contact; beside them the place before contact on the flat twin, where there is one."""
    scenario = clip["scenario"]
    half, center = scenario["hazard_length_m"] / 2, scenario["hazard_center_m"]
    places = {clip["label"]: center - half - BEFORE_M, "contact": center, "after": center + half + AFTER_M}
    stills = [_draw_still(frames, clip, place, caption) for caption, place in places.items()]
    return stills + [_draw_still(frames, flat, center - half - BEFORE_M, flat["label"]) for flat in twin]


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


def _draw_still(frames: Frames, clip: Mapping[str, Any], station: float, caption: str) -> Picture:
    """The frame nearest to a station, and a caption with the body's pitch in it, and whether the car comes so far."""
    columns = _read_rows(frames, clip, ["station", "pitch"])
    frame = int(np.argmin(np.abs(columns["station"] - station)))
    pitch = np.rad2deg(columns["pitch"][frame])
    if columns["station"][-1] < station:
        caption = f"{caption}, not reached"
    still = frames.read_window(clip["index"], slice(frame, frame + 1), ["rgb"])["rgb"][0]
    return f"{caption}  {pitch:.2f} deg", still
