"""Classification of the road Gaussians of an unlabelled cloud by route, height and normal."""

from dataclasses import replace

import numpy as np

from tasks.conventions import SemanticClass
from tasks.scene.gaussians import Gaussians
from tasks.scene.route import Route

HEIGHT_TOLERANCE = 0.15
"""Signed height within which a Gaussian counts as the road's surface [m]."""
UPRIGHT = np.cos(np.radians(30.0))
"""Least cosine of a road normal to the vertical: 30 degrees (paper, Appendix A.4) [1]."""


def classify_road(
    gaussians: Gaussians, route: Route, carriageway_left: float, carriageway_right: float
) -> Gaussians:
    """Return the cloud with the class ROAD on the carriageway; other classes stay. Road normals point up.

    Parameters
    ----------
    gaussians : the cloud
    route : its road plane and course
    carriageway_left, carriageway_right : lateral extent, left positive [m]
    """
    station, lateral, height = route.project(gaussians.means)
    up = route.pose(np.clip(station, 0, route.length))[:, :3, 2]
    cosine = np.einsum("ni,ni->n", gaussians.normals, up)
    road = (
        (lateral <= carriageway_left)
        & (lateral >= carriageway_right)
        & (np.abs(height) <= HEIGHT_TOLERANCE)
        & (np.abs(cosine) >= UPRIGHT)
    )
    flip = np.where(road & (cosine < 0), -1, 1).astype(np.float32)
    return replace(
        gaussians,
        normals=gaussians.normals * flip[:, None],
        class_id=np.where(road, SemanticClass.ROAD, gaussians.class_id).astype(np.uint8),
    )
