"""Figures of a set of edited videos that need its pictures and no pose: road edits, and learned judges."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cv2

from studies.evaluation.judged_clip import Row
from studies.evaluation.learned_rows import rank_weathers
from studies.evaluation.metrics.road_edit import score_road_edit
from studies.evaluation.rows import figure_row
from studies.foreign_video.sources import read_video
from studies.video_sets.files import VIDEO_METHOD
from studies.video_sets.motion import JudgedSet
from tasks.errors import InputError

PIXELS = "pixels"
"""Method of figures that need no pose."""
MASK_LEVEL = 127
"""Grey level above which a pixel of a target's video is the target (paper, Appendix A.6)."""
LEARNED = ("dover_overall", "dover_technical", "dover_aesthetic", "fast_vqa")
ROAD_EDIT = ("localised_edit_rate", "temporal_iou", "anchor_error", "edit_outside")


def edit_rows(judged: JudgedSet, model: str, seed: str) -> Iterator[Row]:
    """Edit rate, T-IoU, anchor error and share outside of each feature video against the model's flat control."""
    protocol = judged.protocol
    flat = judged.find(model, seed, f"geometry/{protocol.geometry_control}", VIDEO_METHOD)
    for feature in protocol.geometry_features:
        seen = judged.find(model, seed, f"geometry/{feature}", VIDEO_METHOD)
        if seen is None:
            continue
        target, score, note = judged.files.targets.get(feature), None, ""
        if flat is None or target is None:
            note = f"not run: it needs geometry/{protocol.geometry_control} and targets/{feature}.mp4"
        else:
            try:
                score = score_road_edit(*_read_edit(seen.clip.path, flat.clip.path, target))
                note = "the target is never seen" if score is None else f"{score.active_frames} frames"
            except InputError as fault:
                note = str(fault)
        for name in ROAD_EDIT:
            value = None if score is None else getattr(score, name)
            yield figure_row(name, PIXELS, f"geometry/{feature}", value, "1", note=note)


def learned_rows_of(judged: JudgedSet, model: str, seed: str) -> Iterator[Row]:
    """Scores of learned judges of each weather clip, and CLIP's order of each kind of weather."""
    protocol = judged.protocol
    names = (protocol.weather_control, *protocol.weather_levels)
    clips = {name: judged.find(model, seed, f"weather/{name}", VIDEO_METHOD) for name in names}
    scores = {name: seen.scores for name, seen in clips.items() if seen is not None}
    if not scores:
        return
    missing = {name: judge.note for name, judge in judged.judges.items() if judge.network is None}
    for metric in LEARNED:
        note = missing.get("dover" if metric.startswith("dover") else metric, "")
        for name, given in scores.items():
            yield figure_row(metric, PIXELS, f"weather/{name}", given.get(metric), "1", note=note)
    control = scores.get(protocol.weather_control, {})
    for kind in dict.fromkeys(level.weather for level in protocol.weather_levels.values()):
        levels = {n: x.precipitation_mm_h for n, x in protocol.weather_levels.items() if x.weather == kind}
        for name in (name for name in levels if name in scores):
            value = scores[name].get("temporal_lpips")
            plain = control.get("temporal_lpips")
            excess = None if value is None or plain is None else value - plain
            note = missing.get("lpips", "")
            yield figure_row(f"temporal_lpips_{kind}", PIXELS, f"weather/{name}", value, "1", note=note)
            yield figure_row(
                f"temporal_lpips_excess_{kind}", PIXELS, f"weather/{name}", excess, "1", note=note
            )
        rates = {protocol.weather_control: 0.0, **levels}
        given = {
            name: scores[name][f"clip_{kind}"] for name in rates if f"clip_{kind}" in scores.get(name, {})
        }
        note = missing.get("clip", "")
        if not note and len(given) < len(rates):
            note = f"not run: {', '.join(sorted(rates.keys() - given.keys()))} are missing"
        rho, rising = (None, None) if note else rank_weathers(rates, given)
        yield figure_row(f"clip_rho_{kind}", PIXELS, kind, rho, "1", note=note)
        yield figure_row(f"clip_adjacent_{kind}", PIXELS, kind, rising, "1", note=note)


def _read_edit(feature: Path, flat: Path, target: Path) -> tuple[list[Any], list[Any], list[Any]]:
    """Frames of a feature video and of its control, and the target's masks at their size."""
    shown, control, mask = (read_video(path)[0] for path in (feature, flat, target))
    if not len(shown) == len(control) == len(mask) or shown.shape != control.shape:
        raise InputError(
            f"not run: feature, control and target must have one size and number of frames; they have"
            f" {shown.shape[:3]}, {control.shape[:3]} and {mask.shape[:3]}"
        )
    size = shown.shape[2], shown.shape[1]
    masks = [cv2.resize(frame[..., 0], size, interpolation=cv2.INTER_NEAREST) > MASK_LEVEL for frame in mask]
    return list(shown), list(control), masks
