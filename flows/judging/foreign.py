"""Verdicts on any video or trajectory, without a renderer's data: against a claim, or against an editor's input."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from catalogs.entries import load
from flows.judging.claims import read_claim
from flows.judging.foreign_sources import read_camera, read_footage
from flows.store.outputs import Outputs
from tasks.errors import InputError
from tasks.eval.foreign_video import judge_motion, sample_claim
from tasks.eval.video_motion import motion_retention

NEEDS_DEPTH = (
    "pose by photometric alignment",
    "pose by points with depth",
    "progress in metres",
    "heave in metres",
)


def judge_video(
    video: str, *, claim: str, camera: str, out: str | None = None, metric: bool = False
) -> dict[str, Any]:
    """Compare a video's ego motion, by the essential chain, or a trajectory with the telemetry claimed for it.

    Parameters
    ----------
    video : any file that FFmpeg reads, or a trajectory in the TUM format (.txt, .tum)
    claim : Parquet with pitch [rad] and station [m] (or speed [m/s]) over t_ns or time [s]
    camera : YAML with focal_length, width and height, or with fx, fy, cx, cy, width and height [px]; where it has
        k1, k2, p1, p2 or k3 [1], lens distortion as OpenCV writes it, the frames are undistorted first
    out : folder for judgement.json
    metric : whether a trajectory's lengths are metres

    Raises
    ------
    InputError
        Every file that cannot be read, in one sentence each.
    """
    results = Outputs(out, "lab judge", "judgement.json")
    footage, told, lens = _read_all((read_footage, video), (read_claim, claim), (read_camera, camera))
    at = sample_claim(told, footage.times)
    recovered = footage.motion(lens, at.rows, metric=metric)
    verdict = judge_motion(recovered, at, load("foreign gate file"))
    times, is_video = footage.times, footage.frames is not None
    result = {
        "video": footage.name,
        "frames": len(times),
        "judged_frames": len(at.rows),
        "frame_rate_hz": float((len(times) - 1) / (times[-1] - times[0])),
        "width": footage.width,
        "height": footage.height,
        "judged_width": None if footage.frames is None else footage.frames.shape[2],
        "judged_height": None if footage.frames is None else footage.frames.shape[1],
        "undistorted": is_video and lens.distortion is not None,
        "method": recovered.method,
        **verdict,
        "not_run": [f"{name}: needs depth" for name in NEEDS_DEPTH] if is_video else [],
    }
    results.write_json("judgement.json", result)
    return result


def measure_retention(
    source: str,
    source_braking: str,
    edited: str,
    edited_braking: str,
    *,
    camera: str,
    event: tuple[int, int] = (16, 42),
    out: str | None = None,
) -> dict[str, Any]:
    """Measure how much of the road event's pitch an editor kept, from its input and output (paper, Appendix A.5).

    Parameters
    ----------
    source, edited : videos or trajectories of the drive over the road feature, before and after the edit
    source_braking, edited_braking : the same of the drive that brakes on the flat road
    camera : YAML, as for `judge_video`
    event : first and last frame of the event; the paper's at 10 frames a second
    out : folder for retention.json

    Raises
    ------
    InputError
        For every file that cannot be read or is given twice, clips of different length, an event outside them, or a
        lost track.
    """
    results = Outputs(out, "lab retention", "retention.json")
    names = (source, source_braking, edited, edited_braking)
    twice = [name for name in dict.fromkeys(names) if names.count(name) > 1]
    if twice:
        raise InputError([f"{name}: must be one of the four clips; it stands for two." for name in twice])
    *clips, lens = _read_all(*((read_footage, name) for name in names), (read_camera, camera))
    counts = [len(clip.times) for clip in clips]
    problems = []
    if len(set(counts)) > 1:
        problems.append(f"The four clips must have one number of frames; they have {counts}.")
    if not 2 <= event[0] < event[1] - 1 or not event[1] < min(counts) - 2:
        problems.append(
            f"The event must lie within the clips with two frames before and after it; it is frames {event[0]} to"
            f" {event[1]} of {min(counts)}."
        )
    if problems:
        raise InputError(problems)
    motions = [clip.motion(lens) for clip in clips]
    lost = [f"{clip.name}: {m.failures[0]}" for clip, m in zip(clips, motions, strict=True) if m.failures]
    if lost:
        raise InputError(lost)
    before, before_braking, after, after_braking = (motion.pitch for motion in motions)
    result = {
        "motion_retention": motion_retention(before, before_braking, after, after_braking, event),
        "event": list(event),
        "frames": counts[0],
        "clips": [clip.name for clip in clips],
        "method": [motion.method for motion in motions],
    }
    results.write_json("retention.json", result)
    return result


def _read_all(*sources: tuple[Callable[[Path], Any], str]) -> list[Any]:
    """Return the value that each reader makes of its file; all faulty files are reported at once."""
    parts: list[Any] = []
    problems: list[str] = []
    for read, path in sources:
        try:
            parts.append(read(Path(path)))
        except InputError as error:
            problems += error.problems
    if problems:
        raise InputError(problems)
    return parts
