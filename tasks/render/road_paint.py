"""The finish of a road feature: marking paint on a hump, fresh asphalt in a depression, and the joints about either."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tasks.conventions import ROAD_CLASSES, SemanticClass
from tasks.render.road_edit import RoadRelief
from tasks.render.weather.ground_grid import read_between
from tasks.render.weather.scene_light import ground_light, mean_colours, recolour_gaussians
from tasks.render.weather.sky import LUMINANCE
from tasks.scene.gaussians import Gaussians
from tasks.scene.scene import mix_daylight


@dataclass(frozen=True, kw_only=True)
class WarningSign:
    """A triangle on a post at the right of the carriageway, with a hump or a dip in black.

    Parameters
    ----------
    side : of the triangle [m]
    foot : height of its lower edge above the road [m]
    offset : of its middle beyond the edge of the carriageway [m]
    before : way from the sign to the feature [m]
    border, field, symbol, metal : reflectance of its parts, linear red, green, blue [1]
    """

    side: float
    foot: float
    offset: float
    before: float
    border: tuple[float, float, float]
    field: tuple[float, float, float]
    symbol: tuple[float, float, float]
    metal: tuple[float, float, float]


@dataclass(frozen=True, kw_only=True)
class HazardMarking:
    """Stripes along the direction of travel on a hump, a patch where the road sinks, and a joint before and behind.

    Parameters
    ----------
    stripe_width : of a mark and of a gap on a hump, over its whole length [m]
    paint, gap : reflectance of the marks and of the paint between them, linear red, green, blue [1]
    patch : reflectance of the asphalt laid where the road sinks; None leaves a depression as the road is [1]
    patch_margin : of the patch beyond the depression, before and behind [m]
    joint : reflectance of the sealed joints; None has none [1]
    joint_width : of a joint, whose middle is the end of the paint or of the patch [m]
    sign : that announces the feature; None has none
    """

    stripe_width: float
    paint: tuple[float, float, float]
    gap: tuple[float, float, float]
    patch: tuple[float, float, float] | None = None
    patch_margin: float = 0.0
    joint: tuple[float, float, float] | None = None
    joint_width: float = 0.0
    sign: WarningSign | None = None


GRAIN = (0.75, 1.3)
"""Range of the road's own grain that shows through paint and in a patch, by the light on it [1]."""


def paint_feature(
    gaussians: Gaussians,
    relief: RoadRelief,
    marking: HazardMarking,
    carriageway_left: float,
    carriageway_right: float,
    asphalt_albedo: float,
    daylight: ArrayLike | None = None,
) -> Gaussians:
    """Return the flat street with the finish of a feature, in the light that falls on the road there.

    Marks become class marking; all else keeps its class. The middle of a mark lies on the route, so that the layout
    does not depend on the side to which the carriageway widens. The road's own markings lie on a patch, too.

    Parameters
    ----------
    gaussians : the clear street, before the feature lifts it
    relief : the feature
    marking : its finish
    carriageway_left, carriageway_right : lateral extent of the carriageway, leftward positive [m]
    asphalt_albedo : reflectance of the road, from which the incident light follows [1]
    daylight : [3, 3] as `Scene.daylight`; None where it is not known [1]
    """
    sinks = float(relief.elevation(np.array([(relief.near + relief.far) / 2]))[0]) < 0
    ground = marking.patch if sinks else marking.gap
    if ground is None:
        return gaussians
    margin = marking.patch_margin if sinks else 0.0
    near, far = relief.near - margin, relief.far + margin
    seam = 0.0 if marking.joint is None else marking.joint_width / 2
    covered = (SemanticClass.ROAD,) if sinks else ROAD_CLASSES
    road = np.flatnonzero(np.isin(gaussians.class_id, covered))
    station, lateral, _ = relief.route.project(gaussians.means[road])
    on = (station >= near - seam) & (station <= far + seam)
    on &= (lateral <= carriageway_left) & (lateral >= carriageway_right)
    index, across = road[on], lateral[on]
    to_end = np.minimum(station[on] - near, far - station[on])
    mark = (not sinks) & (np.floor(across / marking.stripe_width + 0.5) % 2 == 0) & (to_end >= seam)
    reflectance = np.where(mark[:, None], marking.paint, ground)
    if marking.joint is not None:
        reflectance[to_end < seam] = marking.joint
    white = measure_white(gaussians, index, asphalt_albedo, daylight)
    own = mean_colours(gaussians)[index] @ LUMINANCE / (white @ LUMINANCE)
    plain = gaussians.class_id[index] == SemanticClass.ROAD
    grain = np.where(plain, np.clip(own / max(np.median(own[plain]), 1e-9), *GRAIN), 1.0)
    gain, add = np.ones(len(gaussians)), np.zeros((len(gaussians), 3))
    gain[index] = 0
    add[index] = reflectance * grain[:, None] * white
    sh, kind = gaussians.sh.copy(), gaussians.class_id.copy()
    sh[index] = recolour_gaussians(gaussians, gain, add).sh[index]
    kind[index[mark]] = SemanticClass.MARKING
    return replace(gaussians, sh=sh, class_id=kind)


def measure_white(
    gaussians: Gaussians, index: NDArray[np.int64], asphalt_albedo: float, daylight: ArrayLike | None
) -> NDArray[np.float64]:
    """Return the radiance of a white surface in place of Gaussians of the road, float64 [n, 3] [1].

    Parameters
    ----------
    gaussians : the clear street
    index : int64 [n] positions of the Gaussians [1]
    asphalt_albedo : reflectance of the road [1]
    daylight : [3, 3] as `Scene.daylight` [1]; None reads the light off the road
    """
    if gaussians.light is not None and daylight is not None:
        here = mix_daylight(gaussians.light[index], daylight)
        road = gaussians.class_id[index] == SemanticClass.ROAD
        seen = (mean_colours(gaussians)[index[road]] @ LUMINANCE) / (here[road] @ LUMINANCE)
        return here * float(np.median(seen)) / asphalt_albedo
    light = ground_light(gaussians, SemanticClass.ROAD)
    relative = read_between(light.grid, light.illumination, gaussians.means[index, :2])
    return relative[:, None] * light.lit / asphalt_albedo
