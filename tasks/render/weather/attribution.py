"""Attribution of changed pixels to layers, and the paper's composition of particles."""

from collections.abc import Collection

import numpy as np
from numpy.typing import NDArray

from tasks.conventions import ROAD_CLASSES
from tasks.render.composition import encode_8bit, to_display
from tasks.render.rasterise.gbuffer import GBuffer
from tasks.render.weather.falling.particles import Shutter
from tasks.render.weather.layer import Layer, recompose_layers
from tasks.render.weather.layers import ClipWeather, WeatherFrame
from tasks.render.weather.rays import pixel_rays
from tasks.render.weather.snow.bearing import GROUND_CLASSES, steepest_bearing
from tasks.render.weather.snow.field import coverage_rank, locate_snow
from tasks.render.weather.snow.layer import hidden_share

LAYER_BITS = {"light": 1, "wet": 2, "air": 4, "particles": 8, "snow": 16}
"""Bit of each layer in an attribution picture."""


def attribute_pixels(
    weather: ClipWeather, frame: WeatherFrame, gbuffer: GBuffer, shutter: Shutter
) -> NDArray[np.uint8]:
    """Return the layers that changed each pixel by at least half an 8-bit step, as the sum of their `LAYER_BITS`.

    Parameters
    ----------
    weather : the clip's weather
    frame : the frame
    gbuffer : the rasterisation it was made from
    shutter : its exposure

    Returns
    -------
    uint8 [H, W] bits [1]
    """
    bits = np.where(snow_on(GROUND_CLASSES, weather, gbuffer, shutter), LAYER_BITS["snow"], 0).astype(
        np.uint8
    )
    picture = frame.base
    for layer in frame.layers:
        after = recompose_layers(picture, (layer,))
        bits |= mark_changed_pixels(picture, after, layer)
        picture = after
    return bits


def mark_changed_pixels(
    before: NDArray[np.float32], after: NDArray[np.float32], layer: Layer
) -> NDArray[np.uint8]:
    """Return the layer's bit where it changed a pixel by at least half an 8-bit step, uint8 [H, W] [1].

    Parameters
    ----------
    before, after : float32 [H, W, 3] linear pictures below the layer and with it [1]
    layer : layer that changed them
    """
    step = np.abs(to_display(after) - to_display(before)).max(axis=-1)
    return np.where(step >= 0.5 / 255, LAYER_BITS[layer.name], 0).astype(np.uint8)


HALF = 0.5
"""Share of the ground beside the road that snow hides from which on it counts as covered [1]."""


def snow_on(
    classes: Collection[int], weather: ClipWeather, gbuffer: GBuffer, shutter: Shutter
) -> NDArray[np.bool_]:
    """Return the pixels of the ground on which snow lies, by the coverage field at the visible point.

    Parameters
    ----------
    classes : classes of the ground
    weather : the clip's weather
    gbuffer : the rasterisation of its scene
    shutter : pose and intrinsics

    Returns
    -------
    bool [H, W]
    """
    mask = np.zeros(gbuffer.depth.shape, dtype=bool)
    outside = weather.outside
    if outside is None or outside.snow is None or outside.look.snow_cover is None:
        return mask
    road = np.isin(gbuffer.class_id, ROAD_CLASSES)
    bears = road | (gbuffer.normal[..., 2] > steepest_bearing(outside.look.snow_cover.anchors))
    ground = np.isin(gbuffer.class_id, list(classes)) & bears & (gbuffer.alpha > 0.5)
    on_road = ground & road
    place = shutter.T_world_camera[:3, 3] + gbuffer.depth[on_road, None] * pixel_rays(shutter)[on_road]
    xi = coverage_rank(outside.snow, locate_snow(outside.snow, place))
    mask[on_road] = xi <= weather.state.snow_coverage
    hidden = hidden_share(np.array(weather.state.snow_depth_mm), outside.look.snow_cover)
    mask[ground & ~road] = hidden > HALF
    return mask


def paper_picture(frame: WeatherFrame) -> NDArray[np.uint8]:
    """Return the 8-bit picture as the paper composes it (Appendix A.4).

    The particles are isolated in display space, as the signed difference of a pair of 8-bit renders of the
    street in its air with and without them, and that difference is added last to the finished still picture. Between
    two anchors both are those of the anchors, blended: the still pictures by the rate, the differences by the number
    of particles.

    Parameters
    ----------
    frame : the frame

    Returns
    -------
    uint8 [H, W, 3] sRGB
    """
    still, residual = _still_and_residual(frame)
    if (blend := frame.blend) is not None:
        pair = _still_and_residual(blend.low), _still_and_residual(blend.high)
        still, residual = (
            low + weight * (high - low)
            for low, high, weight in zip(*pair, (blend.still, blend.falling), strict=True)
        )
    return np.clip(np.rint(still + residual), 0, 255).astype(np.uint8)


def _still_and_residual(frame: WeatherFrame) -> tuple[NDArray[np.floating], NDArray[np.floating]]:
    """Return the 8-bit picture without particles, and what the particles add to that without water on the road."""
    layers = [layer for layer in frame.layers if layer.name != "particles"]
    falling = [layer for layer in frame.layers if layer.name == "particles"]
    without = recompose_layers(frame.base, [layer for layer in layers if layer.name != "wet"])
    residual = _codes(recompose_layers(without, falling)) - _codes(without)
    return _codes(recompose_layers(frame.base, layers)), residual


def _codes(picture: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return 8-bit sRGB codes as signed numbers."""
    return encode_8bit(picture).astype(np.float32)
