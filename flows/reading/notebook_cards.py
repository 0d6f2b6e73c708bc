"""How a notebook shows a dataset and a clip: small pictures and the figures in which they differ from others."""

from collections.abc import Mapping, Sequence
from math import degrees
from typing import TYPE_CHECKING, Any

from catalogs.sentences import shorten
from catalogs.variants import warn_of_variant
from flows.pages.writer import Part, Picture, encode_picture, write_card
from manifests.manifest import describe_scenes
from tasks.errors import InputError

if TYPE_CHECKING:
    from flows.reading.clips import Clip
    from flows.reading.opening import Dataset

THUMBNAIL_WIDTH = 160
"""Of a picture in a card [px]; as JPEG it takes some 5 kB, which a saved notebook holds."""
MOST_PICTURES = 6


def dataset_card(data: "Dataset") -> str:
    """Return HTML with a picture of each kind of weather, counts, and the range of the stopping distances."""
    clips, grid = data.manifest["clips"], data.manifest["grid"]
    first: dict[str, Mapping[str, Any]] = {}
    for clip in clips:
        first.setdefault(clip["scenario"]["weather"], clip)
    stops = [clip["figures"].get("stopping_distance") for clip in clips]
    stops = [stop for stop in stops if stop is not None]
    counts = {kind: sum(clip["scenario"]["weather"] == kind for clip in clips) for kind in first}
    failed = sum(clip["verdict"]["passed"] is False for clip in clips)
    pictures, fault = _draw_pictures(data, list(first.values())[:MOST_PICTURES])
    rows = [
        ("clips", f"{len(clips)}, of {grid['frames']} frames at {grid['frame_rate_hz']:g} Hz"),
        ("frames", fault or f"{len(clips) * grid['frames']}"),
        ("weather", ", ".join(f"{kind} ({count})" for kind, count in counts.items())),
        ("stopping distance", _format_range(stops, len(clips))),
        ("in quarantine", f"{failed} clips, whose pose check failed" if failed else "no clip"),
        ("scene", describe_scenes(data.manifest)),
        ("vehicle", f"{grid['vehicle']}, {grid['vehicle_mode']} mode"),
        *([("warning", warning)] if (warning := warn_of_variant(grid.get("variant", "full"))) else []),
        ("run", data.manifest["run_id"]),
    ]
    return write_card(f"muSync dataset {grid['name']}: {data.place}", [*pictures, dict(rows)])


def clip_card(clip: "Clip") -> str:
    """Return HTML with the clip's middle frame and its figures."""
    scenario, figures = clip.record["scenario"], clip.figures
    pictures, fault = _draw_pictures(clip.dataset, [clip.record])
    rows = [
        ("weather", f"{scenario['weather']}, {scenario['precipitation_mm_h']:g} mm/h"),
        ("initial speed", f"{scenario['initial_speed_km_h']:g} km/h"),
        ("surface friction", _format_figure(figures.get("surface_friction"), "{:.3f}")),
        ("stopping distance", _format_figure(figures.get("stopping_distance"), "{:.1f} m", none="no stop in the clip")),
        ("largest nose-down pitch", _format_figure(figures.get("peak_pitch"), "{:.2f} deg", degrees(1))),
        ("pose check", _name_verdict(clip.record["verdict"])),
        ("clip id", clip.clip_id),
        *([("frames", fault)] if fault else []),
    ]  # fmt: skip
    return write_card(clip.label, [*pictures, dict(rows)])


def _name_verdict(verdict: Mapping[str, Any]) -> str:
    if verdict["passed"] is None:
        return "none" if verdict["method"] is None else "not judged: it sees too little"
    return "passed" if verdict["passed"] else "failed: in quarantine"


def _format_figure(value: float | None, form: str, factor: float = 1.0, none: str = "not represented") -> str:
    return none if value is None else form.format(value * factor)


def _format_range(stops: Sequence[float], clips: int) -> str:
    if not stops:
        return "no clip stops"
    return f"{min(stops):.1f} to {max(stops):.1f} m ({len(stops)} of {clips} clips stop)"


def _draw_pictures(data: "Dataset", rows: Sequence[Mapping[str, Any]]) -> tuple[list[Part], str | None]:
    """Return the middle frame of each clip; without frames none, and the reason."""
    try:
        pictures = [
            Picture(
                caption=row["label"],
                sources=[encode_picture(data[row["label"]].picture(), THUMBNAIL_WIDTH)],
            )
            for row in rows
        ]
    except InputError as error:
        # a card is shown unasked: a fault of the pictures must not hide the figures
        return [], shorten("; ".join(error.problems))
    return [pictures], None
