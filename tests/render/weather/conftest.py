"""A camera over a flat road, and the weather catalogue."""

import numpy as np
import pytest

from catalogs.weather.look import load_weather
from tasks.render.weather.falling.particles import Shutter
from tasks.render.weather.parameters import WeatherParameters

WIDTH, HEIGHT, FOCAL = 480, 320, 400.0
EYE_HEIGHT = 1.4


@pytest.fixture(scope="session")
def parameters() -> WeatherParameters:
    """The shipped catalogue."""
    return load_weather()


def shutter(
    time_s: float = 2.0,
    exposure_s: float = 0.01,
    speed: float = 0.0,
    x: float = 0.0,
    width: int = WIDTH,
    height: int = HEIGHT,
    focal: float = FOCAL,
) -> Shutter:
    """A camera 1.4 m over the world's origin that looks along +x and drives that way."""
    pose = np.eye(4)
    pose[:3, :3] = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
    pose[:3, 3] = (x, 0.0, EYE_HEIGHT)
    K = np.array([[focal, 0.0, width / 2], [0.0, focal, height / 2], [0.0, 0.0, 1.0]])
    return Shutter(
        T_world_camera=pose, K=K, width=width, height=height, velocity=np.array([speed, 0.0, 0.0]),
        time_s=time_s, exposure_s=exposure_s,
    )  # fmt: skip
