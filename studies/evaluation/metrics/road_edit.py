"""Visibility of a road feature where it is prescribed (paper, Appendix A.6), and how much of the edit lies elsewhere.

A feature clip is compared with its flat control: registered by the background, compared in Lab, masked. The paper's
three figures see the change about the target alone: this project cuts the mask there, which the paper does not say. An
edit of the whole road scores well in them, and shows in the share outside.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

Mask = NDArray[np.bool_]


@dataclass(frozen=True, kw_only=True)
class RoadEditSettings:
    """Constants of Appendix A.6; the borders of the search region are this project's choice, the paper prints none.

    Parameters
    ----------
    active_px : target pixels from which a frame counts as showing the target [px]
    dilation_px : target dilation left out of the background, and searched [px]
    lower_share : lower part of the frame left out of the background [1]
    ecc_iterations, ecc_tolerance, ecc_filter : of the affine registration [1], [1], [px]
    floor, mads, mad_floor : residual threshold max(floor, median + mads max(MAD, mad_floor)), Lab over 255 [1]
    opening, closing : width and height of the morphology's rectangles [px]
    component_px : least size of a connected component [px]
    coverage : least share of the target that must be detected [1]
    search_top, search_side : lower-central search region: rows below, and columns off either side [1]
    """

    active_px: int = 80
    dilation_px: int = 18
    lower_share: float = 0.12
    ecc_iterations: int = 70
    ecc_tolerance: float = 1e-5
    ecc_filter: int = 5
    floor: float = 0.025
    mads: float = 3.5
    mad_floor: float = 0.004
    opening: tuple[int, int] = (3, 3)
    closing: tuple[int, int] = (7, 5)
    component_px: int = 20
    coverage: float = 0.05
    search_top: float = 0.4
    search_side: float = 0.1


CHOSEN = RoadEditSettings()


@dataclass(frozen=True, kw_only=True)
class DetectedEdit:
    """Pixels of a frame that an edit changed.

    Parameters
    ----------
    mask : bool [H, W] detected at the target, within its dilation; empty where too little changed [1]
    outside : changed pixels of the search region that lie beyond the dilation [px]
    changed : all changed pixels of the search region [px]
    converged : whether the registration converged
    """

    mask: Mask
    outside: int
    changed: int
    converged: bool = True


@dataclass(frozen=True, kw_only=True)
class RoadEditScore:
    """One feature clip against its flat control.

    Parameters
    ----------
    localised_edit_rate : share of active frames with a detection [1]
    anchor_error : mean distance of detected and prescribed centroid over the diagonal, 1 where missing [1]
    temporal_iou : mean IoU of each mask with the warped one before, 0 where missing [1]
    edit_outside : share of the changed pixels of the search region that lie outside the dilated target, mean over the
        active frames in which any changed; NaN without one [1]
    active_frames : frames that show the target [1]
    unregistered : frames whose registration did not converge and stayed as they were [1]
    """

    localised_edit_rate: float
    anchor_error: float
    temporal_iou: float
    edit_outside: float
    active_frames: int
    unregistered: int


def register_background(
    moving: NDArray[np.uint8], fixed: NDArray[np.uint8], background: Mask
) -> tuple[NDArray[np.uint8], bool]:
    """Warp the moving picture onto the fixed one by affine ECC on the background (Evangelidis 2008).

    Parameters
    ----------
    moving, fixed : uint8 [H, W, 3] sRGB pictures [1]
    background : bool [H, W] pixels that count [1]

    Returns
    -------
    The warped picture, and whether the registration converged.
    """
    grey = [cv2.cvtColor(p, cv2.COLOR_RGB2GRAY) for p in (fixed, moving)]
    end = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, CHOSEN.ecc_iterations, CHOSEN.ecc_tolerance)
    warp = np.eye(2, 3, dtype=np.float32)
    try:
        _, warp = cv2.findTransformECC(
            grey[0], grey[1], warp, cv2.MOTION_AFFINE, end, background.astype(np.uint8), CHOSEN.ecc_filter
        )
    except cv2.error:
        return moving, False
    size = fixed.shape[1], fixed.shape[0]
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    return cv2.warpAffine(moving, warp, size, flags=flags, borderMode=cv2.BORDER_REPLICATE), True


def compute_paired_residual(a: NDArray[np.uint8], b: NDArray[np.uint8]) -> NDArray[np.float64]:
    """Mean absolute Lab difference of two pictures, 8-bit Lab over 255 [1].

    Parameters
    ----------
    a, b : uint8 [H, W, 3] sRGB [1]
    """
    lab = [cv2.cvtColor(p, cv2.COLOR_RGB2LAB).astype(np.float64) / 255 for p in (a, b)]
    return np.abs(lab[0] - lab[1]).mean(axis=2)


def detect_edit(feature: NDArray[np.uint8], flat: NDArray[np.uint8], target: Mask) -> DetectedEdit:
    """Return the pixels that differ between a feature frame and its flat control, at the target and elsewhere.

    Parameters
    ----------
    feature, flat : uint8 [H, W, 3] sRGB pictures [1]
    target : bool [H, W] where the feature is prescribed [1]
    """
    height, width = target.shape
    wide = _widen(target)
    background = ~wide
    background[round((1 - CHOSEN.lower_share) * height) :] = False
    laid, converged = register_background(flat, feature, background)
    residual = compute_paired_residual(feature, laid)
    quiet = residual[background]
    middle = float(np.median(quiet))
    spread = max(float(np.median(np.abs(quiet - middle))), CHOSEN.mad_floor)
    side = round(CHOSEN.search_side * width)
    search = wide.copy()
    search[round(CHOSEN.search_top * height) :, side : width - side] = True
    changed = (residual > max(CHOSEN.floor, middle + CHOSEN.mads * spread)) & search
    return keep_components(changed, target, converged)


def keep_components(changed: Mask, target: Mask, converged: bool = True) -> DetectedEdit:
    """Return what the metric's morphology leaves of changed pixels.

    Parameters
    ----------
    changed : bool [H, W] pixels above the threshold [1]
    target : bool [H, W] where the feature is prescribed [1]
    converged : whether the registration converged
    """
    wide, pixels = _widen(target), changed.astype(np.uint8)
    changed = cv2.morphologyEx(pixels, cv2.MORPH_OPEN, np.ones(CHOSEN.opening[::-1], np.uint8))
    changed = cv2.morphologyEx(changed, cv2.MORPH_CLOSE, np.ones(CHOSEN.closing[::-1], np.uint8))
    count, label, facts, _ = cv2.connectedComponentsWithStats(changed)
    large = [i for i in range(1, count) if facts[i, cv2.CC_STAT_AREA] >= CHOSEN.component_px]
    edit: Mask = np.isin(label, large)
    # parts of one component beyond the dilation are no part of the mask, so that its centroid is of the target's change
    mask: Mask = edit & wide
    if (mask & target).sum() < CHOSEN.coverage * target.sum():
        mask[:] = False
    return DetectedEdit(
        mask=mask, outside=int((edit & ~wide).sum()), changed=int(edit.sum()), converged=converged
    )


def _widen(target: Mask) -> Mask:
    reach = 2 * CHOSEN.dilation_px + 1
    ball = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (reach, reach))
    return cv2.dilate(target.astype(np.uint8), ball) > 0


def temporal_iou(
    before: Mask, mask: Mask, picture_before: NDArray[np.uint8], picture: NDArray[np.uint8]
) -> float:
    """IoU of a mask with the one before, warped by Farneback backward flow (Farneback 2003) [1].

    Parameters
    ----------
    before, mask : bool [H, W] [1]
    picture_before, picture : uint8 [H, W, 3] sRGB [1]
    """
    if not (before.any() and mask.any()):
        return 0.0
    grey = [cv2.cvtColor(p, cv2.COLOR_RGB2GRAY) for p in (picture, picture_before)]
    flow = cv2.calcOpticalFlowFarneback(grey[0], grey[1], None, 0.5, 4, 21, 4, 7, 1.5, 0)
    y, x = np.mgrid[: mask.shape[0], : mask.shape[1]].astype(np.float32)
    warped = cv2.remap(before.astype(np.uint8), x + flow[..., 0], y + flow[..., 1], cv2.INTER_NEAREST) > 0
    return float((warped & mask).sum() / (warped | mask).sum())


def score_road_edit(
    feature: Sequence[NDArray[np.uint8]], flat: Sequence[NDArray[np.uint8]], targets: Sequence[Mask],
) -> RoadEditScore | None:  # fmt: skip
    """Localised edit rate, anchor error and temporal IoU of one pair of clips; None if the target is never seen.

    Parameters
    ----------
    feature, flat : F pictures each, uint8 [H, W, 3] sRGB [1]
    targets : F masks, bool [H, W] [1]
    """
    active = [k for k, target in enumerate(targets) if target.sum() >= CHOSEN.active_px]
    if not active:
        return None
    found = {k: detect_edit(feature[k], flat[k], targets[k]) for k in active}
    return score_edits(found, feature, targets)


def score_true_masks(feature: Sequence[NDArray[np.uint8]], targets: Sequence[Mask]) -> RoadEditScore | None:
    """Return the score of a detector that finds every target without error; None if the target is never seen.

    Morphology and flow stay the metric's, which is why it scores less than 1.

    Parameters
    ----------
    feature : F pictures, uint8 [H, W, 3] sRGB, whose flow carries the masks [1]
    targets : F masks, bool [H, W] [1]
    """
    found = {
        k: keep_components(target, target)
        for k, target in enumerate(targets)
        if target.sum() >= CHOSEN.active_px
    }
    return score_edits(found, feature, targets) if found else None


def score_edits(
    found: Mapping[int, DetectedEdit], feature: Sequence[NDArray[np.uint8]], targets: Sequence[Mask]
) -> RoadEditScore:
    """Return the score of what was detected in the active frames.

    Parameters
    ----------
    found : by frame
    feature, targets : as `score_road_edit` takes them
    """
    masks = {k: edit.mask for k, edit in found.items()}
    shares = [edit.outside / edit.changed for edit in found.values() if edit.changed]
    active, distances = sorted(masks), []
    diagonal = float(np.hypot(*targets[0].shape))
    for k in active:
        if masks[k].any():
            apart = np.argwhere(masks[k]).mean(axis=0) - np.argwhere(targets[k]).mean(axis=0)
            distances.append(float(np.linalg.norm(apart)) / diagonal)
        else:
            distances.append(1.0)
    pairs = [(k - 1, k) for k in active if k - 1 in masks]
    overlaps = [temporal_iou(masks[i], masks[k], feature[i], feature[k]) for i, k in pairs]
    return RoadEditScore(
        localised_edit_rate=float(np.mean([masks[k].any() for k in active])),
        anchor_error=float(np.mean(distances)),
        temporal_iou=float(np.mean(overlaps)) if overlaps else float("nan"),
        edit_outside=float(np.mean(shares)) if shares else float("nan"),
        active_frames=len(active),
        unregistered=sum(not edit.converged for edit in found.values()),
    )
