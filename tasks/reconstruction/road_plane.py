"""The road under the drive: one plane per picture, joined to a route on the road."""

import numpy as np
from numpy.typing import NDArray

from tasks.errors import InputError
from tasks.scene.route import Route, extend_route, route_from_poses

STATION_STEP = 0.5
"""Distance between route poses [m]."""
BANDWIDTH = 4.0
"""Length over which the route is smoothed [m]."""
ROAD_SPREAD = 0.3
"""Disparity error above which a pixel counts less as road [px]."""
LANE = 1.2
"""Half width of the strip whose height the route takes [m]."""
SURFACE_REACH = 14.0
"""Road nearer than this to a camera is measured precisely enough to correct the route by it [m]."""
SURFACE_SPREAD = 0.03
"""Height above the road above which a point counts less as road [m]."""


def fit_road_plane(
    disparity: NDArray[np.float32], intrinsics: NDArray[np.float64], disparity_scale: float
) -> NDArray[np.float64]:
    """Fit the plane of the road ahead in camera coordinates to one disparity picture.

    A plane is linear in disparity: d(u, v) = a u + b v + c. Robust least squares over a trapezoid that
    narrows towards the vanishing point, as a lane does, gives a, b, c.

    Parameters
    ----------
    disparity : float32 [H, W] NaN where unknown [px]
    intrinsics : float64 [3, 3] camera matrix [px]
    disparity_scale : focal length times baseline [px m]

    Returns
    -------
    float64 [4] unit normal pointing up, and the camera's height above the plane [m]; NaN without a plane
    """
    height, width = disparity.shape
    cx, cy = intrinsics[:2, 2]
    rows, columns = np.mgrid[
        int(cy + 0.25 * (height - cy)) : height : 2, int(0.35 * width) : int(0.65 * width) : 2
    ]
    d = disparity[rows, columns]
    used = (np.abs(columns - cx) < 1.2 * (rows - cy)) & np.isfinite(d)
    if used.sum() < 50:
        return np.full(4, np.nan)
    d = d[used].astype(np.float64)
    A = np.stack([columns[used] - cx, rows[used] - cy, np.ones(len(d))], axis=1)
    weight = np.ones(len(d))
    for spread in (*[4 * ROAD_SPREAD] * 5, *[ROAD_SPREAD] * 10):
        W = A * weight[:, None]
        x = np.linalg.solve(W.T @ A, W.T @ d)
        weight = 1 / (1 + ((d - A @ x) / spread) ** 2) ** 2
    m = x * (intrinsics[0, 0], intrinsics[1, 1], 1) / disparity_scale
    norm = float(np.linalg.norm(m))
    return np.append(-m / norm, 1 / norm)


def lay_route_below(
    T_origin_camera: NDArray[np.float64],
    planes: NDArray[np.float64],
    camera_ahead_of_front_axle: float,
    first_station: float,
    extension: float,
) -> Route:
    """Return the route on the road below the cameras, in the frame of the poses.

    Every camera is projected onto its plane; the projections and the planes' normals are smoothed along the
    drive; the rig's x axis follows the path. Beyond the last projection the route continues straight.

    Parameters
    ----------
    T_origin_camera : float64 [F, 4, 4] camera poses in driving order
    planes : float64 [F, 4] road planes in camera coordinates, from `fit_road_plane`
    camera_ahead_of_front_axle : camera position along the rig's x axis [m]
    first_station : distance driven before the route starts [m]
    extension : straight road beyond the last pose [m]

    Raises
    ------
    InputError
        No picture shows a road plane, or the drive is shorter than its start.
    """
    known = np.isfinite(planes).all(axis=1)
    if known.sum() < 2:
        raise InputError(
            "the road must be seen in at least two pictures; below the camera a plane was found in"
            f" {known.sum()} of {len(planes)}: the lower middle of the pictures must show road"
        )
    R, centre = T_origin_camera[known, :3, :3], T_origin_camera[known, :3, 3]
    driven = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(centre, axis=0), axis=1))])
    if driven[-1] <= first_station + STATION_STEP:
        raise InputError(
            f"the drive must be longer than {first_station + STATION_STEP:g} m, since the route starts at"
            f" {first_station:g} m; it is {driven[-1]:.2f} m: add pictures or lower first_station"
        )
    up = np.einsum("fij,fj->fi", R, planes[known, :3])
    at = np.arange(first_station, driven[-1], STATION_STEP)
    path, direction = _smooth_path(driven, centre - up * planes[known, 3:], at)
    normal, _ = _smooth_path(driven, up, at)
    poses = _poses_along_path(path, direction, normal)
    poses[:, :3, 3] -= camera_ahead_of_front_axle * poses[:, :3, 0]
    beyond = driven[-1] - at[-1] + extension
    return extend_route(route_from_poses(poses), beyond, STATION_STEP)


def settle_route(route: Route, points: NDArray[np.floating], depth: NDArray[np.floating]) -> Route:
    """Move the route up or down, and roll it, onto the measured road surface.

    Parameters
    ----------
    route : route near the road
    points : [N, 3] surface points, in the route's frame [m]
    depth : [N] how far from the camera each was measured [m]
    """
    station, lateral, height = route.project(points)
    road = (np.abs(lateral) < LANE) & (np.abs(height) < 0.3) & (depth < SURFACE_REACH)
    s, y, h = station[road], lateral[road], height[road]
    weight = depth[road] ** -4.0
    order = np.argsort(s, kind="stable")
    s, y, h, weight = s[order], y[order], h[order], weight[order] / weight.max(initial=1e-9)
    stations, fits = [], []
    for x in route.station:
        near = slice(*np.searchsorted(s, (x - BANDWIDTH / 2, x + BANDWIDTH / 2)))
        if near.stop - near.start < 50:
            continue
        A = np.stack([np.ones(near.stop - near.start), y[near]], axis=1)
        trust = weight[near]
        for _ in range(8):
            W = A * trust[:, None]
            fit = np.linalg.solve(W.T @ A + 1e-9 * np.eye(2), W.T @ h[near])
            trust = weight[near] / (1 + ((h[near] - A @ fit) / SURFACE_SPREAD) ** 2)
        stations.append(x)
        fits.append(fit)
    if not fits:
        return route
    rise, crossfall = (np.interp(route.station, stations, values)[:, None] for values in np.transpose(fits))
    poses = route.T_world_rig.copy()
    poses[:, :3, 3] += rise * poses[:, :3, 2]
    poses[:, :3, 2] -= crossfall * poses[:, :3, 1]
    direction = np.gradient(poses[:, :3, 3], route.station, axis=0)
    return route_from_poses(_poses_along_path(poses[:, :3, 3], direction, poses[:, :3, 2]))


def _poses_along_path(
    path: NDArray[np.float64], direction: NDArray[np.float64], normal: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return poses on a path with x along the direction and z as close to the normal as possible."""
    x = direction / np.linalg.norm(direction, axis=1, keepdims=True)
    z = normal - (normal * x).sum(axis=1, keepdims=True) * x
    z /= np.linalg.norm(z, axis=1, keepdims=True)
    poses = np.tile(np.eye(4), (len(path), 1, 1))
    poses[:, :3, :3] = np.stack([x, np.cross(z, x), z], axis=-1)
    poses[:, :3, 3] = path
    return poses


def _smooth_path(
    s: NDArray[np.float64], values: NDArray[np.float64], at: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return value and slope by local linear regression with a Gaussian window."""
    out, slope = np.empty((len(at), values.shape[1])), np.empty((len(at), values.shape[1]))
    for k, x in enumerate(at):
        A = np.stack([np.ones(len(s)), s - x], axis=1)
        W = A * np.exp(-0.5 * ((s - x) / BANDWIDTH) ** 2)[:, None]
        out[k], slope[k] = np.linalg.solve(W.T @ A + 1e-9 * np.eye(2), W.T @ values)
    return out, slope
