"""How well a scene shows pictures that its build never saw."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tasks.conventions import ROAD_CLASSES
from tasks.reconstruction.camera import rasteriser_intrinsics
from tasks.reconstruction.exposure import Exposure
from tasks.reconstruction.fidelity import psnr, ssim_map
from tasks.reconstruction.sequence import StereoSequence
from tasks.reconstruction.sky import sky_view
from tasks.render.camera import viewmat
from tasks.render.rasterise.rasteriser import prepare, rasterise
from tasks.scene.scene import Scene


@dataclass(frozen=True, kw_only=True)
class HeldOutFrame:
    """How well one picture that the build never saw is shown.

    Parameters
    ----------
    frame : number in the sequence [1]
    psnr_db, ssim : over the whole picture [dB], [1]
    road_psnr_db, road_ssim : over the pixels that the scene shows as road [dB], [1]
    road_share, covered_share : of the picture that is road, and that Gaussians more than half cover [1]
    """

    frame: int
    psnr_db: float
    ssim: float
    road_psnr_db: float
    road_ssim: float
    road_share: float
    covered_share: float


def judge(
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
    prepared = prepare(scene.gaussians)
    K = rasteriser_intrinsics(sequence.intrinsics)
    height, width = sequence.left.shape[1:3]
    rows = []
    for i in map(int, frames):
        gbuffer = rasterise(prepared, viewmat(T_world_camera[i]), K, width, height)
        sky = sky_view(scene.environment, (height, width), sequence.intrinsics, T_world_camera[i])
        shown = exposure.picture(gbuffer.rgb + (1 - gbuffer.alpha)[..., None] * sky, i)
        wanted = sequence.left[i] / np.float32(255)
        road = np.isin(gbuffer.class_id, ROAD_CLASSES)
        similarity = ssim_map(shown, wanted)
        rows.append(HeldOutFrame(
            frame=i,
            psnr_db=psnr(shown, wanted),
            ssim=float(similarity.mean()),
            road_psnr_db=psnr(shown, wanted, road),
            road_ssim=float(similarity[road].mean()) if road.any() else float("nan"),
            road_share=float(road.mean()),
            covered_share=float((gbuffer.alpha > 0.5).mean()),
        ))  # fmt: skip
    return tuple(rows)
