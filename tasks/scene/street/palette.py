"""Colours of the street, as linear reflectance. They are taste, not data: muted, and never brighter than chalk."""

import numpy as np
from numpy.typing import NDArray


def _linear(*colours: str) -> NDArray[np.float64]:
    """Linear light of sRGB colours written #rrggbb (IEC 61966-2-1); float64 [len(colours), 3] [1]."""
    code = np.array([[int(c[k : k + 2], 16) for k in (1, 3, 5)] for c in colours]) / 255
    return np.where(code <= 0.04045, code / 12.92, ((code + 0.055) / 1.055) ** 2.4)


PLASTER = _linear("#c9b48e", "#c8bfae", "#b98a68", "#a8b0ae", "#bfa27a", "#b8a9a0", "#cfc3a0", "#9fae9f", "#c49a84")
BRICK = _linear("#8a4f3b", "#7d4a3c", "#96604a", "#6f4a40")
PLINTH = _linear("#6f6a64")[0]
TRIM = _linear("#d6cfc0", "#c7c0b4", "#ddd8cc", "#b9aa92")
FRAMES = _linear("#e2e0da", "#dcd8ce", "#4a3a2e", "#2f3a40", "#e6e4de")
DOORS = _linear("#5a2f22", "#24423a", "#2a3550", "#3c3a38", "#6b4a2c")
SHOP_SIGNS = _linear("#8c2f2a", "#1f4e4a", "#23406e", "#3a3a3c", "#b07a24", "#5c2b4e")
AWNINGS = _linear("#9c3a32", "#2f6152", "#3b5b8c", "#c08a3a")
CURTAIN = _linear("#c9c4b8")[0]
DARK_ROOM = _linear("#2b2d30")[0]
ROOF_TILES = _linear("#7f4a38", "#6d4439", "#54525a", "#4b4e55")
METAL_DARK = _linear("#3b4043")[0]
METAL_GREY = _linear("#7b8084")[0]
"""Zinc, galvanised steel."""
BARK = _linear("#5d5145")[0]
FOLIAGE = _linear("#5f7d33", "#557a35", "#6c8438", "#4f7238", "#788a3c")
HEDGE = _linear("#46632e")[0]
EARTH = _linear("#5b4a3a")[0]
GRASS = _linear("#6a7c40")[0]
CAR_PAINT = _linear("#d9d9d6", "#a7aaad", "#55595e", "#1c1e22", "#23406b", "#8c1f1d", "#6f7d86", "#c9c2b2", "#2f4a3f")
TYRE = _linear("#222223")[0]
RIM = _linear("#a3a6a8")[0]
PLASTIC = _linear("#2a2b2d")[0]
TAIL_LIGHT = _linear("#a81a18")[0]
HEAD_LIGHT = _linear("#d8dde0")[0]
NUMBER_PLATE = _linear("#d9d6c4")[0]
WHITE_PAINT = _linear("#dddcd6")[0]
SIGN_BLUE = _linear("#1d4f9c")[0]
SIGN_RED = _linear("#b3201f")[0]
POST_YELLOW = _linear("#d9a514")[0]
BIN_GREEN = _linear("#2f4b3c")[0]
WOOD = _linear("#8a6240")[0]
