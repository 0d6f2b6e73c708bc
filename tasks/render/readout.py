"""Readout of a sensor: lens, rolling shutter and motion blur, resampled from one wide pinhole picture.

A frame is drawn once, by a pinhole with a wider field, at the pose of the middle row. For every pixel, its own ray (the
lens) from the pose at its own row's time (the rolling shutter), at several times of the exposure (motion blur), is
intersected with the nearest surface in the wide picture's depth, and the light there is averaged. A strip beside a near
edge, as wide as the edge moves during the readout, is hidden in the wide picture and takes the surface beside it.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from tasks.render.camera import Camera, world_to_camera
from tasks.render.lens import distort_rays, pixel_directions
from tasks.render.surface_search import depth_bounds, nearest_surface, parallax_range, project_onto_picture

MARGIN = 0.05
"""Share of the picture's larger side by which the wide picture reaches beyond a moving camera's field [1]."""
ROW_STEPS = 6
"""Iterations that find the row showing a point; each reduces the error by the point's motion in rows per row time."""
EDGE = 2.0
"""Neighbours that interpolation needs beyond the last sampled place [px]."""
ALONE = 1.0
"""Largest parallax about a ray at which it meets one surface during the whole exposure [px]."""
MOST_SAMPLES = 32
"""Largest number of samples of one pixel's light during the exposure; below it they lie at most one pixel apart [1]."""


@dataclass(frozen=True, kw_only=True)
class Field:
    """A camera's rays and the wide pinhole that covers them.

    Parameters
    ----------
    directions : float64 [H, W, 2] right and down per forward of the camera's pixels [1]
    K : float64 [3, 3] intrinsics of the wide pinhole, of the camera's focal length [px]
    width, height : its picture size [px]
    """

    directions: NDArray[np.float64]
    K: NDArray[np.float64]
    width: int
    height: int


@dataclass(frozen=True, kw_only=True)
class Readout:
    """Picture, depth and source of a sensor's pixels.

    Parameters
    ----------
    picture : float32 [H, W, 3] linear light, averaged over the exposure [1]
    depth : float32 [H, W] z in the camera at the pixel's row time, in the middle of its exposure; NaN where
        nothing is seen [m]
    source : int64 [H, W] pixel of the wide picture, counted by rows, seen in the middle of the exposure [1]
    """

    picture: NDArray[np.float32]
    depth: NDArray[np.float32]
    source: NDArray[np.int64]


class _WidePicture(NamedTuple):
    """The wide picture as the kernel takes it.

    Parameters
    ----------
    picture : float32 [h, w, 3] linear light [1]
    near : float32 [h, w] inverse depth; 0 where nothing is seen [m-1]
    farthest, nearest : from `depth_bounds` [m-1]
    K : float64 [4] focal lengths and principal point [px]
    """

    picture: NDArray[np.float32]
    near: NDArray[np.float32]
    farthest: NDArray[np.float32]
    nearest: NDArray[np.float32]
    K: NDArray[np.float64]


class _ReadArrays(NamedTuple):
    """The arrays of a `Readout`, as the kernel fills them."""

    picture: NDArray[np.float32]
    depth: NDArray[np.float32]
    source: NDArray[np.int64]


def sensor_field(camera: Camera) -> Field:
    """Return the rays of a camera's pixels and the wide pinhole around them; once per clip.

    Raises
    ------
    InputError
        The lens does not spread the whole picture.
    """
    directions = pixel_directions(camera.K, camera.width, camera.height, camera.lens)
    if camera.plain:
        return Field(directions=directions, K=camera.K, width=camera.width, height=camera.height)
    margin = EDGE + (MARGIN * max(camera.width, camera.height) if camera.moves else 0.0)
    f = np.array((camera.K[0, 0], camera.K[1, 1]))
    low, high = directions.min(axis=(0, 1)) * f - 0.5 - margin, directions.max(axis=(0, 1)) * f + 0.5 + margin
    # whole pixels are added on each side, so that a pixel that the lens does not move is not resampled
    K = camera.K.copy()
    K[:2, 2] += np.ceil(-low - K[:2, 2] - 1e-6)
    width, height = (int(n) for n in np.ceil(K[:2, 2] + high - 1e-6))
    return Field(directions=directions, K=K, width=width, height=height)


def read_out(
    picture: NDArray[np.float32],
    depth: NDArray[np.float32],
    field: Field,
    T_wide_rows: NDArray[np.float64],
    blurs: bool,
) -> Readout:
    """Return picture and depth of a sensor whose rows are exposed one after the other, behind a lens.

    Parameters
    ----------
    picture : float32 [h, w, 3] wide picture, linear light [1]
    depth : float32 [h, w] its camera z; NaN where nothing is seen [m]
    field : from `sensor_field`
    T_wide_rows : float64 [3, H, 4, 4] pose in the wide camera of the camera at the beginning, the middle and the
        end of each row's exposure [m]
    blurs : the light is averaged over the exposure, else taken in its middle

    Returns
    -------
    Readout
    """
    height, width = field.directions.shape[:2]
    near = np.divide(1, depth, out=np.zeros_like(depth), where=np.isfinite(depth))
    begin, middle, end = (np.ascontiguousarray(poses[:, :3]) for poses in T_wide_rows)
    seen = _ReadArrays(
        picture=np.empty((height, width, 3), np.float32),
        depth=np.empty((height, width), np.float32),
        source=np.empty((height, width), np.int64),
    )
    K = np.array((field.K[0, 0], field.K[1, 1], field.K[0, 2], field.K[1, 2]))
    wide = _WidePicture(picture, near, *depth_bounds(near), K)
    _read_pixels(wide, field.directions, middle, end - begin, blurs, seen)
    return Readout(**seen._asdict())


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _cubic_weights(t, weights):  # type: ignore[no-untyped-def]
    """Compute the weights of four neighbours, t between the middle two (Keys 1981, DOI 10.1109/TASSP.1981.1163711)."""
    weights[0] = np.float32(t * (-0.5 + t * (1 - 0.5 * t)))
    weights[1] = np.float32(1 + t * t * (-2.5 + 1.5 * t))
    weights[2] = np.float32(t * (0.5 + t * (2 - 1.5 * t)))
    weights[3] = np.float32(t * t * (-0.5 + 0.5 * t))


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _add_light(picture, u, v, across, down, light):  # type: ignore[no-untyped-def]
    """Add the picture's light at a place by cubic convolution; linear interpolation would blur between pixels."""
    height, width = picture.shape[:2]
    x = min(max(u - 0.5, 1.0), width - 2.001)
    y = min(max(v - 0.5, 1.0), height - 2.001)
    c, r = int(x), int(y)
    _cubic_weights(x - c, across)
    _cubic_weights(y - r, down)
    red = green = blue = np.float32(0)
    for i in range(4):
        for j in range(4):
            weight = down[i] * across[j]
            pixel = picture[r - 1 + i, c - 1 + j]
            red += weight * pixel[0]
            green += weight * pixel[1]
            blue += weight * pixel[2]
    light[0] += max(red, np.float32(0))
    light[1] += max(green, np.float32(0))
    light[2] += max(blue, np.float32(0))


def project_by_rows(
    points: NDArray[np.float64], T_world_rows: NDArray[np.float64], camera: Camera
) -> NDArray[np.float64]:
    """Project points of a street that does not move into a camera that is read out row by row.

    Parameters
    ----------
    points : float64 [..., 3] world frame [m]
    T_world_rows : float64 [H, 4, 4] camera pose at each row's time [m]
    camera : intrinsics and lens

    Returns
    -------
    float64 [..., 3]
        Right and down [px], and z in the camera at that row's time [m]; NaN behind the camera.
    """
    places = np.empty(points.shape)
    coefficients = np.zeros(5) if camera.lens is None else camera.lens.coefficients
    views = np.stack([world_to_camera(pose)[:3] for pose in T_world_rows])
    _project_rows(points.reshape(-1, 3), views, camera.K, coefficients, places.reshape(-1, 3))
    return places


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _project_rows(points, views, K, coefficients, places):  # type: ignore[no-untyped-def]
    rows = len(views)
    camera = np.empty(3)
    for k in range(len(points)):
        u, v = np.nan, 0.5 * rows
        for _ in range(ROW_STEPS):
            at = min(max(v - 0.5, 0.0), rows - 1.001)
            row = int(at)
            for i in range(3):
                camera[i] = 0.0
                for share, view in ((1 - at + row, views[row, i]), (at - row, views[row + 1, i])):
                    seen = view[3]
                    for j in range(3):
                        seen += view[j] * points[k, j]
                    camera[i] += share * seen
            if not camera[2] > 0:
                u, v = np.nan, np.nan
                break
            x, y = distort_rays(camera[0] / camera[2], camera[1] / camera[2], coefficients)
            u, v = K[0, 0] * x + K[0, 2], K[1, 1] * y + K[1, 2]
        places[k, 0], places[k, 1] = u, v
        places[k, 2] = camera[2] if v == v else np.nan


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _interpolate_ray(pose, span, share, direction, ray, shift):  # type: ignore[no-untyped-def]
    """Interpolate ray and shift of a pixel at a share of its exposure, linearly, since the rotation is small."""
    for i in range(3):
        x, y = pose[i, 0] + share * span[i, 0], pose[i, 1] + share * span[i, 1]
        ray[i] = x * direction[0] + y * direction[1] + pose[i, 2] + share * span[i, 2]
        shift[i] = pose[i, 3] + share * span[i, 3]


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _read_pixels(wide, directions, poses, spans, blurs, seen):  # type: ignore[no-untyped-def]
    picture, near, farthest, nearest, K = wide
    out, depth, source = seen
    height, width = directions.shape[:2]
    ray, shift, light = np.empty(3), np.empty(3), np.empty(3, dtype=np.float32)
    across, down = np.empty(4, dtype=np.float32), np.empty(4, dtype=np.float32)
    for row in range(height):
        pose, span = poses[row], spans[row]
        for column in range(width):
            direction = directions[row, column]
            _interpolate_ray(pose, span, 0.0, direction, ray, shift)
            u, v, w = nearest_surface(near, nearest, farthest, K, ray, shift)
            depth[row, column] = 1 / w if w > 0 else np.nan
            r = min(max(int(v), 0), near.shape[0] - 1)
            source[row, column] = r * near.shape[1] + min(max(int(u), 0), near.shape[1] - 1)
            light[:] = 0
            if not blurs:
                _add_light(picture, u, v, across, down, light)
                for i in range(3):
                    out[row, column, i] = light[i]
                continue
            _interpolate_ray(pose, span, -0.5, direction, ray, shift)
            first_u, first_v = project_onto_picture(K, ray, shift, w)
            parallax = parallax_range(near, nearest, farthest, K, ray, shift)
            _interpolate_ray(pose, span, 0.5, direction, ray, shift)
            last_u, last_v = project_onto_picture(K, ray, shift, w)
            parallax = max(parallax, parallax_range(near, nearest, farthest, K, ray, shift))
            alone = parallax <= ALONE
            way = max(abs(last_u - first_u), abs(last_v - first_v), 0.0 if alone else parallax)
            samples = max(min(int(np.ceil(way + 0.9)), MOST_SAMPLES), 1)
            for k in range(samples):
                share = (k + 0.5) / samples
                if samples > 1:
                    u, v = first_u + share * (last_u - first_u), first_v + share * (last_v - first_v)
                    if not alone:
                        _interpolate_ray(pose, span, share - 0.5, direction, ray, shift)
                        u, v, _ = nearest_surface(near, nearest, farthest, K, ray, shift)
                _add_light(picture, u, v, across, down, light)
            for i in range(3):
                out[row, column, i] = light[i] / samples
