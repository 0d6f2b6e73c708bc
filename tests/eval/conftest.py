"""Clips with known motion, rendered once for all judges."""

import pytest

from studies.synthetic_street import Clip, drive_clip

SMALL = {"width": 240, "height": 160, "focal": 200.0}


@pytest.fixture(scope="session")
def full_clip() -> Clip:
    """1.5 s at 40 km/h over a hump at 480 x 320 px, the size that the allowances are stated for."""
    return drive_clip(frames=24, frame_rate=16.0, hump_at=0.2)


@pytest.fixture(scope="session")
def hump_clip() -> Clip:
    """The same drive, seen at half that size."""
    return drive_clip(frames=24, frame_rate=16.0, hump_at=0.2, **SMALL)


@pytest.fixture(scope="session")
def stop_clip() -> Clip:
    """From 20 km/h to a stand, with a dive and its release."""
    return drive_clip(
        frames=26, frame_rate=10.0, speed=20 / 3.6, deceleration=6.0, hump_at=9.0, seed=5, **SMALL
    )


@pytest.fixture(scope="session")
def bend_clip() -> Clip:
    """A bend of 80 m radius to the left with a hump in it."""
    return drive_clip(frames=16, frame_rate=16.0, curvature=1 / 80, hump_at=0.2, seed=9, **SMALL)
