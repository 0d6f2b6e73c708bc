"""The kinds of sky by name, and what a scenario may say of the sky over it."""

from dataclasses import dataclass

OVERCAST = "overcast"
"""The sky from which rain and snow fall."""
SKY_NAMES = ("clear", "scattered", OVERCAST, "low_sun", "haze")


@dataclass(frozen=True, kw_only=True)
class NamedSky:
    """What a scenario says of sky and sun; None leaves it to the visual seed.

    Parameters
    ----------
    kind : name of the kind of sky
    sun_azimuth_deg : of the sun, from world +x towards +y [deg]
    sun_elevation_deg : of the sun above the horizon [deg]
    """

    kind: str | None = None
    sun_azimuth_deg: float | None = None
    sun_elevation_deg: float | None = None


ANY_SKY = NamedSky()
