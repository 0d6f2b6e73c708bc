"""A drivable street: Gaussians, the route through them, the environment beyond them, and the sun."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tasks.scene.gaussians import Gaussians
from tasks.scene.route import Route

NARROWEST_LANE_M = 2.5
"""Least distance between the middles of two lanes [m]: RASt 06, carriageways of 4.75 m and more take two cars."""
LOWEST_SUN_DEG = 1.0
"""A lower sun gives the flat road less than a fiftieth of its light, which cannot be measured on the road [deg]."""


@dataclass(frozen=True, kw_only=True)
class Scene:
    """One reconstructed or generated street.

    Parameters
    ----------
    name : catalogue or folder name
    gaussians : the street itself
    route : P_0, the reference route of the rig
    environment : float32 [H, W, 3] linear light of the sky and far field, equirectangular:
        row 0 zenith, last row nadir; column centre = world +x, leftward columns toward +y [1]
    carriageway_left, carriageway_right : lateral extent of the carriageway from the route [m],
        left positive (y left): ``carriageway_right < 0 < carriageway_left``
    sun_direction_deg : azimuth and elevation of a sun that the panorama does not show; azimuth from world +x, the
        direction of travel where a reconstruction begins, towards +y; None leaves it to the panorama [deg]
    daylight : colours, linear red, green and blue, of the three parts of the light that `Gaussians.light` counts:
        irradiance over pi of the sun on a surface that faces it, of the whole sky, radiance of the surroundings [1];
        None where that light is not known
    """

    name: str
    gaussians: Gaussians
    route: Route
    environment: NDArray[np.float32]
    carriageway_left: float
    carriageway_right: float
    sun_direction_deg: tuple[float, float] | None = None
    daylight: tuple[tuple[float, float, float], ...] | None = None

    @property
    def lanes(self) -> tuple[float, ...]:
        """Lateral positions of the lanes: the route's own, and the one on the other side of the carriageway's middle
        where the carriageway is wide enough for it [m]."""
        other = self.carriageway_left + self.carriageway_right
        return (0.0, other) if abs(other) >= NARROWEST_LANE_M else (0.0,)

    @property
    def to_sun(self) -> NDArray[np.float64] | None:
        """Unit vector to that sun, world frame, float64 [3] [1]."""
        if self.sun_direction_deg is None:
            return None
        azimuth, elevation = np.radians(self.sun_direction_deg)
        flat = np.cos(elevation)
        return np.array((flat * np.cos(azimuth), flat * np.sin(azimuth), np.sin(elevation)))


def find_sun_problems(sun_direction_deg: tuple[float, float] | None) -> list[str]:
    """Return the problems of a sun's azimuth and elevation [deg], one sentence each; empty when there are none."""
    if sun_direction_deg is None or (
        np.isfinite(sun_direction_deg).all() and LOWEST_SUN_DEG <= sun_direction_deg[1] <= 90
    ):
        return []
    return [
        f"sun: azimuth must be finite and elevation {LOWEST_SUN_DEG:g} to 90 deg;"
        f" they are {sun_direction_deg[0]:g} and {sun_direction_deg[1]:g}"
    ]


def mix_daylight(light: NDArray[np.floating], daylight: ArrayLike) -> NDArray[np.float64]:
    """Return the light on Gaussians: radiance of a white surface in place of each, float64 [N, 3] [1].

    Parameters
    ----------
    light : [N, 3 or more] as `Gaussians.light` [1]
    daylight : [3, 3] as `Scene.daylight` [1]
    """
    sun, sky, around = np.asarray(daylight, dtype=np.float64)
    # three by three by hand: a BLAS rounds as its processor likes
    a, b, c = np.asarray(light, dtype=np.float64).T[:3, :, None]
    return a * sun + b * sky + c * around
