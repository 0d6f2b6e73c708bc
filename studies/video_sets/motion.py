"""Clips of a set of edited videos, each looked at once: its motion and the scores of its pictures."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studies.evaluation.learned_judges import LoadedJudge
from studies.evaluation.learned_rows import score_pictures
from studies.evaluation.metrics.foreign_video import VideoClaim
from studies.foreign_video.sources import ForeignCamera, read_footage
from studies.video_sets.files import SetClip, VideoSet
from studies.video_sets.protocol import VideoProtocol
from tasks.errors import InputError
from tasks.eval.poses.motion import RecoveredMotion

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


def check_motion(seen: SetMotion) -> None:
    """Check that a clip has a pose in every frame, and that the car moves.

    Parameters
    ----------
    seen : clip that was looked at

    Raises
    ------
    InputError
        If it has not.
    """
    failed = int(seen.motion.failed.sum())
    if failed:
        raise InputError(f"{failed} of {len(seen.times)} frames without a pose; {seen.motion.failures[0]}")
    if not np.isfinite(seen.motion.normalised_path).all():
        raise InputError("the car does not move, and its progress cannot be normalised")
