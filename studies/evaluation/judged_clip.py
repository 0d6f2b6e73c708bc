"""One clip of a dataset as its judges see it."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from flows.making.catalogue import catalogue_of
from flows.making.gate import prepare_for_checks
from flows.making.plan import read_plan
from flows.store.frames import read_clip
from flows.store.layout import Layout
from studies.evaluation.film import through_film
from studies.evaluation.metrics.no_reference import piqe, temporal_error
from studies.evaluation.metrics.severity import measure_image, sampled_frames
from studies.foreign_video.outside_trajectory import motion_from_trajectory
from studies.foreign_video.trajectories import read_trajectory
from studies.physics_judge.audit_physics import clip_columns
from tasks.conventions import ROAD_CLASSES
from tasks.eval.poses.checks import POSE_CHECKS, hide_moving
from tasks.eval.poses.motion import RecoveredMotion
from tasks.eval.poses.resampling import undistort_frames
from tasks.render.camera import PIXEL_CENTRE

Row = dict[str, Any]
METHODS = tuple(POSE_CHECKS)


@dataclass(frozen=True, kw_only=True)
class JudgedClip:
    """A clip as its judges saw it.

    Parameters
    ----------
    facts : the clip's row
    frames : columns of the frame table
    motions : recovered motion by method
    statistics : of its pictures
    thumbnails : three of its frames, uint8 [3, h, w, 3] sRGB
    quality : of its pictures, without a reference
    """

    facts: Row
    frames: dict[str, NDArray[Any]]
    motions: dict[str, RecoveredMotion]
    statistics: dict[str, float]
    thumbnails: NDArray[np.uint8]
    quality: dict[str, float]

    @property
    def times(self) -> NDArray[np.float64]:
        """Of the frames [s]."""
        return np.asarray(self.frames["t_ns"] * 1e-9, np.float64)

    @property
    def opening(self) -> float | None:
        """When the front axle meets the road feature's near edge [s]; None if there is none or it never does."""
        edge = self.facts["hazard_center_m"] - self.facts["hazard_length_m"] / 2
        if self.facts["hazard_height_m"] == 0 or self.frames["station"][-1] <= edge:
            return None
        return float(np.interp(edge, self.frames["station"], self.times))


@dataclass(frozen=True, kw_only=True)
class View:
    """How judges see a dataset: after a film's compression, if any, and with the lens's distortion taken out.

    Parameters
    ----------
    root : a finished dataset
    crf : constant rate factor of the H.264 that the pictures pass through; None leaves them as they are [1]
    """

    root: Path
    crf: int | None = None

    def arrays(self, index: int, *names: str) -> list[NDArray[Any]]:
        """Arrays of the clip at that index, by name; depth is that of the street, without road users."""
        buffers = {name: read_clip(Layout(self.root).frames, index, name) for name in names}
        if self.crf is not None and "rgb" in buffers:
            rate = read_plan(self.root).settings.frame_rate_hz
            buffers["rgb"] = through_film(buffers["rgb"], rate, self.crf)
        if "depth" in buffers and read_plan(self.root).settings.has_objects:
            instances = read_clip(Layout(self.root).frames, index, "instance")
            buffers["depth"] = hide_moving(buffers["depth"], instances)
        camera = catalogue_of(self.root).camera_of(int(read_plan(self.root).clips[index].seed))
        return list(undistort_frames(buffers, camera.K - PIXEL_CENTRE, camera.distortion).values())


def judge_clip(
    view: View, facts: Row, outside: Mapping[str, Path] | None = None, *, metric: bool = False
) -> JudgedClip:
    """Return all pose checks and the image statistics of one clip, and the trajectories that others recovered of it.

    Parameters
    ----------
    view : of the dataset
    facts : the clip's row
    outside : trajectory files by the name of what made them
    metric : whether their lengths are metres

    Raises
    ------
    InputError
        For a trajectory that cannot be read or does not cover the clip.
    """
    cv2.setNumThreads(1)
    catalogue = catalogue_of(view.root, facts.get("scene"))
    rgb, depth, kind = view.arrays(facts["index"], "rgb", "depth", "class")
    frames = clip_columns(view.root, "frames", facts)
    times = np.asarray(frames["t_ns"] * 1e-9, np.float64)
    clip = prepare_for_checks(
        {"rgb": rgb, "depth": depth, "class": kind}, frames, facts["film_depth_mm"], catalogue,
        catalogue.camera_of(int(facts["seed"])),
    )  # fmt: skip
    others = {name: read_trajectory(path) for name, path in (outside or {}).items()}
    sampled = rgb[sampled_frames(len(rgb))]
    small = rgb[[0, len(rgb) // 3, 2 * len(rgb) // 3]]
    return JudgedClip(
        facts=facts,
        frames=frames,
        motions={name: check(clip) for name, check in POSE_CHECKS.items()}
        | {
            name: motion_from_trajectory(
                name,
                times,
                *trajectory,
                clip.camera.T_rig_camera,
                metric=metric,
                route_rotations=clip.route_rotations,
            )
            for name, trajectory in others.items()
        },
        statistics=measure_image(rgb, np.isin(kind, ROAD_CLASSES)),
        quality={
            "piqe": float(np.mean([piqe(picture) for picture in sampled])),
            "temporal_error": temporal_error(rgb),
        },
        thumbnails=np.stack([cv2.resize(p, (240, 240 * p.shape[0] // p.shape[1])) for p in small]),
    )
