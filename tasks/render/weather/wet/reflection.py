"""Reflections in a wet road: marching along the mirrored ray through the picture's own depth.

A ray that meets a surface of the picture takes its colour. A ray that passes behind a surface and stays hidden takes
that surface's colour; a car's front thus replaces its underside, and every ray that passes below so low an edge stays
hidden. A ray that leaves the picture continues to the surface at its edge, extended above the frame like a facade, with
a weight that falls with the distance; the rest of the weight is the sky's.
"""

from math import exp, sqrt

import numba
import numpy as np
from numpy.typing import NDArray

from tasks.render.environment import sample_panorama
from tasks.render.pixels import INLINED, LAW, new_picture, run_on_either
from tasks.render.weather.wet.road_view import RoadView

STEPS = 26
FIRST_STEP_M = 0.15
STEP_GROWTH = 1.26
HALVINGS = 5
THICKNESS_M, THICKNESS_SHARE = 0.4, 0.04
NEAREST_Z_M = 0.2
UNDERSIDE_M = 1.0
"""Height [m] of a lower edge up to which an object (a car, a bench) hides rays that pass below it; tree crowns and
signs are higher."""
EDGE_FADE = 0.35
"""Share of the picture's height over which the weight of the extended surface at its edge falls to 0."""


def mirrored_scene(
    picture: NDArray[np.float32],
    view: RoadView,
    environment: NDArray[np.float32],
    extinction: float,
    airlight: NDArray[np.floating],
) -> NDArray[np.float32]:
    """Return the radiance that arrives along the mirrored line of sight of every road pixel that mirrors.

    Parameters
    ----------
    picture : float32 [H, W, 3] the scene, without the veil of the air [1]
    view : the road, with the normals of the water's surface
    environment : float32 [h, w, 3] sky and far field [1]
    extinction : extinction coefficient of the air on the way from the mirrored object [m-1]
    airlight : [3] radiance of an infinitely deep layer of air [1]

    Returns
    -------
    float32 [H, W, 3] radiance; 0 elsewhere [1]
    """
    out = new_picture(picture, 3)
    K = view.K
    R = np.ascontiguousarray(view.T_world_camera[:3, :3], dtype=np.float32)
    camera = np.array((K[0, 0], K[1, 1], K[0, 2], K[1, 2]), dtype=np.float32)
    _mirror(
        picture, view.depth, view.normal, view.mirrors, environment, R, camera,
        np.float32(extinction), np.asarray(airlight, dtype=np.float32), out,
    )  # fmt: skip
    return out


@numba.njit(**LAW)
def _gap(u, v, z, depth):  # type: ignore[no-untyped-def]
    """Return the distance of a point of the ray behind the surface seen at its pixel [m]; negative in front of it."""
    surface = depth[int(v), int(u)]
    return z - surface if surface == surface else np.float32(-1e9)


@numba.njit(**INLINED)
def _blend_pixel(picture, u, v, c):  # type: ignore[no-untyped-def]
    """Return one channel of the picture between the centres of four pixels."""
    height, width = picture.shape[:2]
    x = min(max(u - np.float32(0.5), np.float32(0)), np.float32(width - 1.001))
    y = min(max(v - np.float32(0.5), np.float32(0)), np.float32(height - 1.001))
    c0, r0 = int(x), int(y)
    tx, ty = x - c0, y - r0
    above = (1 - tx) * picture[r0, c0, c] + tx * picture[r0, c0 + 1, c]
    below = (1 - tx) * picture[r0 + 1, c0, c] + tx * picture[r0 + 1, c0 + 1, c]
    return np.float32((1 - ty) * above + ty * below)


@numba.njit(**LAW)
def _place(origin, direction, t, camera):  # type: ignore[no-untyped-def]
    """Return pixel coordinates and camera z of a point of the ray."""
    z = origin[2] + t * direction[2]
    inverse = np.float32(1) / z
    u = camera[0] * (origin[0] + t * direction[0]) * inverse + camera[2]
    v = camera[1] * (origin[1] + t * direction[1]) * inverse + camera[3]
    return u, v, z


@numba.njit(**LAW)
def _beyond_edge(origin, direction, t, u, v, depth, camera):  # type: ignore[no-untyped-def]
    """Return u, v, t and weight where a ray that left the picture meets the extended surface at the edge (u, v)."""
    height, width = depth.shape
    edge_u = min(max(u, np.float32(0.5)), np.float32(width - 0.5))
    edge_v = min(max(v, np.float32(0.5)), np.float32(height - 0.5))
    surface = depth[int(edge_v), int(edge_u)]
    if surface != surface or direction[2] <= 0:
        return edge_u, edge_v, t, np.float32(0)
    t = max(t, (surface - origin[2]) / direction[2])
    u, v, _ = _place(origin, direction, t, camera)
    beyond = max(max(-v, v - height), max(-u, u - width), np.float32(0))
    return edge_u, edge_v, t, np.float32(exp(-beyond / (EDGE_FADE * height)))


@numba.njit(**LAW)
def _march(origin, direction, climb, depth, camera):  # type: ignore[no-untyped-def]
    """Follow a ray through the depth picture; return pixel (u, v) and length t where it meets a surface, and a weight.

    ``climb`` is the rise of the ray above the road per length.
    """
    height, width = depth.shape
    step, t = np.float32(FIRST_STEP_M) + np.float32(0.02) * origin[2], np.float32(0)
    hidden, hidden_u, hidden_v, hidden_t = False, np.float32(0), np.float32(0), np.float32(0)
    for _ in range(STEPS):
        before, t = t, t + step
        step *= np.float32(STEP_GROWTH)
        u, v, z = _place(origin, direction, t, camera)
        if z < np.float32(NEAREST_Z_M):
            break
        if u < 0 or v < 0 or u >= width or v >= height:
            return _beyond_edge(origin, direction, t, u, v, depth, camera)
        if _gap(u, v, z, depth) < 0:
            hidden = False
            continue
        if hidden:
            continue
        near, far = before, t
        for _ in range(HALVINGS):
            middle = (near + far) / 2
            u, v, z = _place(origin, direction, middle, camera)
            if u < 0 or v < 0 or u >= width or v >= height or _gap(u, v, z, depth) >= 0:
                far = middle
            else:
                near = middle
        u, v, z = _place(origin, direction, far, camera)
        if u < 0 or v < 0 or u >= width or v >= height:
            continue
        if _gap(u, v, z, depth) < np.float32(THICKNESS_M) + np.float32(THICKNESS_SHARE) * z:
            return u, v, far, np.float32(1)
        hidden, hidden_u, hidden_v, hidden_t = True, u, v, far
        if climb * far < np.float32(UNDERSIDE_M):
            break
    return hidden_u, hidden_v, hidden_t, np.float32(hidden)


@numba.njit(**INLINED)
def _turn(R, vector):  # type: ignore[no-untyped-def]
    """Return a vector of the world in camera axes."""
    x = R[0, 0] * vector[0] + R[1, 0] * vector[1] + R[2, 0] * vector[2]
    y = R[0, 1] * vector[0] + R[1, 1] * vector[1] + R[2, 1] * vector[2]
    z = R[0, 2] * vector[0] + R[1, 2] * vector[1] + R[2, 2] * vector[2]
    return x, y, z


@numba.njit(**INLINED)
def _mirror_pixel(  # type: ignore[no-untyped-def]
    row, column, picture, depth, normal, mirrors, environment, R, camera, extinction, airlight, out
):
    if not mirrors[row, column]:
        return
    z = depth[row, column]
    origin = (
        np.float32((column + np.float32(0.5) - camera[2]) / camera[0] * z),
        np.float32((row + np.float32(0.5) - camera[3]) / camera[1] * z),
        z,
    )
    away = np.float32(sqrt(origin[0] * origin[0] + origin[1] * origin[1] + z * z))
    ahead = (origin[0] / away, origin[1] / away, z / away)
    up = _turn(R, normal[row, column])
    facing = ahead[0] * up[0] + ahead[1] * up[1] + ahead[2] * up[2]
    direction = (
        np.float32(ahead[0] - 2 * facing * up[0]),
        np.float32(ahead[1] - 2 * facing * up[1]),
        np.float32(ahead[2] - 2 * facing * up[2]),
    )
    u, v, t, belief = _march(origin, direction, -facing, depth, camera)
    if belief < 1:
        x = R[0, 0] * direction[0] + R[0, 1] * direction[1] + R[0, 2] * direction[2]
        y = R[1, 0] * direction[0] + R[1, 1] * direction[1] + R[1, 2] * direction[2]
        z = R[2, 0] * direction[0] + R[2, 1] * direction[1] + R[2, 2] * direction[2]
        sample_panorama(environment, x, y, z, out[row, column])
    through = np.float32(exp(-extinction * t))
    for c in range(3):
        colour = _blend_pixel(picture, u, v, c) if belief > 0 else np.float32(0)
        seen = through * colour + (1 - through) * airlight[c]
        out[row, column, c] = belief * seen + (1 - belief) * out[row, column, c]


@run_on_either(_mirror_pixel)
@numba.njit(**LAW)
def _mirror(picture, depth, normal, mirrors, environment, R, camera, extinction, airlight, out):  # type: ignore[no-untyped-def]
    for row in range(depth.shape[0]):
        for column in range(depth.shape[1]):
            _mirror_pixel(
                row,
                column,
                picture,
                depth,
                normal,
                mirrors,
                environment,
                R,
                camera,
                extinction,
                airlight,
                out,
            )
