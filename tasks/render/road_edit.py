"""The road-elevation profile in the picture: H_g moves and tilts the road's Gaussians."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tasks.conventions import ROAD_CLASSES, SemanticClass
from tasks.scene.gaussians import Gaussians
from tasks.scene.route import Route

STANDING_CLASSES = (SemanticClass.VEHICLE, SemanticClass.POLE, SemanticClass.OTHER)
"""Classes that stand on the road and move with it, inside the carriageway and below `STANDING_HEIGHT`."""
STANDING_HEIGHT = 4.0
"""Tallest road vehicle (Council Directive 96/53/EC, Annex I); wires, lamps and crowns hang above it [m]."""

Profile = Callable[[NDArray[np.float64]], NDArray[np.float64]]


@dataclass(frozen=True, kw_only=True)
class RoadRelief:
    """A road feature on its route, as the steps that shape, paint and light it take it.

    Parameters
    ----------
    route : the undisturbed route; gives station, lateral position and the local normal
    elevation, slope : H_g(s) [m] and H_g'(s) [1] at stations [m]
    near, far : stations between which H_g is not 0 [m]
    """

    route: Route
    elevation: Profile
    slope: Profile
    near: float
    far: float


def measure_road_lift(gaussians: Gaussians, relief: RoadRelief) -> NDArray[np.float64]:
    """Return the height H_g of the feature under every road Gaussian, float64 [N]; 0 for other Gaussians [m].

    Parameters
    ----------
    gaussians : the street, lifted or not
    relief : the road feature
    """
    lift = np.zeros(len(gaussians))
    road = np.isin(gaussians.class_id, ROAD_CLASSES)
    lift[road] = relief.elevation(relief.route.project(gaussians.means[road])[0])
    return lift


def apply_road_profile(
    gaussians: Gaussians, relief: RoadRelief, carriageway_left: float, carriageway_right: float
) -> tuple[Gaussians, NDArray[np.bool_]]:
    """Lift the road along the route's normal by H_g(s) and turn its Gaussians by the slope.

    A rigid rotation of each Gaussian keeps its footprint, while the road's surface grows by sqrt(1 + H_g'^2): by 0.2 %
    at the steepest point of a 75 mm x 3.7 m hump and by 0.8 % at that of an 80 mm x 2 m depression.

    Parameters
    ----------
    gaussians : the street
    relief : the road feature
    carriageway_left, carriageway_right : lateral extent within which things stand on the road [m]

    Returns
    -------
    The edited Gaussians, and bool [N] which of them moved; the others are bitwise unchanged.
    """
    station, lateral, height = relief.route.project(gaussians.means)
    lift = relief.elevation(station)
    within = (lateral <= carriageway_left) & (lateral >= carriageway_right) & (height <= STANDING_HEIGHT)
    rides = np.isin(gaussians.class_id, ROAD_CLASSES) | (
        np.isin(gaussians.class_id, STANDING_CLASSES) & within
    )
    moved = rides & (lift != 0)
    if not moved.any():
        return gaussians, moved
    frame = relief.route.pose(np.clip(station[moved], 0, relief.route.length))[:, :3, :3]
    left, up = frame[:, :, 1], frame[:, :, 2]
    # a rising road turns its normal backward: a negative rotation about the leftward axis
    turn = Rotation.from_rotvec(-np.arctan(relief.slope(station[moved]))[:, None] * left)
    means, quats, normals = gaussians.means.copy(), gaussians.quats_wxyz.copy(), gaussians.normals.copy()
    means[moved] = means[moved] + lift[moved, None] * up
    quats[moved] = (turn * Rotation.from_quat(quats[moved], scalar_first=True)).as_quat(scalar_first=True)
    normals[moved] = turn.apply(normals[moved])
    return replace(gaussians, means=means, quats_wxyz=quats, normals=normals), moved
