"""Grain of road, paving, walls and earth that is finer than a disc, drawn at every pixel that resolves it.

The discs of a generated street carry its colours down to some pixels of a 480x320 picture. Closer by, and with a longer
focal length, the camera sees more: stones, sand, roughcast. Band-limited noise that is fixed to the world's coordinates
modulates the blended colour there. Each octave fades in between two and four pixels a wave. Ground that is seen at a
flat angle shows the mean over the length that a pixel covers there: no picture aliases, so that grain moves as the
world does. A pixel's cost does not depend on the street.
"""

from dataclasses import replace
from math import ceil, floor, sqrt

import numba
import numpy as np
from numpy.typing import NDArray

from tasks.conventions import SemanticClass
from tasks.render.pixels import INLINED, LAW, find_namespace, run_on_either
from tasks.render.rasterise.gbuffer import GBuffer

WAVES = np.array([0.008, 0.016, 0.032, 0.064, 0.128])
"""Wavelengths of the octaves [m]."""
DEVIATION = {
    SemanticClass.ROAD: 0.12,
    SemanticClass.MARKING: 0.05,
    SemanticClass.KERB: 0.06,
    SemanticClass.SIDEWALK: 0.06,
    SemanticClass.BUILDING: 0.045,
    SemanticClass.TERRAIN: 0.16,
}
"""Relative deviation of the reflectance by one octave; declared, after photographs of dense asphalt and plaster [1]."""
BRIGHTEST = 0.5
"""Linear light from which nothing shows: lying snow is smooth [1]."""
_TILE = 256
_LAST = _TILE - 1
_TEXELS_A_WAVE = 3.0
_PIXELS_A_WAVE = 2.0
_SAMPLES_A_WAVE = 3.0
"""Samples of a wave over the length that a pixel covers: two are the least that show it [1]."""
_TEXELS, _RESOLVED, _SAMPLES = _TEXELS_A_WAVE / WAVES, WAVES / _PIXELS_A_WAVE, _SAMPLES_A_WAVE / WAVES
_WALL_FACING = 0.25
"""Sine of the angle under which walls along a street are seen: flatter ones show no grain within this share [1]."""
_UPRIGHT = np.arange(256) == SemanticClass.BUILDING
_STRENGTH = np.array([DEVIATION.get(c, 0.0) for c in range(256)], dtype=np.float32)  # type: ignore[call-overload]


def _draw_tile() -> NDArray[np.float32]:
    """Return noise of waves about three texels long that repeats at its edges, of deviation 1, float32 [256, 256]."""
    white = np.random.Generator(np.random.Philox(20250527)).standard_normal((_TILE, _TILE))
    row, column = np.meshgrid(np.fft.fftfreq(_TILE), np.fft.fftfreq(_TILE), indexing="ij")
    octaves = np.log2(np.maximum(np.hypot(row, column), 1e-6) * _TEXELS_A_WAVE)
    noise = np.fft.ifft2(np.fft.fft2(white) * np.exp(-((octaves / 0.7) ** 2))).real
    # rounded, so that the last bit of a library's transform does not reach a picture
    return (noise / noise.std()).round(3).astype(np.float32)


_NOISE = _draw_tile()


def add_grain(gbuffer: GBuffer, T_world_camera: NDArray[np.float64], K: NDArray[np.float64]) -> GBuffer:
    """Return the view with the grain of its surfaces in its colours; all else is as it was.

    Parameters
    ----------
    gbuffer : one rasterised view in linear light
    T_world_camera : [4, 4] pose [m]
    K : [3, 3] intrinsics, pixel centres at +0.5 [px]
    """
    rgb = find_namespace(gbuffer.rgb).asarray(gbuffer.rgb, copy=True)
    pose, intrinsics = (np.ascontiguousarray(m, dtype=np.float64) for m in (T_world_camera[:3], K))
    _modulate(rgb, gbuffer.depth, gbuffer.class_id, pose, intrinsics, _NOISE)
    return replace(gbuffer, rgb=rgb)


@numba.njit(**INLINED)
def _modulate_pixel(i, j, rgb, depth, class_id, pose, K, noise):  # type: ignore[no-untyped-def]
    coarsest = WAVES[-1]
    kind = class_id[i, j]
    deviation = _STRENGTH[kind]
    z = np.float64(depth[i, j])
    if deviation == 0 or not z * _PIXELS_A_WAVE < coarsest * K[0, 0]:
        return
    red, green, blue = rgb[i, j, 0], rgb[i, j, 1], rgb[i, j, 2]
    light = 0.2126 * red + 0.7152 * green + 0.0722 * blue
    deviation *= max(1 - light / BRIGHTEST, 0.0)
    across, down = (j + 0.5 - K[0, 2]) / K[0, 0], (i + 0.5 - K[1, 2]) / K[1, 1]
    dx = pose[0, 0] * across + pose[0, 1] * down + pose[0, 2]
    dy = pose[1, 0] * across + pose[1, 1] * down + pose[1, 2]
    dz = pose[2, 0] * across + pose[2, 1] * down + pose[2, 2]
    x, y, up = pose[0, 3] + z * dx, pose[1, 3] + z * dy, pose[2, 3] + z * dz
    wide = z / K[0, 0]
    if _UPRIGHT[kind]:
        u, v, along_u, along_v = 0.8 * x + 0.6 * y, up, 0.0, 0.0
        length, pixel = 0.0, wide / _WALL_FACING
    else:
        steep = max(abs(dz), 1e-3)
        facing = steep / sqrt(dx * dx + dy * dy + steep * steep)
        # by how much a pixel is longer on the surface than it is wide, the squares' difference
        u, v, along_u, along_v = x, y + up, wide * dx / steep, wide * dy / steep
        length = 2 * wide / facing
        # between the pixel's width and its length on the surface
        pixel = wide / sqrt(facing)
    total, resolved = 0.0, 1 / pixel
    for k in range(len(WAVES)):
        share = min(_RESOLVED[k] * resolved - 1, 1.0)
        if share > 0:
            samples = max(ceil(length * min(resolved, _SAMPLES[k])), 1)
            total += share * _blur_along(
                noise, _TEXELS[k] * u, _TEXELS[k] * v, _TEXELS[k] * along_u, _TEXELS[k] * along_v, samples
            )
    gain = np.float32(max(1 + deviation * total, 0.3))
    for channel in range(3):
        rgb[i, j, channel] *= gain


@run_on_either(_modulate_pixel)
@numba.njit(**LAW)
def _modulate(rgb, depth, class_id, pose, K, noise):  # type: ignore[no-untyped-def]
    for i in range(depth.shape[0]):
        for j in range(depth.shape[1]):
            _modulate_pixel(i, j, rgb, depth, class_id, pose, K, noise)


@numba.njit(**LAW)
def _blur_along(noise, u, v, along_u, along_v, samples):  # type: ignore[no-untyped-def]
    """Mean of the noise at a texel, over a way to either side, weighted by a triangle [1]."""
    total, weights, step = 0.0, 0.0, 1 / samples
    for n in range(samples):
        t = (2 * n + 1) * step - 1
        a, b = u + t * along_u, v + t * along_v
        r, c = floor(a), floor(b)
        ta, tb = np.float32(a - r), np.float32(b - c)
        r0, c0 = int(r) & _LAST, int(c) & _LAST
        r1, c1 = (r0 + 1) & _LAST, (c0 + 1) & _LAST
        left = noise[r0, c0] + ta * (noise[r1, c0] - noise[r0, c0])
        right = noise[r0, c1] + ta * (noise[r1, c1] - noise[r0, c1])
        weight = 1 - abs(t)
        weights += weight
        total += weight * (left + tb * (right - left))
    return total / weights
