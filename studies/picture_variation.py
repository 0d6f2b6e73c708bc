"""How training pictures of a road are varied: as other cameras might have taken them, of other ground beside the road.

No variation knows the road: it stays dry when its picture is darker, grey or taken with a longer lens, and when its
verge is brown.
"""

import torch
from torch import nn

SATURATION, HUE, GREY = (-0.35, 0.5), (-0.5, 0.5), 0.2
"""Logarithm of the saturation [1], turn of hues [rad], share of pictures without colour [1]."""
GAMMA, BALANCE, BLUR = (-0.35, 0.35), (-0.12, 0.12), (-1.0, 1.0)
"""Logarithm of gamma [1], relative gain of each colour [1], from doubled local contrast to a mean of 3 x 3 [1]."""


def draw_uniform(
    pictures: torch.Tensor, limits: tuple[float, float], draw: torch.Generator, channels: int = 1
) -> torch.Tensor:
    """Return a number within limits for each picture and channel, of shape [N, channels, 1, 1]."""
    low, high = limits
    return low + (high - low) * torch.rand(len(pictures), channels, 1, 1, generator=draw)


def crop_pictures(
    pictures: torch.Tensor, least: float, size: tuple[int, int], draw: torch.Generator
) -> torch.Tensor:
    """Return parts of pictures [N, 3, H, W], each mirrored or not.

    Parameters
    ----------
    pictures : in 0..1
    least : share of each side that is kept at least [1]
    size : height and width of what is returned [px]
    draw : of the part
    """
    wide, high = (draw_uniform(pictures, (least, 1), draw).flatten() for _ in "xy")
    mirrored = torch.sign(draw_uniform(pictures, (-1, 1), draw).flatten())
    right, down = (draw_uniform(pictures, (-1, 1), draw).flatten() * (1 - kept) for kept in (wide, high))
    affine = torch.zeros(len(pictures), 2, 3)
    affine[:, 0, 0], affine[:, 0, 2], affine[:, 1, 1], affine[:, 1, 2] = mirrored * wide, right, high, down
    grid = nn.functional.affine_grid(affine, [len(pictures), 3, *size], align_corners=False)
    return nn.functional.grid_sample(pictures, grid, padding_mode="reflection", align_corners=False)


def vary_colours(pictures: torch.Tensor, draw: torch.Generator) -> torch.Tensor:
    """Return pictures [N, 3, H, W] of other saturation and hue, some without colour."""
    grey = pictures.mean(dim=1, keepdim=True)
    coloured = draw_uniform(pictures, (0, 1), draw) > GREY
    saturation = torch.exp(draw_uniform(pictures, SATURATION, draw))
    return grey + coloured * saturation * (_turn_hues(pictures, draw_uniform(pictures, HUE, draw)) - grey)


def vary_tones(pictures: torch.Tensor, draw: torch.Generator) -> torch.Tensor:
    """Return pictures [N, 3, H, W] of other gamma, white balance and sharpness, within 0..1."""
    seen = pictures.clamp(1e-3, 1) ** torch.exp(draw_uniform(pictures, GAMMA, draw))
    seen = seen * (1 + draw_uniform(pictures, BALANCE, draw, channels=3))
    smooth = nn.functional.avg_pool2d(seen, 3, stride=1, padding=1, count_include_pad=False)
    return (seen + draw_uniform(pictures, BLUR, draw) * (smooth - seen)).clamp(0, 1)


def _turn_hues(pictures: torch.Tensor, angle: torch.Tensor) -> torch.Tensor:
    """Turn colours about the grey axis by angles [rad]."""
    own, across = (1 + 2 * torch.cos(angle)) / 3, torch.sin(angle) / 3**0.5
    left = (1 - torch.cos(angle)) / 3
    return own * pictures + (left - across) * pictures.roll(1, 1) + (left + across) * pictures.roll(-1, 1)
