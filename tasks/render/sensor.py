"""The camera's sensor: exposure, photon noise and read noise; without noise by default."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tasks.render.weather.random_streams import stream_key


@dataclass(frozen=True, kw_only=True)
class Sensor:
    """A linear sensor.

    Parameters
    ----------
    exposure_ev : exposure over that of the clear clip, in steps of 2 [EV]
    full_well : electrons of a pixel at the brightest value; None for a sensor without noise [e-]
    read_noise : standard deviation of the noise that reading a pixel adds [e-]
    """

    exposure_ev: float = 0.0
    full_well: float | None = None
    read_noise: float = 0.0


def apply_sensor(picture: NDArray[np.float32], sensor: Sensor, seed: int, frame: int) -> NDArray[np.float32]:
    """Return the light that the sensor records.

    Photons arrive by Poisson's law, here its normal limit, so that a pixel of N electrons has a variance of
    N + read noise squared (EMVA Standard 1288, release 4.0, 2021, section 2).

    Parameters
    ----------
    picture : float32 [H, W, 3] linear light, 1 the brightest value [1]
    sensor : the sensor
    seed : visual seed of the clip [1]
    frame : frame number; a frame drawn alone has the noise it has in sequence [1]

    Returns
    -------
    float32 [H, W, 3] linear light; the same array where the sensor leaves it alone
    """
    exposed = picture if sensor.exposure_ev == 0 else picture * np.float32(2**sensor.exposure_ev)
    if sensor.full_well is None:
        return exposed
    # light above the full well is clipped before it is read
    electrons = np.clip(exposed, 0, 1) * np.float32(sensor.full_well)
    random = np.random.Generator(np.random.Philox(key=[stream_key(seed, "sensor"), frame]))
    noise = random.standard_normal(picture.shape, dtype=np.float32)
    spread = np.sqrt(electrons + np.float32(sensor.read_noise**2))
    return (electrons + spread * noise) / np.float32(sensor.full_well)
