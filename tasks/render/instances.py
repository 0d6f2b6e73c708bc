"""Which object every pixel shows, and how much of each object is seen: from depth, class and pose of a frame alone."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from tasks.conventions import SemanticClass
from tasks.scene.gaussians import Gaussians

NEAR_M, NEAR_SHARE = 0.25, 0.01
"""A pixel shows an object whose Gaussian lies within this distance [m] and this share of its depth [1] more."""
LEAST_SEEN = 8
"""Gaussians of an object that face the camera inside the picture, below which its visibility is not represented [1]."""
_KINDS = (SemanticClass.VEHICLE, SemanticClass.POLE, SemanticClass.OTHER)


@dataclass(frozen=True, kw_only=True)
class Instances:
    """Objects of a frame.

    Parameters
    ----------
    pixels : int32 [H, W] number of the object; 0 where none is seen
    visibility : by number, the share of its surface towards the camera, inside the picture, that nothing else hides;
        NaN where too little of it faces the camera [1]
    truncation : by number, the share of its surface towards the camera that lies outside the picture [1]
    """

    pixels: NDArray[np.int32]
    visibility: dict[int, float]
    truncation: dict[int, float]


class InstanceFinder:
    """Finds the objects of frames of one scene.

    Parameters
    ----------
    gaussians : of the scene
    owners : int32 [N] number of the object of each Gaussian; 0 for none
    """

    def __init__(self, gaussians: Gaussians, owners: NDArray[np.int32]):
        kept = owners > 0
        self._points, self._owners = gaussians.means[kept].astype(np.float64), owners[kept]
        self._normals, self._class = gaussians.normals[kept].astype(np.float64), gaussians.class_id[kept]
        self._trees = {kind: cKDTree(self._points[self._class == kind]) for kind in _KINDS}

    def find(
        self,
        depth: NDArray[np.floating],
        classes: NDArray[np.uint8],
        K: NDArray[np.float64],
        T_world_camera: NDArray[np.float64],
    ) -> Instances:
        """Return the objects of one frame of a pinhole camera.

        Parameters
        ----------
        depth : [H, W] camera z; NaN where nothing is seen [m]
        classes : uint8 [H, W] class of each pixel
        K : float64 [3, 3] intrinsics, pixel centres at +0.5 [px]
        T_world_camera : float64 [4, 4] pose [m]
        """
        pixels = np.zeros(depth.shape, np.int32)
        for kind, tree in self._trees.items():
            rows, columns = np.nonzero((classes == kind) & np.isfinite(depth))
            if not len(rows) or not tree.n:
                continue
            z = depth[rows, columns].astype(np.float64)
            seen = np.stack(
                [(columns + 0.5 - K[0, 2]) / K[0, 0] * z, (rows + 0.5 - K[1, 2]) / K[1, 1] * z, z], 1
            )
            far, nearest = tree.query(seen @ T_world_camera[:3, :3].T + T_world_camera[:3, 3])
            owners = self._owners[self._class == kind][nearest]
            pixels[rows, columns] = np.where(far < NEAR_M + NEAR_SHARE * z, owners, 0)
        return Instances(pixels=pixels, **self._measure_visibility(pixels, depth, K, T_world_camera))

    def _measure_visibility(
        self,
        pixels: NDArray[np.int32],
        depth: NDArray[np.floating],
        K: NDArray[np.float64],
        T_world_camera: NDArray[np.float64],
    ) -> dict[str, dict[int, float]]:
        towards = T_world_camera[:3, 3] - self._points
        local = -towards @ T_world_camera[:3, :3]
        facing = (np.einsum("nk,nk->n", towards, self._normals) > 0) & np.isin(
            self._owners, np.unique(pixels)
        )
        points, owners = local[facing], self._owners[facing]
        ahead = points[:, 2] > 0.1
        z = np.where(ahead, points[:, 2], 1.0)
        u, v = (np.floor(K[k, k] * points[:, k] / z + K[k, 2]).astype(np.int64) for k in (0, 1))
        height, width = depth.shape
        inside = ahead & (u >= 0) & (u < width) & (v >= 0) & (v < height)
        there = np.where(inside, v, 0), np.where(inside, u, 0)
        # what is drawn nearer hides it; where that is its own object, whose far side it is on, it is not counted
        behind = inside & (depth[there] < z - NEAR_M - NEAR_SHARE * z)
        own_pixel = pixels[there] == owners
        shown, hidden = inside & own_pixel & ~behind, behind & ~own_pixel
        visibility, truncation = {}, {}
        for number in np.unique(pixels[pixels > 0]).tolist():
            own = owners == number
            counts = int(shown[own].sum()), int(hidden[own].sum())
            visibility[number] = counts[0] / sum(counts) if sum(counts) >= LEAST_SEEN else float("nan")
            truncation[number] = float(1 - inside[own].mean()) if own.any() else float("nan")
        return {"visibility": visibility, "truncation": truncation}
