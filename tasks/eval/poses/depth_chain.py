"""A chain of frame-to-frame steps for checks that read depth: tracked where the motion is predicted, else searched."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from tasks.eval.poses.motion import FrameStep, Placement, place_frames
from tasks.eval.poses.rigid import Floats

Prepared = TypeVar("Prepared")

KEPT_FRAMES = 9
"""Prepared frames that stay in memory: more than a gap of the track or a link spans [1]."""


@dataclass(frozen=True, kw_only=True)
class Attempt:
    """A step between two frames that starts from one first guess.

    Parameters
    ----------
    step : the step, or why there is none
    quality : larger is better; compared between the first guesses of one step [any]
    """

    step: FrameStep
    quality: float


def prepare_on_demand(prepare: Callable[[int], Prepared]) -> Callable[[int], Prepared]:
    """Return `prepare` with a memory of the last `KEPT_FRAMES` frames."""
    return lru_cache(maxsize=KEPT_FRAMES)(prepare)


def place_frames_by_depth(
    count: int,
    prepared: Callable[[int], Prepared],
    track: Callable[[Prepared, Prepared, Floats], Attempt],
    search: Callable[[Prepared, Prepared, Floats], Attempt],
    guesses: Sequence[Floats],
) -> list[Placement]:
    """Place each frame against the last good one: track from the predicted motion, search where that fails.

    Against frame 0 there is no prediction, so every frame placed against it is searched for.

    Parameters
    ----------
    count : number of frames [1]
    prepared : frame number to the frame as the check wants it
    track, search : earlier frame, later frame and first guess of ``T_earlier_later`` to a step; the search
        takes guesses that are far off
    guesses : first guesses of the search, float64 [4, 4] each; the step of the best quality is taken [m]

    Returns
    -------
    one placement for each of the frames 1 .. count - 1
    """

    def place_frame(anchor: int, frame: int, predicted: Floats) -> FrameStep:
        earlier, later = prepared(anchor), prepared(frame)
        if anchor > 0:
            step = track(earlier, later, predicted).step
            if not step.failure:
                return step
        attempts = [search(earlier, later, guess) for guess in guesses]
        return max(attempts, key=lambda attempt: (not attempt.step.failure, attempt.quality)).step

    return place_frames(count, place_frame)


def invert_depth(depth: NDArray[np.float32], hidden: NDArray[np.bool_] | None) -> NDArray[np.float32]:
    """Inverse depth of a frame; 0 where there is none or the pixel is hidden [1/m].

    Parameters
    ----------
    depth : float32 [H, W] camera z, NaN where there is nothing [m]
    hidden : bool [H, W] pixels to leave out; None for none [1]
    """
    seen = np.isfinite(depth) & (depth > 0)
    if hidden is not None:
        seen &= ~hidden
    return np.divide(1.0, depth, out=np.zeros_like(depth), where=seen)
