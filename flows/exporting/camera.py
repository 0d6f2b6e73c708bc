"""The camera as exports describe it: everything that a reader needs to project into its pictures."""

from typing import Any

from tasks.render.camera import Camera


def describe_camera(camera: Camera) -> dict[str, Any]:
    """Return size, intrinsics, mount, lens and shutter of a camera, as JSON has them.

    ``K`` [px] counts pixel centres at +0.5; ``T_rig_camera`` takes camera axes (x right, y down, z forward) to the rig
    [m]; ``distortion`` is k1, k2, p1, p2, k3 of OpenCV [1], null for a pinhole; ``line_delay_s`` [s] is from one row to
    the next, 0 for one shutter for all; with ``motion_blur`` the picture is averaged over ``exposure_s`` [s].

    Parameters
    ----------
    camera : of the dataset
    """
    return {
        "name": camera.name,
        "width": camera.width,
        "height": camera.height,
        "K": camera.K.tolist(),
        "T_rig_camera": camera.T_rig_camera.tolist(),
        "distortion": None if camera.distortion is None else camera.distortion.tolist(),
        "exposure_s": camera.exposure_s,
        "line_delay_s": camera.line_delay_s,
        "motion_blur": camera.motion_blur,
    }
