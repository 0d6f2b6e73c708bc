"""What stands in the rain: darker and more saturated where water fills its pores, in streaks that run down it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tasks.conventions import SemanticClass
from tasks.render.weather.coverage_field import FieldParameters, height_field
from tasks.render.weather.scene_light import mean_colours, recolour_gaussians
from tasks.render.weather.wet.wet_road import ALBEDO_RANGE, RoadFilmParameters, wet_albedo_ratio
from tasks.scene.gaussians import Gaussians

POROUS_CLASSES = (SemanticClass.BUILDING, SemanticClass.VEGETATION, SemanticClass.OTHER)
"""What stands and takes up water; lacquer and coated metal do not."""


@dataclass(frozen=True, kw_only=True)
class SoakedWallParameters:
    """How rain wets what stands.

    Parameters
    ----------
    share : of an upright surface that is soaked, on average [1]
    spread : standard deviation of that share from streak to streak [1]
    streaks : waves of the streaks, along the wall
    stretch : how much longer they are down the wall than along it [1]
    """

    share: float
    spread: float
    streaks: FieldParameters
    stretch: float


def soak_gaussians(
    gaussians: Gaussians,
    mirrors: NDArray[np.floating] | float,
    white: NDArray[np.floating],
    film: RoadFilmParameters,
    parameters: SoakedWallParameters,
    seed: int,
) -> Gaussians:
    """Return the scene with wet walls, roofs and bark.

    Each colour darkens by its own reflectance, dark ones more than bright ones: what is wet is more saturated. The rate
    does not matter: an hour of light rain soaks as much.

    Parameters
    ----------
    gaussians : the scene in the light of the clip
    mirrors : [N] share of their colour that they mirror, which stays as it is [1]
    white : [3] or [N, 3] radiance of a white surface on the road, or there, as the scene's colours have it [1]
    film : optics of the water
    parameters : how rain wets what stands
    seed : visual seed of the clip [1]
    """
    p = parameters
    index = np.flatnonzero(np.isin(gaussians.class_id, POROUS_CLASSES))
    place, up = gaussians.means[index].astype(np.float64), gaussians.normals[index, 2].astype(np.float64)
    streak = height_field(
        0.8 * place[:, 0] + 0.6 * place[:, 1], place[:, 2] / p.stretch, p.streaks, seed, "wall-streaks"
    )
    upright = np.clip(p.share + p.spread * streak, 0, 1)
    soaked = upright + (1 - upright) * np.clip(up, 0, 1)
    light = white[index] if np.ndim(white) == 2 else np.asarray(white)
    albedo = np.clip(mean_colours(gaussians)[index] / np.maximum(light, 1e-6), *ALBEDO_RANGE)
    kept = np.broadcast_to(mirrors, len(gaussians))[index]
    darker = 1 - wet_albedo_ratio(albedo, film.refractive_index, film.diffuse_reflectance)
    gain = np.ones((len(gaussians), 3))
    gain[index] -= ((1 - kept) * soaked)[:, None] * darker
    return recolour_gaussians(gaussians, gain, np.zeros((1, 3)))
