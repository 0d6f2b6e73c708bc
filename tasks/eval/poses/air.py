"""The veil of the air: how dense it is, from pictures with depth, and pictures from which it is taken away.

Light L of a surface at range r reaches the camera as L t + A (1 - t), with the transmittance t = exp(-extinction r)
and A the light of the air, which is that of the sky at the horizon (Koschmieder 1924). A surface that comes nearer
loses veil, so its grey changes from frame to frame, and an alignment of grey levels takes that for motion.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tasks.eval.poses.rigid import Floats

LEAST_EXTINCTION = 1e-3
"""Extinction below which the air counts as clear, a visual range of 3 km: across a street that veils a few percent,
and textures that lose contrast with distance look as much [1/m]."""
LEAST_SKY = 100
"""Fewest pixels that show the light of the air [px]."""
LEAST_EVENNESS = 0.8
"""Least 5th over 95th percentile of the sky's light: a clear sky is uneven (.4 to .6 on our streets), and so is what
shows through holes of a scene; one of thick air is not (.98) [1]."""
FIT_PASSES = 10
"""Weighted solutions one after the other [1]."""

_BYTES = np.arange(256) / 255
LINEAR_LIGHT = np.where(_BYTES <= 0.04045, _BYTES / 12.92, ((_BYTES + 0.055) / 1.055) ** 2.4).astype(
    np.float32
)
"""Linear light of each 8-bit grey level (IEC 61966-2-1) [1]."""


@dataclass(frozen=True, kw_only=True)
class Air:
    """The air of a clip.

    Parameters
    ----------
    extinction : extinction coefficient [1/m]
    light : linear light of the air [1]
    """

    extinction: float
    light: float


def convert_to_linear_light(grey: NDArray[np.float32]) -> Floats:
    """Return the linear light [N] of grey levels [N] between two bytes [1]."""
    return np.interp(grey, np.arange(256), LINEAR_LIGHT)


def measure_sky_light(greys: NDArray[np.uint8], depth: NDArray[np.float32]) -> float | None:
    """Return the median linear light of what has no depth, the sky; None where too little of it shows or it is uneven.

    Parameters
    ----------
    greys : uint8 [..., H, W] grey levels [1]
    depth : float32 [..., H, W] camera z, NaN where there is nothing [m]
    """
    sky = LINEAR_LIGHT[greys[~np.isfinite(depth)]]
    if len(sky) < LEAST_SKY:
        return None
    dark, middle, bright = np.percentile(sky, [5, 50, 95])
    return float(middle) if dark >= LEAST_EVENNESS * bright else None


def fit_extinction(far: Floats, near: Floats, nearing: Floats, light: float) -> float:
    """Return the extinction that explains by how much surfaces darken or brighten as they come nearer [1/m].

    To second order in the optical depth, ``far - near = extinction nearing (light - (far + near) / 2)``; solved by
    least squares with Tukey's weights.

    Parameters
    ----------
    far, near : float64 [N] linear light of surfaces, seen from afar and from nearer by [1]
    nearing : float64 [N] way by which each came nearer [m]
    light : linear light of the air [1]
    """
    per_extinction, change = nearing * (light - (far + near) / 2), far - near
    weight = np.ones(len(change))
    extinction = 0.0
    for _ in range(FIT_PASSES):
        weighted = weight * per_extinction
        if (norm := float(weighted @ per_extinction)) == 0.0:
            return 0.0
        extinction = float(weighted @ change) / norm
        left = change - extinction * per_extinction
        scale = 1.4826 * float(np.median(np.abs(left))) + 1e-9
        weight = np.maximum(1 - (left / (4.685 * scale)) ** 2, 0) ** 2
    return extinction


def take_air_away(
    grey: NDArray[np.uint8], depth: NDArray[np.float32], K: Floats, air: Air
) -> NDArray[np.float32]:
    """Return a picture as it would be without the veil, float32 [H, W], black 0 and white 255 [1].

    A square root stands for the tone curve. Pixels without depth stay as bright as they are.

    Parameters
    ----------
    grey : uint8 [H, W] grey levels [1]
    depth : float32 [H, W] camera z, NaN where there is nothing [m]
    K : float64 [3, 3] intrinsics, pixel centres at whole numbers [px]
    air : the air
    """
    height, width = grey.shape
    across = ((np.arange(width) - K[0, 2]) / K[0, 0]).astype(np.float32)
    down = ((np.arange(height) - K[1, 2]) / K[1, 1]).astype(np.float32)
    optical_depth = np.sqrt(1 + across**2 + down[:, None] ** 2) * np.nan_to_num(depth, posinf=0.0)
    optical_depth *= np.float32(air.extinction)
    light = np.float32(air.light)
    clear = light - (light - LINEAR_LIGHT[grey]) * np.exp(optical_depth)
    return np.float32(255) * np.sqrt(np.clip(clear, 0, 1))
