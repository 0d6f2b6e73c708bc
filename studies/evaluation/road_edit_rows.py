"""Visibility of a dataset's road features in its pictures, compared with their flat twins."""

import cv2
import numpy as np
from numpy.typing import NDArray

from flows.making.catalogue import Catalogue, catalogue_of
from studies.evaluation.judged_clip import JudgedClip, Row, View
from studies.evaluation.metrics.flip import flip_error
from studies.evaluation.metrics.road_edit import score_road_edit, score_true_masks
from studies.evaluation.rows import figure_row, find_control
from tasks.conventions import ROAD_CLASSES
from tasks.eval.image_quality import ssim
from tasks.render.camera import PIXEL_CENTRE

LOOK_AHEAD = 40.0
"""Way before a road feature from which its mask is looked for [m]."""
SAME_STATION, SAME_PITCH = 1e-3, 1e-5
"""Up to where two cars count as being in one place [m], [rad]."""
AROUND = 18
"""How far about the feature its shade may reach; the dilation of Appendix A.6 [px]."""


def road_edit_rows(view: View, clips: list[JudgedClip]) -> list[Row]:
    """Road-edit metrics of each feature clip that has a flat twin, and whether the edit left the rest alone.

    Beside each stands, as its floor, what the true outline of the feature scores in the same pictures.

    Parameters
    ----------
    view : of the dataset
    clips : as their judges saw them
    """
    rows: list[Row] = []
    for clip in clips:
        catalogue = catalogue_of(view.root, clip.facts.get("scene"))
        flat = find_control(clip, clips, weather=False)
        if clip.facts["hazard_height_m"] == 0 or flat is None:
            continue
        depth, kind = view.arrays(clip.facts["index"], "depth", "class")
        targets = prescribed_masks(clip, depth, np.isin(kind, ROAD_CLASSES), catalogue)
        pictures = [view.arrays(c.facts["index"], "rgb")[0] for c in (clip, flat)]
        score = score_road_edit(list(pictures[0]), list(pictures[1]), list(targets))
        true = score_true_masks(list(pictures[0]), list(targets))
        for name in ("localised_edit_rate", "anchor_error", "temporal_iou", "edit_outside"):
            note = "the target is never seen" if score is None else ""
            if score is not None:
                note = f"{score.active_frames} frames, {score.unregistered} not registered"
            value, floor = (
                None if found is None or np.isnan(getattr(found, name)) else getattr(found, name)
                for found in (score, true)
            )
            rows.append(
                figure_row(name, "paired-lab", clip.facts["label"], value, "1", note=note, floor=floor)
            )
        rows += twin_rows(clip, flat, pictures[0], pictures[1], targets)
    return rows


def twin_rows(
    clip: JudgedClip,
    flat: JudgedClip,
    feature: NDArray[np.uint8],
    control: NDArray[np.uint8],
    targets: NDArray[np.bool_],
) -> list[Row]:
    """Likeness of a feature clip and its flat twin off the feature, while both cars are still in one place.

    Parameters
    ----------
    clip, flat : as their judges saw them
    feature, control : their pictures, uint8 [F, H, W, 3] sRGB
    targets : where the feature is prescribed, bool [F, H, W]
    """
    together = np.abs(clip.frames["station"] - flat.frames["station"]) < SAME_STATION
    together &= np.abs(clip.frames["pitch"] - flat.frames["pitch"]) < SAME_PITCH
    together &= targets.any(axis=(1, 2))
    kept = np.flatnonzero(together)
    note = f"{len(kept)} frames before contact" if len(kept) else "the cars part before the feature is seen"
    reach = np.ones((2 * AROUND + 1, 2 * AROUND + 1), np.uint8)
    rest = [cv2.dilate(targets[k].astype(np.uint8), reach) == 0 for k in kept]
    likeness = [ssim(control[k], feature[k], region) for k, region in zip(kept, rest, strict=True)]
    differences = [flip_error(control[k], feature[k], region) for k, region in zip(kept, rest, strict=True)]
    seen = [value for value in differences if value is not None]
    return [
        figure_row("twin_ssim", "off the feature", clip.facts["label"],
                   float(np.mean(likeness)) if likeness else None, "1", note=note),
        figure_row("twin_flip", "off the feature", clip.facts["label"],
                   float(np.mean(seen)) if seen else None, "1",
                   note=note if len(seen) == len(kept) else "not run: the package flip-evaluator is missing"),
    ]  # fmt: skip


def prescribed_masks(
    clip: JudgedClip, depth: NDArray[np.float32], road: NDArray[np.bool_], catalogue: Catalogue
) -> NDArray[np.bool_]:
    """Road pixels whose place on the route is that of the clip's feature, bool [F, H, W]."""
    facts, scene = clip.facts, catalogue.scene
    camera = catalogue.camera_of(int(facts["seed"]))
    near, far = (facts["hazard_center_m"] + s * facts["hazard_length_m"] / 2 for s in (-1, 1))
    masks = np.zeros(depth.shape, bool)
    inverse = np.linalg.inv(camera.K - PIXEL_CENTRE)
    poses = clip.frames["T_world_rig"].reshape(-1, 4, 4) @ camera.T_rig_camera
    for k, station in enumerate(clip.frames["station"]):
        if not far - LOOK_AHEAD < station < far:
            continue
        y, x = np.nonzero(road[k] & np.isfinite(depth[k]) & (depth[k] < LOOK_AHEAD))
        rays = np.stack([x, y, np.ones(len(x))], axis=1) @ inverse.T
        points = rays * depth[k, y, x, None] @ poses[k, :3, :3].T + poses[k, :3, 3]
        along, across, _ = scene.route.project(np.asarray(points, np.float64))
        inside = (along >= near) & (along <= far)
        inside &= (across <= scene.carriageway_left) & (across >= scene.carriageway_right)
        masks[k, y[inside], x[inside]] = True
    return masks
