"""The road seen through its film: refraction brings the texture below nearer to the eye.

It moves by under a fifth of a pixel, so that the picture to first order in the shift is exact to a thousandth of a grey
level, and no resampling softens it. The paper's composition draws it (Appendix A.4); the picture of linear light leaves
it out.
"""

import numpy as np
from numpy.typing import NDArray

from tasks.render.weather.wet.road_view import RoadView

LEAST_FACING = 0.02
"""Least cosine between the line of sight and the normal, from which on a road is seen edge on [1]."""


def compute_film_shift(view: RoadView, depth_m: float, refractive_index: float) -> NDArray[np.float64]:
    """Return how far the texture under a film appears from where it is, by Snell's law.

    A line of sight that meets the film at the angle i to the normal goes on at the angle t, sin t = sin i / n, and
    reaches the road h (tan i - tan t) nearer to the eye than it would without the film.

    Parameters
    ----------
    view : the road
    depth_m : of the film [m]
    refractive_index : n [1]

    Returns
    -------
    float64 [H, W, 2] column and row of the texture that a pixel shows, less the pixel's own; 0 off the road [px]
    """
    shift = np.zeros((*view.road.shape, 2))
    ray, up, z = (part[view.road].astype(np.float64) for part in (view.rays, view.normal, view.depth))
    sight = ray / np.linalg.norm(ray, axis=-1, keepdims=True)
    facing = np.clip(-(sight * up).sum(axis=-1), LEAST_FACING, 1.0)
    steep = np.sqrt(1 - facing**2)
    inside = steep / refractive_index
    nearer = depth_m * (steep / facing - inside / np.sqrt(1 - inside**2))
    along = sight + facing[:, None] * up
    along /= np.maximum(np.linalg.norm(along, axis=-1, keepdims=True), 1e-12)
    moved = -nearer[:, None] * along
    in_camera = moved @ view.T_world_camera[:3, :3]
    rows, columns = np.nonzero(view.road)
    for axis, index in enumerate((columns, rows)):
        focal, centre = view.K[axis, axis], view.K[axis, 2]
        at = (index + 0.5 - centre) / focal
        # the point z (at, 1) moved by (dx, dz): its new place on the picture, less the old
        shift[rows, columns, axis] = (
            focal * (in_camera[:, axis] - at * in_camera[:, 2]) / (z + in_camera[:, 2])
        )
    return shift


def see_through_film(
    picture: NDArray[np.float32], view: RoadView, shift: NDArray[np.float64]
) -> NDArray[np.float32]:
    """Return the picture with the texture of the road where a film shows it.

    Parameters
    ----------
    picture : float32 [H, W, 3] the road without its film [1]
    view : the road
    shift : of `compute_film_shift` [px]
    """
    seen = picture.copy()
    for axis, along in ((1, shift[..., 0]), (0, shift[..., 1])):
        inner = view.road & np.roll(view.road, 1, axis) & np.roll(view.road, -1, axis)
        slope = (np.roll(picture, -1, axis) - np.roll(picture, 1, axis)) / 2
        seen += np.where(inner[..., None], along[..., None] * slope, 0).astype(np.float32)
    return seen
