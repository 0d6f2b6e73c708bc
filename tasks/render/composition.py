"""Composition of blended buffers to a finished picture, in linear light until the last step."""

import numpy as np
from numpy.typing import NDArray

from tasks.render.pixels import find_namespace
from tasks.render.rasterise.gbuffer import GBuffer

LUMINANCE = np.array((0.2126, 0.7152, 0.0722))
"""Linear sRGB to luminance (IEC 61966-2-1)."""

DEPTH_BITS_DROPPED = 10
"""Number of the 23 explicit mantissa bits that are dropped; 13 stay, a relative error below 6.2e-5."""


def to_linear(display: NDArray[np.float32]) -> NDArray[np.float32]:
    """Convert sRGB-encoded values in [0, 1] to linear light (IEC 61966-2-1); negative values become 0."""
    xp = find_namespace(display)
    x = xp.clip(display, 0, None)
    return xp.asarray(xp.where(x <= 0.04045, x / 12.92, ((x + 0.055) / 1.055) ** 2.4), dtype=xp.float32)


def to_display(linear: NDArray[np.float32]) -> NDArray[np.float32]:
    """Convert linear light, clipped to [0, 1], to sRGB-encoded values (IEC 61966-2-1)."""
    xp = find_namespace(linear)
    x = xp.clip(linear, 0, 1)
    return xp.asarray(xp.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055), dtype=xp.float32)


def compose_over_sky(
    gbuffer: GBuffer, environment_rgb: NDArray[np.float32], display_encoded: bool
) -> NDArray[np.float32]:
    """Compose the Gaussians over the sky, in linear light.

    Parameters
    ----------
    gbuffer : one rasterised view
    environment_rgb : float32 [H, W, 3] the sky of the same view, linear [1]
    display_encoded : the Gaussians blend in display space; the blend is linearised afterwards

    Returns
    -------
    float32 [H, W, 3] linear [1]
    """
    behind = (1 - gbuffer.alpha)[..., None]
    if display_encoded:
        return to_linear(gbuffer.rgb + behind * to_display(environment_rgb))
    return gbuffer.rgb + behind * environment_rgb


def encode_8bit(linear: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Return the sRGB bytes of a linear picture, rounded half to even, without dither."""
    return np.rint(to_display(linear) * np.float32(255)).astype(np.uint8)


def round_depth(depth: NDArray[np.float32]) -> NDArray[np.float32]:
    """Round depth to 13 mantissa bits, so that it compresses; NaN stays NaN.

    Parameters
    ----------
    depth : float32 [H, W] positive or NaN [m]
    """
    xp = find_namespace(depth)
    bits = depth.view(xp.int32)
    rounded = (bits + (1 << (DEPTH_BITS_DROPPED - 1))) & ~((1 << DEPTH_BITS_DROPPED) - 1)
    return xp.where(xp.isnan(depth), xp.nan, rounded.view(xp.float32))
