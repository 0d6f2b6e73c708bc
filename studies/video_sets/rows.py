"""Figures of a set of edited videos, clip by clip, by the tasks of a protocol."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from catalogs.entries import load
from studies.evaluation.judged_clip import Row
from studies.evaluation.metrics.foreign_video import judge_motion, sample_claim
from studies.evaluation.metrics.video_motion import (
    geometry_error,
    motion_retention,
    path_error,
    weather_error,
)
from studies.evaluation.rows import Scored, figure_row, windowed_rows
from studies.video_sets.compared_motion import (
    find_control_clip,
    pair_with_control,
    require_control_clip,
    sample_claimed_pitch,
)
from studies.video_sets.files import SOURCE
from studies.video_sets.motion import JudgedSet, SetMotion
from studies.video_sets.picture_rows import edit_rows, learned_rows_of
from tasks.errors import InputError
from tasks.eval.poses.motion import RecoveredMotion

JUDGED = ("pitch_rmse_deg", "pitch_relative_error", "normalised_progress_rmse")


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

        def compute(window: int | None) -> Scored:
            meant = sample_claimed_pitch(judged, seen)
            opening = judged.protocol.event_opening.value
            return (
                geometry_error(seen.times, seen.motion.pitch, meant, opening, window),
                geometry_error(seen.times, meant, meant, opening, window),
            )

        yield from windowed_rows(f"e_geometry_{name}", seen.clip.method, seen.clip.clip, compute)


def claim_rows(judged: JudgedSet, seen: SetMotion) -> Iterator[Row]:
    """Pitch and progress of a clip against its claim, where there is one."""
    claim = judged.claims.get(seen.clip.clip)
    if claim is None:
        return
    try:
        at = sample_claim(claim, seen.times)
        figures = judge_motion(_cut_motion(seen.motion, at.rows), at, load("foreign gate file"))
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
                try:
                    value = motion_retention(given, braking, edited, edited_braking, (first, last))
                except InputError as fault:
                    note = f"not run: {fault}"
            yield figure_row("motion_retention", method, names[0], value, "1", note=note)


def _weather_rows(judged: JudgedSet, seen: SetMotion) -> Iterator[Row]:
    clip, (control, own) = seen.clip, find_control_clip(judged, seen)
    from_source = "" if own or control is None else "against the source's control: the model made none"

    def compute(window: int | None) -> Scored:
        pair = pair_with_control(judged, seen)
        return (
            weather_error(pair.way, pair.dry_way, pair.station, pair.dry_station, window),
            weather_error(pair.station, pair.dry_station, pair.station, pair.dry_station, window),
        )

    yield from windowed_rows("e_weather", clip.method, clip.clip, compute, from_source)
    error, note = None, from_source
    try:
        other = require_control_clip(judged, seen)
        error = path_error(seen.motion.normalised_path[:, :2], other.motion.normalised_path[:, :2])
    except InputError as fault:
        note = str(fault)
    yield figure_row("e_path", clip.method, clip.clip, error, "1", note=note, floor=0.0)


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


def _name_owner(rows: Iterator[Row], model: str, seed: str) -> Iterator[Row]:
    return ({"model": model, "seed": seed, **row} for row in rows)
