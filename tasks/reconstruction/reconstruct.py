"""Reconstruction of a drivable street from a posed stereo sequence, with its quality on held-out pictures."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tasks.errors import InputError
from tasks.reconstruction.camera import rasteriser_intrinsics
from tasks.reconstruction.cloud import build_cloud
from tasks.reconstruction.disparity import fill_disparity, match_stereo
from tasks.reconstruction.exposure import Exposure, estimate_exposure
from tasks.reconstruction.fusion import find_finest_view, fuse_depth
from tasks.reconstruction.held_out import HeldOutFrame, score_held_out_frames
from tasks.reconstruction.normals import estimate_normals
from tasks.reconstruction.pose_correction import correct_poses
from tasks.reconstruction.refinement import TrainingView, refine_gaussians
from tasks.reconstruction.road_plane import fit_road_plane, lay_route_below, settle_route
from tasks.reconstruction.sequence import StereoSequence, StereoSettings
from tasks.reconstruction.sky import build_panorama, fit_sky, mask_sky, sky_view
from tasks.reconstruction.surfels import Surfels, join_samples, sample_picture
from tasks.render.camera import world_to_camera
from tasks.scene.route import Route
from tasks.scene.scene import Scene
from tasks.scene.surroundings import add_surroundings

CLIPPED = 254
"""Pixel values of at least this may stand for any brighter light."""


@dataclass(frozen=True, kw_only=True)
class Reconstruction:
    """A scene and the record of its reconstruction.

    Parameters
    ----------
    scene : the street
    held_out : figures of the frames left out of the build
    T_world_camera : float64 [F, 4, 4] corrected poses of all frames in the scene's world frame
    exposure : how each picture was taken
    """

    scene: Scene
    held_out: tuple[HeldOutFrame, ...]
    T_world_camera: NDArray[np.float64]
    exposure: Exposure

    def summarise(self) -> dict[str, Any]:
        """Return means over the held-out frames and the table, in plain numbers."""
        frames = [vars(frame) for frame in self.held_out]
        means = {
            f"held_out_{name}": float(np.nanmean([frame[name] for frame in frames]))
            for name in ("psnr_db", "ssim", "road_psnr_db", "road_ssim")
        }
        return means | {"held_out_frames": frames}


def reconstruct_street(sequence: StereoSequence, settings: StereoSettings | None = None) -> Reconstruction:
    """Build a Gaussian street from a posed stereo sequence.

    No step of the build reads a held-out frame: its pose correction and its gain are interpolated between the
    neighbouring training frames.

    Parameters
    ----------
    sequence : the pictures and poses
    settings : choices; None for the defaults

    Returns
    -------
    Reconstruction

    Raises
    ------
    InputError
        Too few pictures remain, left and right are swapped, no road is seen, or the drive is too short.
    """
    settings = settings or StereoSettings()
    held_out = settings.held_out(len(sequence))
    training = np.setdiff1d(np.arange(len(sequence)), held_out)
    if len(training) < 3:
        raise InputError(
            f"at least 3 pictures must remain for the build; of {len(sequence)}, {len(held_out)} are held out"
        )
    disparity = np.full(sequence.left.shape[:3], np.nan, dtype=np.float32)
    for i in training:
        disparity[i] = match_stereo(sequence.left[i], sequence.right[i], settings.disparities)
    _refuse_swapped(sequence, disparity, int(training[0]), settings)
    poses, route = _find_poses_and_route(sequence, disparity, training, settings)
    grey = sequence.left[..., 1]
    exposure = estimate_exposure(
        grey, disparity, sequence.intrinsics, sequence.disparity_scale, poses, training
    )
    environment, is_sky = _find_sky(sequence, exposure, poses, training, settings)
    depth, confirmed = _fuse_depth_maps(sequence, disparity[training], is_sky, poses[training], settings)
    route, poses = _settle_on_road(route, poses, depth, confirmed, sequence, training)
    surfels, picture = _sample_surfels(sequence, exposure, depth, confirmed, poses, training, settings)
    cloud = build_cloud(
        surfels,
        poses[training][picture],
        route,
        float(sequence.intrinsics[0, 0]),
        sequence.disparity_scale,
        settings.carriageway_limit,
    )

    K = rasteriser_intrinsics(sequence.intrinsics)
    shape = (grey.shape[1], grey.shape[2])

    def training_view(n: int) -> TrainingView:
        i = int(training[n])
        return TrainingView(
            viewmat=world_to_camera(poses[i]),
            K=K,
            radiance=exposure.to_radiance(sequence.left[i], i),
            clipped=sequence.left[i].min(axis=2) >= CLIPPED,
            gain=exposure.falloff * np.float32(exposure.gains[i]),
            sky=sky_view(environment, shape, sequence.intrinsics, poses[i]),
        )

    scene = Scene(
        name=sequence.name,
        gaussians=add_surroundings(
            refine_gaussians(
                add_surroundings(cloud.gaussians),
                cloud.rays,
                training_view,
                len(training),
                settings.refinement_passes,
            )
        ),
        route=route,
        environment=environment,
        carriageway_left=cloud.extents[0],
        carriageway_right=cloud.extents[1],
    )
    scores = score_held_out_frames(scene, sequence, poses, exposure, held_out)
    if scores and not any(frame.road_share > 0 for frame in scores):
        raise InputError(
            f"{sequence.name}: the scene must show a road where the pictures left out of it were taken; it shows none:"
            " a row of poses must map the left camera's axes to the sequence's frame, in m, in the pictures' order"
        )
    return Reconstruction(
        scene=scene,
        held_out=scores,
        T_world_camera=poses,
        exposure=exposure,
    )


def _refuse_swapped(
    sequence: StereoSequence, disparity: NDArray[np.float32], picture: int, settings: StereoSettings
) -> None:
    """Raise `InputError` where more of a picture is confirmed with its left and right exchanged."""
    exchanged = match_stereo(sequence.right[picture], sequence.left[picture], settings.disparities)
    here, there = (float(np.isfinite(found).mean()) for found in (disparity[picture], exchanged))
    if there > here:
        raise InputError(
            f"{sequence.name}: the left pictures must be of the left camera; {here:.0%} of picture {picture} has a"
            f" depth, and {there:.0%} with left and right exchanged: exchange them"
        )


def _find_poses_and_route(
    sequence: StereoSequence,
    disparity: NDArray[np.float32],
    training: NDArray[np.int64],
    settings: StereoSettings,
) -> tuple[NDArray[np.float64], Route]:
    """Return corrected poses and the route, in the rig frame at the start of the route."""
    scale = sequence.disparity_scale
    poses = correct_poses(
        sequence.left[..., 1], disparity, sequence.intrinsics, scale, sequence.T_origin_camera, training
    )
    planes = np.array([fit_road_plane(disparity[i], sequence.intrinsics, scale) for i in training])
    route = lay_route_below(
        poses[training],
        planes,
        settings.camera_ahead_of_front_axle,
        settings.first_station,
        settings.extension,
    )
    return _move_to_start(route, poses)


def _move_to_start(route: Route, poses: NDArray[np.float64]) -> tuple[NDArray[np.float64], Route]:
    """Return poses and route in the frame of the route's first pose."""
    T = np.linalg.inv(route.T_world_rig[0])
    return T @ poses, Route(station=route.station, T_world_rig=T @ route.T_world_rig)


def _find_sky(
    sequence: StereoSequence,
    exposure: Exposure,
    poses: NDArray[np.float64],
    training: NDArray[np.int64],
    settings: StereoSettings,
) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Return the panorama, and the sky pixels of each training picture."""
    radiance = [exposure.to_radiance(sequence.left[i], int(i)) for i in training]
    sky = fit_sky(radiance, sequence.intrinsics, poses[training])
    masks = [
        mask_sky(picture, sky, sequence.intrinsics, poses[i])
        for picture, i in zip(radiance, training, strict=True)
    ]
    environment = build_panorama(
        sky, radiance, masks, sequence.intrinsics, poses[training], settings.environment_rows
    )
    return environment, np.array(masks)


def _fuse_depth_maps(
    sequence: StereoSequence,
    disparity: NDArray[np.float32],
    is_sky: NDArray[np.bool_],
    poses: NDArray[np.float64],
    settings: StereoSettings,
) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Return the depth of the training pictures, filled, averaged over neighbours, and which of it is confirmed."""
    scale = sequence.disparity_scale
    complete = np.array([fill_disparity(d, sky) for d, sky in zip(disparity, is_sky, strict=True)])
    guessed = np.isnan(disparity) & np.isfinite(complete)
    depth = np.minimum(scale / np.maximum(complete, 1e-3), settings.maximum_depth).astype(np.float32)
    depth[is_sky] = np.inf
    return fuse_depth(depth, guessed, sequence.intrinsics, scale, poses)


def _settle_on_road(
    route: Route,
    poses: NDArray[np.float64],
    depth: NDArray[np.float32],
    confirmed: NDArray[np.bool_],
    sequence: StereoSequence,
    training: NDArray[np.int64],
) -> tuple[Route, NDArray[np.float64]]:
    """Return the route moved onto the measured road, and the poses in the frame of its new start."""
    stride = 4
    points, distances = [], []
    for n, i in enumerate(training):
        rows, columns = np.nonzero(confirmed[n, ::stride, ::stride])
        rows, columns = rows * stride, columns * stride
        z = depth[n, rows, columns].astype(np.float64)
        rays = np.stack([columns, rows, np.ones(len(z))], axis=1) @ np.linalg.inv(sequence.intrinsics).T
        points.append(rays * z[:, None] @ poses[i, :3, :3].T + poses[i, :3, 3])
        distances.append(z)
    poses, route = _move_to_start(
        settle_route(route, np.concatenate(points), np.concatenate(distances)), poses
    )
    return route, poses


def _sample_surfels(
    sequence: StereoSequence,
    exposure: Exposure,
    depth: NDArray[np.float32],
    confirmed: NDArray[np.bool_],
    poses: NDArray[np.float64],
    training: NDArray[np.int64],
    settings: StereoSettings,
) -> tuple[Surfels, NDArray[np.int64]]:
    """Return samples of all training pictures, each surface from the picture that shows it largest, and its number."""
    K, scale = sequence.intrinsics, sequence.disparity_scale
    parts = [
        sample_picture(
            find_finest_view(n, depth, confirmed, K, scale, poses[training]),
            depth[n],
            estimate_normals(depth[n], K, scale),
            sequence.left[i],
            exposure.to_radiance(sequence.left[i], int(i)),
            K,
            scale,
            settings.spacing,
        )
        for n, i in enumerate(training)
    ]
    return join_samples(parts), np.repeat(np.arange(len(parts)), [len(part) for part in parts])
