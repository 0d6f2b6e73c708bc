"""A street in another light than its own: its sun taken away or moved, and the sky changed."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tasks.conventions import ROAD_CLASSES
from tasks.render.composition import LUMINANCE
from tasks.render.weather.scene_light import recolour_gaussians
from tasks.render.weather.skies import Daylight
from tasks.render.weather.sun_shadow import cast_sun
from tasks.scene.gaussians import Gaussians
from tasks.scene.scene import mix_daylight

LEAST_LIGHT = 0.02
"""Share of the sky's light below which a Gaussian is not relit further: what is left is its own [1]."""


def relight_street(
    gaussians: Gaussians,
    light: NDArray[np.float32],
    own: NDArray[np.float64],
    own_sun: NDArray[np.float64],
    new: Daylight,
) -> tuple[Gaussians, NDArray[np.float64], float]:
    """Return a street in another light, with as much of it on the road, on average, as in its own.

    Parameters
    ----------
    gaussians : the street in its own light
    light : float32 [N, 4] its `Gaussians.light` [1]
    own, own_sun : the light in their colours, see `light_of_sky`
    new : the light to put on

    Returns
    -------
    gaussians : in the new light, which they do not know any more
    incident : float64 [N, 3] radiance of a white surface in place of each Gaussian [1]
    strength : mean light on the road by that of its own light, before it was made equal [1]
    """
    shares = light.astype(np.float64)
    mirrors = shares[:, 3:]
    before = mix_daylight(shares, own)
    if new.has_sun and not np.array_equal(new.to_sun, own_sun):
        shares[:, 0] = cast_sun(gaussians, new.to_sun)
    after = mix_daylight(shares, new.colours)
    road = np.isin(gaussians.class_id, ROAD_CLASSES)
    area = np.sort(gaussians.scales[road].astype(np.float64), axis=1)[:, 1:].prod(axis=1)
    old_light, new_light = (area @ (one[road] @ LUMINANCE) for one in (before, after))
    strength = float(new_light / old_light)
    floor = LEAST_LIGHT * own[1]
    lit = (after / strength + floor) / (before + floor)
    mirrored = new.colours[1] / strength / own[1]
    relit = recolour_gaussians(gaussians, (1 - mirrors) * lit + mirrors * mirrored, np.zeros((1, 3)))
    return replace(relit, light=None), after / strength, strength
