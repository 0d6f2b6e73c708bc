"""The Gaussians that a clip was drawn from: the scene with the clip's road feature in it, before the weather."""

from catalogs.scenario import Scenario
from flows.making.clip import Catalogue, relief_of
from flows.making.driving import hazard_of
from tasks.render.road_edit import apply_road_profile
from tasks.render.road_paint import paint_feature
from tasks.render.road_refinement import refine_road
from tasks.scene.gaussians import Gaussians


def edit_scene(scenario: Scenario, catalogue: Catalogue) -> Gaussians:
    """Return the Gaussians with the road feature of a scenario, edited as `flows.making.clip.render_frames` does.

    Parameters
    ----------
    scenario : of the clip
    catalogue : of its dataset
    """
    hazard, scene = hazard_of(scenario), catalogue.scene
    if hazard.height_m == 0:
        return scene.gaussians
    relief = relief_of(hazard, scene.route)
    carriageway = scene.carriageway_left, scene.carriageway_right
    gaussians = refine_road(scene.gaussians, relief)
    if catalogue.marking is not None and hazard.height_m > 0:
        gaussians = paint_feature(
            gaussians, relief, catalogue.marking, *carriageway, catalogue.looks.sky.asphalt_albedo
        )
    return apply_road_profile(gaussians, relief, *carriageway)[0]
