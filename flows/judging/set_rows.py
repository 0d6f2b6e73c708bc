"""Figures of a set of edited videos, clip by clip, by the tasks of a protocol."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from catalogs.gates import load_foreign_gates
from catalogs.learned_judges import LoadedJudge
from catalogs.video_protocols import VideoProtocol
from flows.judging.evaluation_rows import figure_row
from flows.judging.foreign_sources import ForeignCamera, read_footage, read_video
from flows.judging.judged_clip import Row
from flows.judging.learned_rows import rank_weathers, score_pictures
from flows.judging.set_files import SOURCE, VIDEO_METHOD, SetClip, VideoSet
from tasks.errors import InputError
from tasks.eval.foreign_video import VideoClaim, judge_motion, sample_claim
from tasks.eval.poses.motion import RecoveredMotion
from tasks.eval.road_edit import score_road_edit
from tasks.eval.video_motion import (
    WINDOWS,
    geometry_error,
    motion_retention,
    path_error,
    resample_onto_grid,
    weather_error,
)

PIXELS = "pixels"
"""Method of figures that need no pose."""
MASK_LEVEL = 127
"""Grey level above which a pixel of a target's video is the target (paper, Appendix A.6)."""
LEARNED = ("dover_overall", "dover_technical", "dover_aesthetic", "fast_vqa")
ROAD_EDIT = ("localised_edit_rate", "temporal_iou", "anchor_error")
JUDGED = ("pitch_rmse_deg", "pitch_relative_error", "normalised_progress_rmse")

Key = tuple[str, str, str, str]


@dataclass(frozen=True, kw_only=True)
class SetMotion:
    """A clip of a set after it was looked at once.

    Parameters
    ----------
    clip : which
    times : of its frames [s]
    motion : recovered or read
    scores : of learned judges
    """

    clip: SetClip
    times: NDArray[np.float64]
    motion: RecoveredMotion
    scores: Mapping[str, float]


@dataclass(frozen=True, kw_only=True)
class JudgedSet:
    """A set whose clips were looked at.

    Parameters
    ----------
    protocol : by which it is judged
    files : of the set
    motions : by model, seed, clip and method
    claims : by clip
    judges : learned ones
    """

    protocol: VideoProtocol
    files: VideoSet
    motions: Mapping[Key, SetMotion]
    claims: Mapping[str, VideoClaim]
    judges: Mapping[str, LoadedJudge]

    def find(self, model: str, seed: str, clip: str, method: str) -> SetMotion | None:
        """Return a clip of a model, or of the source; None if it is not there."""
        return self.motions.get((model, seed, clip, method))


def look_at_clip(
    clip: SetClip, camera: ForeignCamera, judges: Mapping[str, LoadedJudge], kinds: Sequence[str]
) -> SetMotion:
    """Recover the motion of one clip, and score its pictures.

    Parameters
    ----------
    clip : of the set
    camera : that it was taken with
    judges : learned ones
    kinds : of weather that the protocol has

    Raises
    ------
    InputError
        If the file cannot be read.
    """
    footage = read_footage(clip.path)
    scored = footage.frames is not None and clip.clip.startswith("weather/")
    return SetMotion(
        clip=clip,
        times=footage.times,
        motion=footage.motion(camera),
        scores=score_pictures(footage.frames, judges, kinds) if scored and footage.frames is not None else {},
    )


def set_rows(judged: JudgedSet) -> Iterator[Row]:
    """Yield every figure of every model, with its model and seed; a missing one says why.

    Parameters
    ----------
    judged : set
    """
    for model in judged.files.models:
        for seed in judged.files.seeds(model):
            mine = [m for m in judged.motions.values() if (m.clip.model, m.clip.seed) == (model, seed)]
            methods = dict.fromkeys(m.clip.method for m in mine)
            for seen in mine:
                yield from _name_owner(claim_rows(judged, seen), model, seed)
                yield from _name_owner(clip_rows(judged, seen), model, seed)
            for method in methods:
                yield from _name_owner(retention_rows(judged, model, seed, method), model, seed)
            yield from _name_owner(edit_rows(judged, model, seed), model, seed)
            yield from _name_owner(learned_rows_of(judged, model, seed), model, seed)


def clip_rows(judged: JudgedSet, seen: SetMotion) -> Iterator[Row]:
    """E_weather and E_path of a weather clip, E_geometry of one with a road feature; nothing of any other."""
    task, _, name = seen.clip.clip.partition("/")
    if task == "weather" and name != judged.protocol.weather_control:
        yield from _weather_rows(judged, seen)
    if task == "geometry" and name != judged.protocol.geometry_control:
        claim = judged.claims.get(seen.clip.clip)

        def compute(window: int | None) -> tuple[float, float]:
            _need_motion(seen)
            if claim is None:
                raise InputError(f"not run: claims/{seen.clip.clip}.parquet is missing")
            meant = np.interp(seen.times, claim.time, claim.pitch, right=np.nan)
            opening = judged.protocol.event_opening.value
            return (
                geometry_error(seen.times, seen.motion.pitch, meant, opening, window),
                geometry_error(seen.times, meant, meant, opening, window),
            )

        yield from _windowed_rows(f"e_geometry_{name}", seen, compute)


def claim_rows(judged: JudgedSet, seen: SetMotion) -> Iterator[Row]:
    """Pitch and progress of a clip against its claim, where there is one."""
    claim = judged.claims.get(seen.clip.clip)
    if claim is None:
        return
    try:
        at = sample_claim(claim, seen.times)
        figures = judge_motion(_cut_motion(seen.motion, at.rows), at, load_foreign_gates())
        note = ""
    except InputError as fault:
        figures, note = dict.fromkeys(JUDGED), str(fault)
    for name in JUDGED:
        unit = "deg" if name.endswith("_deg") else "1"
        yield figure_row(
            name.removesuffix("_deg"), seen.clip.method, seen.clip.clip, figures[name], unit, note=note
        )


def retention_rows(judged: JudgedSet, model: str, seed: str, method: str) -> Iterator[Row]:
    """Source-motion retention of each preservation clip with a road event, against the source's pair."""
    protocol = judged.protocol
    first, last = (int(frame) for frame in protocol.retention_event.value)
    for weather in protocol.preservation_weathers:
        for event in protocol.preservation_events:
            names = [f"preservation/{weather}-{m}" for m in (event, protocol.preservation_motion)]
            found = [judged.find(SOURCE, "", name, method) for name in names]
            found += [judged.find(model, seed, name, method) for name in names]
            if found[2] is None:
                continue
            pair = [seen for seen in found if seen is not None]
            note, value = "", None
            lost = [seen for seen in pair if seen.motion.failed.any()]
            if len(pair) < 4:
                note = "not run: it needs the clip and its braking twin, of the source and of the model"
            elif lost:
                note = lost[0].motion.failures[0]
            elif len({len(seen.times) for seen in pair}) > 1 or last >= len(pair[0].times) - 2:
                note = f"not run: the four clips must have one number of frames, above {last + 2}"
            else:
                given, braking, edited, edited_braking = (seen.motion.pitch for seen in pair)
                value = motion_retention(given, braking, edited, edited_braking, (first, last))
            yield figure_row("motion_retention", method, names[0], value, "1", note=note)


def edit_rows(judged: JudgedSet, model: str, seed: str) -> Iterator[Row]:
    """Edit rate, T-IoU and anchor error of each feature video against the model's flat control."""
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


def _weather_rows(judged: JudgedSet, seen: SetMotion) -> Iterator[Row]:
    protocol, clip = judged.protocol, seen.clip
    name = f"weather/{protocol.weather_control}"
    own = judged.find(clip.model, clip.seed, name, clip.method)
    control = own or judged.find(SOURCE, "", name, clip.method)
    claims = [judged.claims.get(key) for key in (clip.clip, name)]
    steps = round(protocol.weather_duration.value / protocol.weather_interval.value)
    grid = np.linspace(0.0, steps * protocol.weather_interval.value, steps + 1)
    from_source = "" if own else "against the source's control: the model made none"

    def need_control() -> SetMotion:
        _need_motion(seen)
        if control is None:
            raise InputError(f"not run: {name} is missing, of the model and of the source")
        _need_motion(control)
        return control

    def compute(window: int | None) -> tuple[float, float]:
        other = need_control()
        if (meant := claims[0]) is None or (dry := claims[1]) is None:
            raise InputError(f"not run: claims of {clip.clip} and {name} are needed")
        way, dry_way = (
            resample_onto_grid(m.times, m.motion.normalised_path[:, 0], grid) for m in (seen, other)
        )
        station, dry_station = (resample_onto_grid(c.time, c.station, grid) for c in (meant, dry))
        return (
            weather_error(way, dry_way, station, dry_station, window),
            weather_error(station, dry_station, station, dry_station, window),
        )

    yield from _windowed_rows("e_weather", seen, compute, from_source)
    error, note = None, from_source
    try:
        error = path_error(seen.motion.normalised_path[:, :2], need_control().motion.normalised_path[:, :2])
    except InputError as fault:
        note = str(fault)
    yield figure_row("e_path", clip.method, clip.clip, error, "1", note=note, floor=0.0)


def _windowed_rows(
    metric: str, seen: SetMotion, compute: Callable[[int | None], tuple[float, float]], remark: str = ""
) -> Iterator[Row]:
    for window in WINDOWS:
        error, floor, note = None, None, remark
        try:
            error, floor = compute(window)
        except InputError as fault:
            note = str(fault)
        yield figure_row(
            metric, seen.clip.method, seen.clip.clip, error, "1", note=note, window=window, floor=floor
        )


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


def _cut_motion(motion: RecoveredMotion, rows: NDArray[np.int64]) -> RecoveredMotion:
    """Return the motion of the first frames, whose progress is normalised over them."""
    if len(rows) == len(motion.failed):
        return motion
    last = rows[-1]
    values = {
        name: getattr(motion, name)[rows] for name in vars(motion) if name not in ("method", "failures")
    }
    values["normalised_path"] = values["normalised_path"] / motion.normalised_path[last, 0]
    return RecoveredMotion(method=motion.method, failures=motion.failures, **values)


def _need_motion(seen: SetMotion) -> None:
    failed = int(seen.motion.failed.sum())
    if failed:
        raise InputError(f"{failed} of {len(seen.times)} frames without a pose; {seen.motion.failures[0]}")
    if not np.isfinite(seen.motion.normalised_path).all():
        raise InputError("the car does not move, and its progress cannot be normalised")


def _name_owner(rows: Iterator[Row], model: str, seed: str) -> Iterator[Row]:
    return ({"model": model, "seed": seed, **row} for row in rows)
