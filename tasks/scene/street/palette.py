"""Colours of the street, as linear reflectance. They are chosen, not measured, and never brighter than chalk."""

import numpy as np
from numpy.typing import NDArray

from tasks.scene.street.noise import named_generator


def _linear_light(*colours: str) -> NDArray[np.float64]:
    """Return the linear light of sRGB colours written #rrggbb (IEC 61966-2-1); float64 [len(colours), 3] [1]."""
    code = np.array([[int(c[k : k + 2], 16) for k in (1, 3, 5)] for c in colours]) / 255
    return np.where(code <= 0.04045, code / 12.92, ((code + 0.055) / 1.055) ** 2.4)


PLASTER = _linear_light(
    "#cabb9e",
    "#cfc8bb",
    "#b79a84",
    "#b3b7b4",
    "#c2ae8f",
    "#bfb2a8",
    "#d6ceb8",
    "#a9b3a8",
    "#c6a894",
    "#d9d5cb",
)
BRICK = _linear_light("#85584a", "#785046", "#93695a", "#6f5048", "#a07a62")
PLINTH = _linear_light("#6f6a64")[0]
TRIM = _linear_light("#d6cfc0", "#c7c0b4", "#ddd8cc", "#b9aa92")
FRAMES = _linear_light("#e2e0da", "#dcd8ce", "#4a3a2e", "#2f3a40", "#e6e4de")
DOORS = _linear_light("#5a2f22", "#24423a", "#2a3550", "#3c3a38", "#6b4a2c")
SHOP_SIGNS = _linear_light("#7d3a34", "#2a4e4a", "#33486a", "#3a3a3c", "#8a6a3a", "#54394e")
AWNINGS = _linear_light("#93443c", "#3c6355", "#47608a", "#b5894c")
CURTAIN = _linear_light("#c9c4b8")[0]
DARK_ROOM = _linear_light("#2b2d30")[0]
ROOF_TILES = _linear_light("#7c5446", "#6d4d42", "#56545a", "#4d5056")
METAL_DARK = _linear_light("#3b4043")[0]
METAL_GREY = _linear_light("#7b8084")[0]
"""Zinc, galvanised steel."""
BARK = _linear_light("#5d5145")[0]
FOLIAGE = _linear_light("#566e33", "#4d6a33", "#5f7438", "#476338", "#677a3c")
FLOWERS = _linear_light("#a8324a", "#c46a8c", "#c9a23a", "#b8452e")
HEDGE = _linear_light("#46632e")[0]
SOILS = _linear_light("#8c745a", "#98725c", "#b3a184", "#96918a", "#6f6050", "#a18d6e", "#7c766e")
"""Loam, red earth, sand, gravel of limestone, dark earth, clay, gravel of basalt."""
EARTH = _linear_light("#5b4a3a")[0]
GRASS = _linear_light("#6a7c40")[0]
FIELDS = _linear_light("#7d8a46", "#a39a5c", "#6b5a45", "#5f7a3c", "#b5a66a", "#8a7a56")
"""Meadow, ripe grain, ploughed earth, beet, stubble, fallow."""
CAR_PAINT = _linear_light(
    "#c2c2c0",
    "#979b9f",
    "#55595e",
    "#1d1f23",
    "#2a4468",
    "#7d2422",
    "#6f7d86",
    "#bdb6a6",
    "#34493f",
    "#b4b7b8",
)
TYRE = _linear_light("#222223")[0]
HEAD_LIGHT = _linear_light("#d8dde0")[0]
WHITE_PAINT = _linear_light("#dddcd6")[0]
ZINC = _linear_light("#9ea3a5")[0]
SIGN_RED = _linear_light("#b01c22")[0]
SIGN_YELLOW = _linear_light("#e3bd2a")[0]
FENCES = _linear_light("#c9c6bd", "#7a5f45", "#8f8a80", "#4f5a4a", "#a08a68")
CLADDING = _linear_light("#a9afb3", "#8c9499", "#c3c4c0", "#5c6b7a", "#9a8f7a", "#6e7f72", "#b5b0a2")
LITTER = _linear_light("#7a5c3e")[0]
"""Dead leaves on the ground of a wood."""
DEAD_GRASS = _linear_light("#9c9064")[0]
AUTUMN = _linear_light("#a8742c", "#8f4d24", "#b99a35", "#7d6a30", "#9c5a2a")
SIGN_BLUE = _linear_light("#1d4f9c")[0]
POST_YELLOW = _linear_light("#d9a514")[0]
BIN_GREEN = _linear_light("#2f4b3c")[0]
ASPHALT = np.array([0.112, 0.108, 0.103])
PAINT = np.array([0.50, 0.50, 0.475])
YELLOW_PAINT = np.array([0.46, 0.30, 0.04])
BITUMEN = np.array([0.035, 0.034, 0.034])
IRON = np.array([0.075, 0.066, 0.058])
FALLEN = np.array([[0.20, 0.13, 0.03], [0.13, 0.14, 0.03], [0.22, 0.09, 0.02]])
"""Single leaves on the road."""


def choose_soil(seed: int) -> NDArray[np.float64]:
    """Return the soil of a street: what lies bare beside it and drifts onto it; [3] [1].

    Parameters
    ----------
    seed : the street's seed [1]
    """
    return SOILS[named_generator(seed, "soil").integers(len(SOILS))]
