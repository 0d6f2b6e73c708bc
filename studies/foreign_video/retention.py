"""How much of a road event's pitch a video editor kept, from its input and output."""

from typing import Any

from flows.store.outputs import Outputs
from studies.evaluation.metrics.video_motion import motion_retention
from studies.foreign_video.judge import read_all
from studies.foreign_video.sources import read_camera, read_footage
from tasks.errors import InputError


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
    camera : YAML, as for `studies.foreign_video.judge.judge_video`
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
    *clips, lens = read_all(*((read_footage, name) for name in names), (read_camera, camera))
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
