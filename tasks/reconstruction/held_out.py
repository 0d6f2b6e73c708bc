"""Quality of a scene on held-out pictures: those that its build never read."""

from dataclasses import dataclass
from math import nan

import numpy as np
from numpy.typing import NDArray

from tasks.conventions import ROAD_CLASSES
from tasks.eval.image_quality import WINDOW, psnr, ssim
from tasks.reconstruction.camera import rasteriser_intrinsics
from tasks.reconstruction.exposure import Exposure
from tasks.reconstruction.sequence import StereoSequence
from tasks.reconstruction.sky import sky_view
from tasks.render.camera import world_to_camera
from tasks.render.rasterise.rasteriser import prepare_gaussians, rasterise_view
from tasks.scene.scene import Scene


@dataclass(frozen=True, kw_only=True)
class HeldOutFrame:
    """Quality of one held-out picture, figures of `tasks.eval.image_quality`.

    Parameters
    ----------
    frame : number in the sequence [1]
    psnr_db, ssim : over the whole picture [dB], [1]
    road_psnr_db, road_ssim : over the pixels that the scene shows as road; NaN where there is none [dB], [1]
    road_share, covered_share : of the picture that is road, and that Gaussians more than half cover [1]
    """

    frame: int
    psnr_db: float
    ssim: float
    road_psnr_db: float
    road_ssim: float
    road_share: float
    covered_share: float


def score_held_out_frames(
    scene: Scene,
    sequence: StereoSequence,
    T_world_camera: NDArray[np.float64],
    exposure: Exposure,
    frames: NDArray[np.int64],
) -> tuple[HeldOutFrame, ...]:
    """Render the scene at the frames' poses and exposure, and compare with their pictures.

    Parameters
    ----------
    scene : the street
    sequence : the pictures
    T_world_camera : float64 [F, 4, 4] poses in the scene's world frame
    exposure : gains of all frames
    frames : int [M] numbers of the frames to judge [1]
    """
    prepared = prepare_gaussians(scene.gaussians)
    K = rasteriser_intrinsics(sequence.intrinsics)
    height, width = sequence.left.shape[1:3]
    rows = []
    for i in map(int, frames):
        gbuffer = rasterise_view(prepared, world_to_camera(T_world_camera[i]), K, width, height)
        sky = sky_view(scene.environment, (height, width), sequence.intrinsics, T_world_camera[i])
        shown = exposure.to_picture(gbuffer.rgb + (1 - gbuffer.alpha)[..., None] * sky, i)
        shown = np.rint(shown * np.float32(255)).astype(np.uint8)
        wanted = sequence.left[i]
        road = np.isin(gbuffer.class_id, ROAD_CLASSES)
        edge = WINDOW // 2
        rows.append(HeldOutFrame(
            frame=i,
            psnr_db=psnr(wanted, shown),
            ssim=ssim(wanted, shown),
            road_psnr_db=psnr(wanted, shown, road) if road.any() else nan,
            road_ssim=ssim(wanted, shown, road) if road[edge:-edge, edge:-edge].any() else nan,
            road_share=float(road.mean()),
            covered_share=float((gbuffer.alpha > 0.5).mean()),
        ))  # fmt: skip
    return tuple(rows)
