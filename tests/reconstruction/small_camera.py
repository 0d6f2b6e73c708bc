"""A small stereo camera, and something for it to see."""

import numpy as np

F, CX, CY, BASELINE = 200.0, 80.0, 50.0, 0.5
K = np.array([[F, 0, CX], [0, F, CY], [0, 0, 1]])
SCALE = F * BASELINE
SHAPE = (110, 160)


def draw_smooth_noise(shape: tuple[int, int], seed: int) -> np.ndarray:
    """Periodic picture with detail at a few pixels."""
    draw = np.random.Generator(np.random.Philox(seed))
    spectrum = np.fft.rfft2(draw.normal(size=shape))
    radius = np.hypot(np.fft.fftfreq(shape[0])[:, None], np.fft.rfftfreq(shape[1])[None])
    picture = np.fft.irfft2(spectrum * np.exp(-((radius / 0.15) ** 2)), shape)
    return 128 + 45 * picture / picture.std()
