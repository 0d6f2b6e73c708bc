"""The Gaussians that a clip is drawn from: the scene with the clip's road feature in it, before the weather."""

from tasks.render.kerb_face import extend_kerbs
from tasks.render.road_edit import RoadRelief, apply_road_profile
from tasks.render.road_paint import HazardMarking, paint_feature
from tasks.render.road_refinement import refine_road
from tasks.scene.gaussians import Gaussians
from tasks.scene.scene import Scene
from tasks.surface.road_profile import RoadHazard, road_elevation, road_slope


def edit_scene(
    scene: Scene, hazard: RoadHazard, marking: HazardMarking | None, asphalt_albedo: float
) -> tuple[Gaussians, RoadRelief | None]:
    """Return the Gaussians with a road feature, and the feature as the renderer takes it; None on a flat road.

    Parameters
    ----------
    scene : without the feature
    hazard : road feature; height 0 leaves the scene as it is
    marking : painted on a hump; None leaves it plain
    asphalt_albedo : share of the light that the pavement sends back [1]
    """
    if hazard.height_m == 0:
        return scene.gaussians, None
    relief = RoadRelief(
        route=scene.route,
        elevation=lambda station: road_elevation(station, hazard),
        slope=lambda station: road_slope(station, hazard),
        near=hazard.center_m - hazard.length_m / 2,
        far=hazard.center_m + hazard.length_m / 2,
    )
    carriageway = scene.carriageway_left, scene.carriageway_right
    gaussians = refine_road(scene.gaussians, relief)
    if marking is not None and hazard.height_m > 0:
        gaussians = paint_feature(gaussians, relief, marking, *carriageway, asphalt_albedo)
    return extend_kerbs(apply_road_profile(gaussians, relief, *carriageway)[0], relief), relief
