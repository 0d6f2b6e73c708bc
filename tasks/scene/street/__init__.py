"""The built-in street: a Gaussian scene made from a seed."""

import numpy as np

from tasks.scene.gaussians import Gaussians
from tasks.scene.scene import Scene
from tasks.scene.street.bend import course, route
from tasks.scene.street.layout import StreetLayout
from tasks.scene.street.light import Casters, lit_radiance
from tasks.scene.street.pavement import pavement
from tasks.scene.street.plan import plan_street
from tasks.scene.street.road import road
from tasks.scene.street.surfels import THICKNESS, join

__all__ = ["StreetLayout", "build_street"]

_SH_BAND_0 = 0.28209479177387814


def build_street(seed: int = 2025, layout: StreetLayout | None = None) -> Scene:
    layout = layout or StreetLayout()
    line = course(layout)
    plan = plan_street(layout, seed)
    surfels = join([road(layout, seed), pavement(layout, seed)])
    casters = Casters(boxes=np.zeros((0, 2, 3)), balls=np.stack([t.balls for t in plan.trees]), leaf_extinction=0.9)
    radiance = lit_radiance(surfels, layout, line, casters)
    n = len(surfels)
    s = surfels.centre[:, 0]
    gaussians = Gaussians(
        means=line.to_world(surfels.centre).astype(np.float32),
        quats_wxyz=line.quaternions(s, surfels.axes).astype(np.float32),
        scales=np.concatenate([surfels.scale, np.full((n, 1), THICKNESS)], axis=1).astype(np.float32),
        opacities=surfels.opacity.astype(np.float32),
        sh=((radiance - 0.5) / _SH_BAND_0).astype(np.float32)[:, None, :],
        normals=line.directions(s, surfels.axes[:, 2]).astype(np.float32),
        class_id=surfels.class_id,
    )
    return Scene(
        name="street",
        gaussians=gaussians,
        route=route(layout, line),
        environment=np.full((16, 32, 3), (0.4, 0.55, 0.8), np.float32),
        carriageway_left=layout.carriageway_left,
        carriageway_right=layout.carriageway_right,
    )
