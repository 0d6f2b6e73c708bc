"""The built-in street put together, lit and packed as a scene."""

import numpy as np

from tasks.scene.gaussians import Gaussians
from tasks.scene.scene import Scene, mix_daylight
from tasks.scene.street.bend import Course, integrate_course, lay_route
from tasks.scene.street.boundaries import build_boundaries
from tasks.scene.street.cars.parked import car_boxes, car_footprints, list_cars
from tasks.scene.street.furniture import build_furniture, post_boxes
from tasks.scene.street.ground import build_ground
from tasks.scene.street.houses.adornments import awning_boxes, build_adornments
from tasks.scene.street.houses.facades import build_facades
from tasks.scene.street.houses.roofs import build_roofs, house_boxes
from tasks.scene.street.layout import StreetLayout
from tasks.scene.street.light import Casters, share_light
from tasks.scene.street.pavement import build_pavement
from tasks.scene.street.plan import CROWN_BALLS, Plan, plan_street
from tasks.scene.street.road import build_road
from tasks.scene.street.roadside import build_roadside
from tasks.scene.street.sky import draw_panorama
from tasks.scene.street.surfels import THICKNESS, Surfels, join_surfels
from tasks.scene.street.vegetation import LEAF_EXTINCTION, build_gardens, build_trees
from tasks.scene.surroundings import add_surroundings

_SH_BAND_0 = 0.28209479177387814


def build_street(layout: StreetLayout, seed: int) -> Scene:
    """A two-lane road with what the layout puts beside it: houses, trees, parked cars, gardens, fields.

    The same seed and layout give the same bytes.

    Parameters
    ----------
    layout : dimensions and light
    seed : draws everything that the layout leaves open [1]

    Returns
    -------
    Scene
        200k to 600k Gaussians with true classes and normals, colours in linear light with the sun and
        its shadows baked in, the route in the right lane and a panorama of the sky.
    """
    line = integrate_course(layout)
    plan = plan_street(layout, seed)
    surfels = join_surfels(
        [
            build_road(layout, seed),
            build_ground(layout, seed),
            build_boundaries(layout, seed),
            build_roadside(layout, seed),
            build_pavement(layout, plan.trees, seed),
            build_facades(layout, plan.buildings, seed),
            build_roofs(layout, plan.buildings, seed),
            build_adornments(layout, plan.buildings, seed),
            build_gardens(layout, plan.buildings, seed),
            build_trees(layout, plan.trees, seed),
            *list_cars(plan.cars, seed),
            build_furniture(layout, plan, seed),
        ]
    )
    return Scene(
        name="street",
        gaussians=add_surroundings(pack_surfels(surfels, layout, line, plan)),
        route=lay_route(layout, line),
        environment=draw_panorama(layout, seed),
        carriageway_left=layout.carriageway_left,
        carriageway_right=layout.carriageway_right,
        sun_direction_deg=(layout.sun_azimuth_deg, layout.sun_elevation_deg),
        daylight=_daylight(layout),
    )


def pack_surfels(surfels: Surfels, layout: StreetLayout, line: Course, plan: Plan) -> Gaussians:
    """Return surfels of a street as Gaussians in its light, without their surroundings.

    Parameters
    ----------
    surfels : the street, or a part of it
    layout : dimensions and light
    line : course of the road
    plan : what stands there and casts shadows
    """
    boxes = [
        house_boxes(layout, plan.buildings),
        awning_boxes(layout, plan.buildings),
        car_boxes(plan.cars),
        post_boxes(layout, plan),
    ]
    casters = Casters(
        boxes=np.concatenate(boxes),
        footprints=car_footprints(plan.cars),
        balls=np.array([tree.balls for tree in plan.trees]).reshape(-1, CROWN_BALLS, 4),
        leaf_extinction=LEAF_EXTINCTION * max(layout.leaf_share, 0.2),
    )
    light = share_light(surfels, layout, line, casters)
    # Lambert's law, and the surfel's own glow
    radiance = surfels.albedo * mix_daylight(light, _daylight(layout)) + surfels.glow
    glowing = surfels.glow.sum(axis=1) / np.maximum(radiance.sum(axis=1), 1e-9)
    station = surfels.centre[:, 0]
    # a disc stays thinner than it is wide, so that its shortest axis is its normal
    thickness = np.minimum(THICKNESS, 0.5 * surfels.scale.min(axis=1, keepdims=True))
    return Gaussians(
        means=line.to_world(surfels.centre).astype(np.float32),
        quats_wxyz=line.to_world_quaternions(station, surfels.axes).astype(np.float32),
        scales=np.concatenate([surfels.scale, thickness], axis=1).astype(np.float32),
        opacities=surfels.opacity.astype(np.float32),
        sh=((radiance - 0.5) / _SH_BAND_0).astype(np.float32)[:, None, :],
        normals=line.to_world_directions(station, surfels.axes[:, 2]).astype(np.float32),
        class_id=surfels.class_id,
        light=np.column_stack([light, glowing]).astype(np.float32),
        antialiased=True,
    )


def _daylight(layout: StreetLayout) -> tuple[tuple[float, float, float], ...]:
    return layout.sun_rgb, layout.sky_rgb, layout.bounce_rgb
