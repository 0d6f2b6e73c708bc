"""Marking paint on a raised road feature."""

from dataclasses import dataclass, replace

import numpy as np

from tasks.conventions import ROAD_CLASSES, SemanticClass
from tasks.render.road_edit import RoadRelief
from tasks.render.weather.ground_grid import read_between
from tasks.render.weather.scene_light import ground_light, recolour_gaussians
from tasks.scene.gaussians import Gaussians


@dataclass(frozen=True, kw_only=True)
class HazardMarking:
    """Stripes along the direction of travel, marks and gaps of one width, over the feature's whole length.

    Parameters
    ----------
    stripe_width : of a mark and of a gap [m]
    paint, gap : reflectance of the marks and of the paint between them, linear red, green, blue [1]
    """

    stripe_width: float
    paint: tuple[float, float, float]
    gap: tuple[float, float, float]


def paint_feature(
    gaussians: Gaussians,
    relief: RoadRelief,
    marking: HazardMarking,
    carriageway_left: float,
    carriageway_right: float,
    asphalt_albedo: float,
) -> Gaussians:
    """Paint a feature's marking on the flat street, in the light that falls on the road there.

    Marks become class marking; the gaps between them keep their class. The middle of a mark lies on the route, so that
    the layout does not depend on the side to which the carriageway widens.

    Parameters
    ----------
    gaussians : the clear street, before the feature lifts it
    relief : the feature
    marking : its paint
    carriageway_left, carriageway_right : lateral extent of the carriageway, leftward positive [m]
    asphalt_albedo : reflectance of the road, from which the incident light follows [1]
    """
    road = np.flatnonzero(np.isin(gaussians.class_id, ROAD_CLASSES))
    station, lateral, _ = relief.route.project(gaussians.means[road])
    on = (station >= relief.near) & (station <= relief.far)
    on &= (lateral <= carriageway_left) & (lateral >= carriageway_right)
    index, across = road[on], lateral[on]
    mark = np.floor(across / marking.stripe_width + 0.5) % 2 == 0
    light = ground_light(gaussians, SemanticClass.ROAD)
    here = read_between(light.grid, light.illumination, gaussians.means[index, :2])
    reflectance = np.where(mark[:, None], marking.paint, marking.gap)
    gain, add = np.ones(len(gaussians)), np.zeros((len(gaussians), 3))
    gain[index] = 0
    add[index] = reflectance * here[:, None] * light.lit / asphalt_albedo
    sh, kind = gaussians.sh.copy(), gaussians.class_id.copy()
    sh[index] = recolour_gaussians(gaussians, gain, add).sh[index]
    kind[index[mark]] = SemanticClass.MARKING
    return replace(gaussians, sh=sh, class_id=kind)
