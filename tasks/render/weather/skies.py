"""The sun and the kinds of sky that it shines from: which one a clip has, and what it gives a street."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tasks.render.composition import LUMINANCE
from tasks.render.weather.named_sky import SKY_NAMES, NamedSky
from tasks.render.weather.random_streams import unit_number


@dataclass(frozen=True, kw_only=True)
class SkyKind:
    """One kind of sky.

    Parameters
    ----------
    share : weight in the draw of dry weather's sky [1]
    sun_share : share of a clear sky's sunlight that reaches the ground [1]
    cloud_cover : share of the sky that cloud covers [1]
    visual_range_m : meteorological optical range of its air [m]
    lowest_sun_deg, highest_sun_deg : heights between which its sun is drawn [deg]
    """

    share: float
    sun_share: float
    cloud_cover: float
    visual_range_m: float
    lowest_sun_deg: float
    highest_sun_deg: float


@dataclass(frozen=True, kw_only=True)
class Skies:
    """The kinds of sky, of ``SKY_NAMES``."""

    clear: SkyKind
    scattered: SkyKind
    overcast: SkyKind
    low_sun: SkyKind
    haze: SkyKind


@dataclass(frozen=True, kw_only=True)
class SunParameters:
    """The sun's light on its way through the air.

    Parameters
    ----------
    optical_depth : of the clear air above, red, green, blue [1]
    skylight_power : the clear sky's light goes with this power of the sine of the sun's height [1]
    surroundings_by_sky : radiance of walls and trees by that of the sky, under cloud [1]
    """

    optical_depth: tuple[float, float, float]
    skylight_power: float
    surroundings_by_sky: float


@dataclass(frozen=True, kw_only=True)
class Daylight:
    """The light of a clip before its weather.

    Parameters
    ----------
    name : of the kind of sky
    kind : that kind
    to_sun : [3] unit vector to the sun, world frame [1]
    colours : float64 [3, 3] of the sun on what faces it, of the sky and of the surroundings, as `Scene.daylight` [1]
    skylight : radiance of the clear sky by that under the street's own sun [1]
    """

    name: str
    kind: SkyKind
    to_sun: NDArray[np.float64]
    colours: NDArray[np.float64]
    skylight: float

    @property
    def has_sun(self) -> bool:
        """Whether the sun casts shadows."""
        return self.kind.sun_share > 0


def draw_sky_kind(skies: Skies, seed: int) -> str:
    """Return the name of the sky that a visual seed gives dry weather.

    Parameters
    ----------
    skies : with their shares
    seed : visual seed of the clip [1]
    """
    shares = np.cumsum([getattr(skies, name).share for name in SKY_NAMES])
    return SKY_NAMES[int(np.searchsorted(shares, unit_number(seed, "sky") * shares[-1], side="right"))]


def draw_sun(kind: SkyKind, seed: int, named: NamedSky) -> NDArray[np.float64]:
    """Return the unit vector [3] to the sun, of whose angles a visual seed draws those that are not named.

    Parameters
    ----------
    kind : gives the heights
    seed : visual seed of the clip [1]
    named : what is said of the sky
    """
    azimuth, height = named.sun_azimuth_deg, named.sun_elevation_deg
    if azimuth is None:
        azimuth = 360 * unit_number(seed, "sun azimuth")
    if height is None:
        span = kind.highest_sun_deg - kind.lowest_sun_deg
        height = kind.lowest_sun_deg + span * unit_number(seed, "sun height")
    return point_to_sun(azimuth, height)


def point_to_sun(azimuth_deg: float, height_deg: float) -> NDArray[np.float64]:
    """Return the unit vector [3] to a sun, world frame.

    Parameters
    ----------
    azimuth_deg : from world +x towards +y [deg]
    height_deg : above the horizon [deg]
    """
    azimuth, height = np.radians((azimuth_deg, height_deg))
    return np.array((np.cos(height) * np.cos(azimuth), np.cos(height) * np.sin(azimuth), np.sin(height)))


def air_mass(to_sun: NDArray[np.floating]) -> float:
    """Return the length of the sun's way through the air by that from the zenith.

    Parameters
    ----------
    to_sun : [3] unit vector [1]

    References
    ----------
    Kasten & Young 1989, doi:10.1364/AO.28.004735.
    """
    height = float(np.degrees(np.arcsin(np.clip(to_sun[2], 0, 1))))
    return 1 / (np.sin(np.radians(height)) + 0.50572 * (height + 6.07995) ** -1.6364)


def light_of_sky(
    name: str,
    kind: SkyKind,
    to_sun: NDArray[np.float64],
    own: NDArray[np.float64],
    own_sun: NDArray[np.float64],
    p: SunParameters,
    transmittance: float,
) -> Daylight:
    """Return the light of a kind of sky over a street whose clear light is known.

    Parameters
    ----------
    name, kind : the sky
    to_sun : [3] unit vector to its sun [1]
    own : float64 [3, 3] colours of the street's own clear light, see `Daylight` [1]
    own_sun : [3] unit vector to its sun [1]
    p : how the sun's light comes through the air
    transmittance : light under closed cloud by light under a clear sky [1]
    """
    sun = own[0] * np.exp(-np.array(p.optical_depth) * (air_mass(to_sun) - air_mass(own_sun)))
    lower = (to_sun[2] / own_sun[2]) ** p.skylight_power
    if kind.sun_share == 0:
        # cloud has no colour of its own
        sky = np.full(3, transmittance * float(LUMINANCE @ (own[0] * own_sun[2] + own[1])))
        colours = np.stack((0 * sun, sky, p.surroundings_by_sky * sky))
        return Daylight(name=name, kind=kind, to_sun=to_sun, colours=colours, skylight=lower)
    # what haze or cloud takes from the sun's light, the sky sends down in part
    scattered = 0.5 * (1 - kind.sun_share) * sun * to_sun[2]
    sun = kind.sun_share * sun
    sky = own[1] * lower + scattered
    falling, before = sun * to_sun[2] + sky, own[0] * own_sun[2] + own[1]
    colours = np.stack((sun, sky, own[2] * falling / before))
    return Daylight(name=name, kind=kind, to_sun=to_sun, colours=colours, skylight=lower)
