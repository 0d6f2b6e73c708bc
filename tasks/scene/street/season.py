"""Sun and season of a street by its place, day and hour."""

from dataclasses import dataclass

import numpy as np

from tasks.scene.street.noise import named_generator

Range = tuple[float, float]
Colour = tuple[float, float, float]

_TILT_DEG = 23.44
_LOWEST_SUN_DEG = 6.0
"""A lower sun hides behind houses and trees; the street then has the light of this elevation [deg]."""
_OPTICAL_DEPTH = np.array([0.10, 0.16, 0.28])
"""Of clear air at the zenith for red, green and blue: Rayleigh and a little haze; declared [1]."""
_REFERENCE_ELEVATION_DEG = 46.0
"""Of the light in street.yaml [deg]."""
_ADAPTATION = 0.75
"""Share of the change of light, in stops, that the camera's exposure takes up [1]."""


@dataclass(frozen=True, kw_only=True)
class SeasonRanges:
    """What a seed draws sun and season from; each number lies between two.

    Parameters
    ----------
    latitude : of the place, north positive [deg]
    day : of the year; those of winter follow 365 [d]
    daylight : share of the way from sunrise to sunset [1]
    road_azimuth : direction of the road at its start, from north clockwise [deg]
    """

    latitude: Range
    day: Range
    daylight: Range
    road_azimuth: Range


def draw_season(ranges: SeasonRanges, seed: int) -> dict[str, float]:
    """Draw sun and season; return them as fields of `StreetLayout`.

    Parameters
    ----------
    ranges : of its numbers
    seed : the street's seed [1]
    """
    rng = named_generator(seed, "season")
    latitude, day = rng.uniform(*ranges.latitude), rng.uniform(*ranges.day) % 365
    azimuth, elevation = find_sun(latitude, day, rng.uniform(*ranges.daylight))
    # a street's sun is counted from its start heading to the left
    from_road = (rng.uniform(*ranges.road_azimuth) - azimuth + 180.0) % 360.0 - 180.0
    return {
        "sun_azimuth_deg": float(from_road),
        "sun_elevation_deg": float(max(elevation, _LOWEST_SUN_DEG)),
        **{
            name: float(value)
            for name, value in find_foliage(day if latitude > 0 else (day + 182) % 365).items()
        },
    }


def find_sun(latitude_deg: float, day: float, daylight: float) -> tuple[float, float]:
    """Return azimuth, from north clockwise, and elevation of the sun [deg].

    Parameters
    ----------
    latitude_deg : of the place [deg]
    day : of the year [d]
    daylight : share of the way from sunrise to sunset [1]
    """
    latitude = np.radians(latitude_deg)
    declination = -np.radians(_TILT_DEG) * np.cos(2 * np.pi * (day + 10) / 365)
    sunset = np.arccos(np.clip(-np.tan(latitude) * np.tan(declination), -1, 1))
    hour = (2 * daylight - 1) * sunset
    up = np.sin(latitude) * np.sin(declination) + np.cos(latitude) * np.cos(declination) * np.cos(hour)
    east = -np.cos(declination) * np.sin(hour)
    north = np.cos(latitude) * np.sin(declination) - np.sin(latitude) * np.cos(declination) * np.cos(hour)
    return float(np.degrees(np.arctan2(east, north)) % 360), float(np.degrees(np.arcsin(up)))


def find_foliage(day: float) -> dict[str, float]:
    """Return the shares of leaves, of autumn colour and of dead grass on a day [d] of the northern year [1]."""
    days = (0, 95, 125, 270, 300, 330, 365)
    return {
        "leaf_share": float(np.interp(day, days, (0.0, 0.0, 1.0, 1.0, 0.75, 0.0, 0.0))),
        "autumn_share": float(np.interp(day, (255, 295, 330), (0.0, 0.9, 1.0))) if day > 180 else 0.0,
        "dead_grass_share": float(
            np.interp(day, (0, 80, 120, 220, 330, 365), (0.75, 0.6, 0.0, 0.35, 0.6, 0.75))
        ),
    }


def light_of(
    elevation_deg: float, sun_rgb: Colour, sky_rgb: Colour, bounce_rgb: Colour
) -> tuple[Colour, Colour, Colour]:
    """Return the light of sun, sky and surroundings at an elevation, from that at `_REFERENCE_ELEVATION_DEG`.

    The air takes from the sun by its optical mass (Kasten and Young 1989); the camera's exposure follows in part.

    Parameters
    ----------
    elevation_deg : of the sun [deg]
    sun_rgb, sky_rgb, bounce_rgb : as of `StreetLayout`, linear light [1]
    """
    sun, sky, bounce = (np.array(colour) for colour in (sun_rgb, sky_rgb, bounce_rgb))
    mass, reference = (
        1 / (np.sin(np.radians(h)) + 0.50572 * (h + 6.07995) ** -1.6364)
        for h in (elevation_deg, _REFERENCE_ELEVATION_DEG)
    )
    high, before = (np.sin(np.radians(h)) for h in (elevation_deg, _REFERENCE_ELEVATION_DEG))
    beam = sun * np.exp(-_OPTICAL_DEPTH * (mass - reference))
    dome = sky * (0.45 + 0.55 * high / before)
    around = bounce * (beam * high + dome) / (sun * before + sky)
    gain = float(((sun * before + sky).mean() / (beam * high + dome).mean()) ** _ADAPTATION)
    red, green, blue = zip(beam * gain, dome * gain, around * gain, strict=True)
    return tuple(zip(map(float, red), map(float, green), map(float, blue), strict=True))  # type: ignore[return-value]
