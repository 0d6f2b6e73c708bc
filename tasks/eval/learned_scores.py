"""Learned judges behind one protocol: a video in, one number out. Their weights are somebody else's file.

A judge is whatever maps frames to a score; what wraps a network here takes a TorchScript module that is already in
memory, so nothing in this module reads a file, and nothing anywhere asks a network for one.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Protocol

import cv2
import numpy as np
import torch
from numpy.typing import NDArray

from tasks.eval.severity import SAMPLED_FRAMES

CLIP_SIDE = 224
CLIP_MEAN = (0.48145466, 0.4578275, 0.40821073)
CLIP_STD = (0.26862954, 0.26130258, 0.27577711)
"""Input side [px] and colour statistics [1] of CLIP (Radford et al. 2021, arXiv:2103.00020)."""

Network = Callable[..., Any]
"""A TorchScript module, or anything that is called like one."""


class VideoJudge(Protocol):
    """What gives a video a number."""

    def score(self, frames: NDArray[np.uint8]) -> float:
        """The number.

        Parameters
        ----------
        frames : uint8 [F, H, W, 3] sRGB
        """


@dataclass(frozen=True, kw_only=True)
class ClipWeather:
    """How much a video looks like one weather rather than dry (paper, Appendix D, severity score).

    Parameters
    ----------
    encode_image : float32 [N, 3, 224, 224] to features [N, D]
    weather, dry : [D] mean text features of the prompts, of any length [1]
    """

    encode_image: Network
    weather: NDArray[np.floating]
    dry: NDArray[np.floating]

    def score(self, frames: NDArray[np.uint8]) -> float:
        """Mean over 16 frames of f^T g_weather - f^T g_dry, with f of length 1."""
        pictures = np.stack([_clip_input(frame) for frame in sampled(frames)])
        with torch.inference_mode():
            features = self.encode_image(torch.from_numpy(pictures)).double().numpy()
        features /= np.linalg.norm(features, axis=1, keepdims=True)
        weather, dry = (g / np.linalg.norm(g) for g in (self.weather, self.dry))
        return float(np.mean(features @ (weather - dry)))


@dataclass(frozen=True, kw_only=True)
class WholeVideo:
    """A no-reference video judge, such as DOVER or FAST-VQA, with its sampling and fusion inside the module.

    Parameters
    ----------
    network : float32 [1, 3, F, H, W] in 0 to 1, to one number
    """

    network: Network

    def score(self, frames: NDArray[np.uint8]) -> float:
        """What the network says of all frames."""
        video = torch.from_numpy(np.ascontiguousarray(frames.transpose(3, 0, 1, 2)[None])).float() / 255
        with torch.inference_mode():
            return float(self.network(video))


@dataclass(frozen=True, kw_only=True)
class NeighbourDistance:
    """Mean perceptual distance of neighbouring frames, such as temporal LPIPS.

    Parameters
    ----------
    network : two float32 [1, 3, H, W] in -1 to 1, to one number
    """

    network: Network

    def score(self, frames: NDArray[np.uint8]) -> float:
        """Mean over all pairs of neighbours; 0 for a still picture under any distance."""
        pictures = torch.from_numpy(np.ascontiguousarray(frames.transpose(0, 3, 1, 2))).float() / 127.5 - 1
        with torch.inference_mode():
            pairs = [float(self.network(a[None], b[None])) for a, b in pairwise(pictures)]
        return float(np.mean(pairs))


def sampled(frames: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """At most 16 of the frames, evenly from the first to the last."""
    return frames[np.unique(np.linspace(0, len(frames) - 1, min(SAMPLED_FRAMES, len(frames))).astype(int))]


def _clip_input(frame: NDArray[np.uint8]) -> NDArray[np.float32]:
    """The middle square of a frame, float32 [3, 224, 224], as CLIP was trained on it."""
    height, width = frame.shape[:2]
    scale = CLIP_SIDE / min(height, width)
    size = (round(width * scale), round(height * scale))
    small = cv2.resize(frame, size, interpolation=cv2.INTER_AREA if scale < 1 else cv2.INTER_CUBIC)
    left, top = (size[0] - CLIP_SIDE) // 2, (size[1] - CLIP_SIDE) // 2
    square = small[top : top + CLIP_SIDE, left : left + CLIP_SIDE].astype(np.float32) / 255
    return ((square - np.array(CLIP_MEAN, np.float32)) / np.array(CLIP_STD, np.float32)).transpose(2, 0, 1)
