"""The built-in street put together, lit and packed as a scene."""

import numpy as np

from tasks.scene.gaussians import Gaussians
from tasks.scene.scene import Scene
from tasks.scene.street.bend import course, route
from tasks.scene.street.cars.parked import car_boxes, cars, footprints
from tasks.scene.street.furniture import furniture, post_boxes
from tasks.scene.street.houses.adornments import adornments, awning_boxes
from tasks.scene.street.houses.facades import facades
from tasks.scene.street.houses.roofs import house_boxes, roofs
from tasks.scene.street.layout import StreetLayout
from tasks.scene.street.light import Casters, lit_radiance
from tasks.scene.street.pavement import pavement
from tasks.scene.street.plan import CROWN_BALLS, plan_street
from tasks.scene.street.road import road
from tasks.scene.street.sky import panorama
from tasks.scene.street.surfels import THICKNESS, join
from tasks.scene.street.vegetation import LEAF_EXTINCTION, gardens, trees
from tasks.scene.surroundings import with_surroundings

_SH_BAND_0 = 0.28209479177387814


def build_street(seed: int = 2025, layout: StreetLayout | None = None) -> Scene:
    """A two-lane city street on a summer morning, with houses, trees and parked cars.

    The same seed and layout give the same bytes.

    Parameters
    ----------
    seed : draws everything that the layout leaves open [1]
    layout : dimensions and light; None for the defaults

    Returns
    -------
    Scene
        200k to 500k Gaussians with true classes and normals, colours in linear light with the sun and
        its shadows baked in, the route in the right lane and a panorama of the sky.
    """
    layout = layout or StreetLayout()
    line = course(layout)
    plan = plan_street(layout, seed)
    surfels = join(
        [
            road(layout, seed),
            pavement(layout, plan.trees, seed),
            facades(layout, plan.buildings, seed),
            roofs(layout, plan.buildings, seed),
            adornments(layout, plan.buildings, seed),
            gardens(layout, plan.buildings, seed),
            trees(layout, plan.trees, seed),
            cars(layout, plan.cars, seed),
            furniture(layout, plan, seed),
        ]
    )
    boxes = [
        house_boxes(layout, plan.buildings),
        awning_boxes(layout, plan.buildings),
        car_boxes(plan.cars),
        post_boxes(layout, plan),
    ]
    casters = Casters(
        boxes=np.concatenate(boxes),
        footprints=footprints(plan.cars),
        balls=np.array([tree.balls for tree in plan.trees]).reshape(-1, CROWN_BALLS, 4),
        leaf_extinction=LEAF_EXTINCTION,
    )
    radiance = lit_radiance(surfels, layout, line, casters)
    station = surfels.centre[:, 0]
    # a disc stays thinner than it is wide, so that its shortest axis is its normal
    thickness = np.minimum(THICKNESS, 0.5 * surfels.scale.min(axis=1, keepdims=True))
    return Scene(
        name="street",
        gaussians=with_surroundings(
            Gaussians(
                means=line.to_world(surfels.centre).astype(np.float32),
                quats_wxyz=line.quaternions(station, surfels.axes).astype(np.float32),
                scales=np.concatenate([surfels.scale, thickness], axis=1).astype(np.float32),
                opacities=surfels.opacity.astype(np.float32),
                sh=((radiance - 0.5) / _SH_BAND_0).astype(np.float32)[:, None, :],
                normals=line.directions(station, surfels.axes[:, 2]).astype(np.float32),
                class_id=surfels.class_id,
                antialiased=True,
            )
        ),
        route=route(layout, line),
        environment=panorama(layout, seed),
        carriageway_left=layout.carriageway_left,
        carriageway_right=layout.carriageway_right,
    )
