"""A small dashcam, the same with a rolling shutter, and with lens and motion blur too."""

from dataclasses import replace

import numpy as np

from catalogs.entries import load
from tasks.render.lens import Lens

K = np.array([[200.0, 0, 120], [0, 200, 80], [0, 0, 1]])
LENS = Lens(k1=-0.25, k2=0.05, p1=1e-3, p2=-5e-4)
CAMERA = replace(load("camera", "dashcam-480x320"), width=240, height=160, K=K, exposure_s=0.01)
ROLLING = replace(CAMERA, line_delay_s=1.5e-4)
ALL = replace(ROLLING, lens=LENS, motion_blur=True)
