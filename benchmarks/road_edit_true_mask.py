"""``python -m benchmarks.road_edit_true_mask DATASET``: the road-edit scores of a true mask.

The mask is the feature's own outline, from the renderer's depth and class and the scene's route. It takes the place of
the pixels above the metric's threshold; morphology, components and flow are the metric's. No judge calls this.
"""

import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flows.judging.evaluation_rows import control_of
from flows.judging.judged_clip import JudgedClip, Row, View
from flows.judging.physics import clip_columns, clip_facts
from flows.judging.road_edit_rows import prescribed_masks
from flows.making.catalogue import catalogue_of
from tasks.conventions import ROAD_CLASSES
from tasks.eval.road_edit import (
    RoadEditScore,
    RoadEditSettings,
    keep_components,
    score_masks,
    score_road_edit,
)


def score_true_masks(
    frames: list[NDArray[np.uint8]], targets: list[NDArray[np.bool_]], settings: RoadEditSettings
) -> RoadEditScore:
    """Return the road-edit score of a detector that finds the outline of the feature without error.

    Parameters
    ----------
    frames : uint8 [H, W, 3] sRGB pictures of the feature clip, whose flow carries the masks [1]
    targets : bool [H, W] outline in each [1]
    settings : constants of the metric
    """
    active = [k for k, target in enumerate(targets) if target.sum() >= settings.active_px]
    return score_masks(
        {k: keep_components(targets[k], targets[k], settings) for k in active}, frames, targets
    )


def main(root: Path) -> None:
    """Print the scores of each clip with a road feature, by the judge if it has a flat twin, and by the true mask."""
    view, catalogue, settings = View(root=root), catalogue_of(root), RoadEditSettings()
    clips = [_read_clip(root, facts) for facts in clip_facts(root)]
    print(f"{'clip':28}{'':10} edit rate    T-IoU   anchor   frames")
    for clip in clips:
        if clip.facts["hazard_height_m"] == 0:
            continue
        rgb, depth, kind = view.arrays(clip.facts["index"], "rgb", "depth", "class")
        targets = list(prescribed_masks(clip, depth, np.isin(kind, ROAD_CLASSES), catalogue))
        flat = control_of(clip, clips, weather=False)
        scores = {"true mask": score_true_masks(list(rgb), targets, settings)}
        if flat is not None:
            control = view.arrays(flat.facts["index"], "rgb")[0]
            scores = {"judge": score_road_edit(list(rgb), list(control), targets, settings)} | scores
        for who, score in scores.items():
            if score is not None:
                print(
                    f"{clip.facts['label']:28}{who:10} {score.localised_edit_rate:9.2f} {score.temporal_iou:8.2f}"
                    f" {score.anchor_error:8.3f} {score.active_frames:8d}"
                )


def _read_clip(root: Path, facts: Row) -> JudgedClip:
    return JudgedClip(
        facts=facts, frames=clip_columns(root, "frames", facts), motions={}, statistics={}, quality={},
        thumbnails=np.empty((0, 0, 0, 3), np.uint8),
    )  # fmt: skip


if __name__ == "__main__":
    main(Path(sys.argv[1]))
