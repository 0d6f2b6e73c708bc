"""Learned quality scores behind one protocol: a video in, one number out. Users supply the weights.

A judge maps frames to a score. The classes here wrap a TorchScript module that is already in memory: this module reads
no file and downloads nothing.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import cv2
import numpy as np
import torch
from numpy.typing import NDArray

from studies.evaluation.metrics.severity import SAMPLED_FRAMES
from tasks.errors import InputError

CLIP_SIDE = 224
CLIP_MEAN = (0.48145466, 0.4578275, 0.40821073)
CLIP_STD = (0.26862954, 0.26130258, 0.27577711)
"""Input side [px] and colour statistics [1] of CLIP (Radford et al. 2021, arXiv:2103.00020)."""

PAIRS = 40
"""Pairs of neighbouring frames in temporal LPIPS (paper, Appendix D, which does not say which): evenly spread [1]."""
ROADSIDE, ROADSIDE_FRAME = ((0, 60, 150, 240), (330, 60, 480, 240)), (480, 320)
"""Its two regions as left, top, right, bottom, and the width and height of their frame (paper, Appendix D) [px]."""
FARNEBACK = (0.5, 4, 21, 4, 7, 1.5, 0)
"""Pyramid scale, levels, window, iterations, poly_n, poly_sigma and flags of its flow. Appendix D prints none:
these are T-IoU's (Appendix A.6)."""
DOVER_TECHNICAL, DOVER_AESTHETIC = (0.1107, 0.07355, 0.6104), (-0.08285, 0.03774, 0.3896)
"""Mean, spread and weight of DOVER's two raw scores (its authors' code: VQAssessment/DOVER, `fuse_results`) [1]."""

Network = Callable[..., Any]
"""A TorchScript module, or anything that is called like one."""


class VideoJudge(Protocol):
    """Anything that scores a video."""

    def score(self, frames: NDArray[np.uint8]) -> float:
        """Return the score.

        Parameters
        ----------
        frames : uint8 [F, H, W, 3] sRGB
        """


@dataclass(frozen=True, kw_only=True)
class ClipWeather:
    """Similarity of a video to one weather less that to dry weather, by CLIP (paper, Appendix D, severity score).

    Parameters
    ----------
    encode_image : float32 [N, 3, 224, 224] to features [N, D]
    weather, dry : [D] mean text features of the prompts, of any length [1]
    """

    encode_image: Network
    weather: NDArray[np.floating]
    dry: NDArray[np.floating]

    def score(self, frames: NDArray[np.uint8]) -> float:
        """Return the mean over 16 frames of f^T g_weather - f^T g_dry, with f of length 1."""
        pictures = np.stack([_clip_input(frame) for frame in sample_frames(frames)])
        with torch.inference_mode():
            features = self.encode_image(torch.from_numpy(pictures)).double().numpy()
        features /= np.linalg.norm(features, axis=1, keepdims=True)
        weather, dry = (g / np.linalg.norm(g) for g in (self.weather, self.dry))
        return float(np.mean(features @ (weather - dry)))


@dataclass(frozen=True, kw_only=True)
class WholeVideo:
    """A no-reference video judge, such as DOVER or FAST-VQA, with its sampling inside the module.

    Parameters
    ----------
    network : float32 [1, 3, F, H, W] in 0 to 1, to a tensor of one number or more
    """

    network: Network

    def evaluate_network(self, frames: NDArray[np.uint8]) -> tuple[float, ...]:
        """Return all outputs of the network for all frames."""
        video = torch.from_numpy(np.ascontiguousarray(frames.transpose(3, 0, 1, 2)[None])).float() / 255
        with torch.inference_mode():
            return tuple(float(x) for x in self.network(video).reshape(-1))

    def score(self, frames: NDArray[np.uint8]) -> float:
        """Return the single output of the network.

        Raises
        ------
        InputError
            If it has more than one output.
        """
        found = self.evaluate_network(frames)
        if len(found) != 1:
            raise InputError(f"A video judge's module must give one number; it gives {len(found)}.")
        return found[0]


def dover_scores(numbers: tuple[float, ...]) -> dict[str, float]:
    """Return DOVER's scores by name: the overall one, or the two raw ones and their fusion by the authors' code [1].

    Parameters
    ----------
    numbers : the overall score, or technical and aesthetic [1]

    Raises
    ------
    InputError
        If there are neither one nor two numbers.
    """
    if len(numbers) == 1:
        return {"dover_overall": numbers[0]}
    if len(numbers) != 2:
        raise InputError(f"DOVER's module must give one number or two; it gives {len(numbers)}.")
    fused = sum(
        weight * (raw - mean) / spread
        for raw, (mean, spread, weight) in zip(numbers, (DOVER_TECHNICAL, DOVER_AESTHETIC), strict=True)
    )
    return {
        "dover_overall": float(1 / (1 + np.exp(-fused))),
        "dover_technical": numbers[0],
        "dover_aesthetic": numbers[1],
    }


@dataclass(frozen=True, kw_only=True)
class FlowAlignedDistance:
    """Perceptual distance of a frame and its predecessor warped onto it by flow (paper, Appendix D, temporal LPIPS).

    The paper does not print these choices: the flow has T-IoU's constants, the predecessor is sampled bilinearly with
    edges held, both regions have the same weight, and they scale with the frame.

    Parameters
    ----------
    network : two float32 [1, 3, H, W] in -1 to 1, to one number
    """

    network: Network

    def score(self, frames: NDArray[np.uint8]) -> float:
        """Return the mean over 40 pairs and the two roadside regions; NaN for fewer than two frames."""
        if len(frames) < 2:
            return float("nan")
        later = np.linspace(1, len(frames) - 1, min(PAIRS, len(frames) - 1)).astype(int)
        return float(np.mean([self._measure_distance(frames[k - 1], frames[k]) for k in later]))

    def _measure_distance(self, before: NDArray[np.uint8], frame: NDArray[np.uint8]) -> float:
        pictures = [
            torch.from_numpy(picture.transpose(2, 0, 1)[None].astype(np.float32)) / 127.5 - 1
            for picture in (warp_to_successor(before, frame), frame)
        ]
        height, width = frame.shape[:2]
        scale = np.array((width, height) * 2) / (ROADSIDE_FRAME * 2)
        with torch.inference_mode():
            return float(
                np.mean(
                    [
                        float(self.network(*(p[..., top:bottom, left:right].contiguous() for p in pictures)))
                        for left, top, right, bottom in np.rint(np.array(ROADSIDE) * scale).astype(int)
                    ]
                )
            )


def warp_to_successor(before: NDArray[np.uint8], frame: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Warp a picture onto its successor by Farneback's backward flow (Farneback 2003, DOI 10.1007/3-540-45103-X_50).

    Parameters
    ----------
    before, frame : uint8 [H, W, 3] sRGB [1]
    """
    here, there = (cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY) for picture in (frame, before))
    flow = cv2.calcOpticalFlowFarneback(here, there, np.zeros((*here.shape, 2), np.float32), *FARNEBACK)
    y, x = np.mgrid[: here.shape[0], : here.shape[1]].astype(np.float32)
    warped = cv2.remap(
        before, x + flow[..., 0], y + flow[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
    )
    return np.asarray(warped, np.uint8)


def sample_frames(frames: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return at most 16 of the frames, evenly from the first to the last."""
    return frames[np.unique(np.linspace(0, len(frames) - 1, min(SAMPLED_FRAMES, len(frames))).astype(int))]


def _clip_input(frame: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Return the middle square of a frame, float32 [3, 224, 224], in the form that CLIP was trained on."""
    height, width = frame.shape[:2]
    scale = CLIP_SIDE / min(height, width)
    size = (round(width * scale), round(height * scale))
    small = cv2.resize(frame, size, interpolation=cv2.INTER_AREA if scale < 1 else cv2.INTER_CUBIC)
    left, top = (size[0] - CLIP_SIDE) // 2, (size[1] - CLIP_SIDE) // 2
    square = small[top : top + CLIP_SIDE, left : left + CLIP_SIDE].astype(np.float32) / 255
    return ((square - np.array(CLIP_MEAN, np.float32)) / np.array(CLIP_STD, np.float32)).transpose(2, 0, 1)
