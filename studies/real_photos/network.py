"""A small convolutional network that tells the class of a picture, and the variation of pictures while it learns."""

import copy
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn

from studies.real_photos.pictures import CLASSES, Pictures

SEEN = 48
"""Side of the square that the network sees [px]."""
BATCH, RATE, TUNING_RATE, DECAY, SMOOTHING = 32, 2e-3, 5e-4, 1e-3, 0.05
"""Pictures in a step [1], learning rates [1], weight decay [1], label smoothing [1]."""
CROP, SATURATION, GAMMA, BALANCE = (0.5, 1.0), (-0.35, 0.5), (-0.35, 0.35), (-0.12, 0.12)
"""Share of each side that is kept [1], logarithms of saturation and gamma, relative gain of each colour [1]."""
GREY, HUE, BLUR = 0.2, (-0.5, 0.5), (-1.0, 1.0)
"""Share of pictures without colour [1], turn of hues [rad], from doubled local contrast to a mean of 3 x 3 [1]."""
LEVELS, BLACK, WHITE = (0.03, 0.97), (0.0, 0.28), (0.68, 1.02)
"""Shares of the pixels that lie below black and white, and where these come to lie [1]."""


class RoadNetwork(nn.Module):
    """Four strided convolutions, the mean of the upper and of the lower half of what they see, and one layer."""

    def __init__(self) -> None:
        super().__init__()
        layers: list[nn.Module] = []
        for given, made in ((3, 16), (16, 32), (32, 64), (64, 64)):
            layers += [nn.Conv2d(given, made, 3, stride=2, padding=1), nn.BatchNorm2d(made), nn.ReLU()]
        self.layers = nn.Sequential(
            *layers, nn.AdaptiveAvgPool2d((2, 1)), nn.Flatten(), nn.Dropout(0.2), nn.Linear(128, len(CLASSES))
        )

    def forward(self, pictures: torch.Tensor) -> torch.Tensor:
        """Return a number a class of pictures [N, 3, SEEN, SEEN] in 0..1."""
        answer: torch.Tensor = self.layers(pictures - 0.5)
        return answer


@dataclass(frozen=True, kw_only=True)
class Trained:
    """A trained network.

    Parameters
    ----------
    network : its weights
    """

    network: RoadNetwork

    def predict(self, pictures: Pictures) -> NDArray[np.int64]:
        """Return the place of the class that the network gives each picture."""
        self.network.eval()
        with torch.no_grad():
            answers = [
                self.network(shrink_pictures(part)).argmax(dim=1) for part in _as_tensor(pictures).split(256)
            ]
        return torch.cat(answers).numpy()


def train_network(sources: Sequence[Pictures], *, seed: int, steps: int) -> Trained:
    """Train a new network; each source and, in it, each class has the same share of every step on average.

    The same seed gives the same weights on one machine.

    Parameters
    ----------
    sources : pictures to learn from
    seed : of weights, choice and variation of the pictures [1]
    steps : of training [1]
    """
    torch.manual_seed(seed)
    return _fit(RoadNetwork(), sources, seed, steps, RATE)


def continue_training(trained: Trained, pictures: Pictures, *, seed: int, steps: int) -> Trained:
    """Return a copy of a network that was trained further, more slowly.

    Parameters
    ----------
    trained : stays as it is
    pictures, seed, steps : as `train_network` takes them
    """
    torch.manual_seed(seed)
    return _fit(copy.deepcopy(trained.network), [pictures], seed, steps, TUNING_RATE)


def _fit(network: RoadNetwork, sources: Sequence[Pictures], seed: int, steps: int, rate: float) -> Trained:
    draw = torch.Generator().manual_seed(seed)
    pictures = torch.cat([_as_tensor(source) for source in sources])
    label = torch.from_numpy(np.concatenate([source.label for source in sources]))
    share = torch.from_numpy(
        np.concatenate([1 / np.bincount(source.label)[source.label] for source in sources])
    )
    network.train()
    optimiser = torch.optim.AdamW(network.parameters(), lr=rate, weight_decay=DECAY)
    for _ in range(steps):
        chosen = torch.multinomial(share, BATCH, replacement=True, generator=draw)
        answer = network(vary_pictures(pictures[chosen], draw))
        loss = nn.functional.cross_entropy(answer, label[chosen], label_smoothing=SMOOTHING)
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
    return Trained(network=network)


def shrink_pictures(pictures: torch.Tensor) -> torch.Tensor:
    """Return uint8 pictures [N, 3, SIDE, SIDE] as the network sees them."""
    return nn.functional.interpolate(pictures.float() / 255, (SEEN, SEEN), mode="bilinear", antialias=True)


def vary_pictures(pictures: torch.Tensor, draw: torch.Generator) -> torch.Tensor:
    """Return uint8 pictures as other cameras might have taken them of other ground: crop, levels, colours, sharpness.

    No variation knows the class: a dry road stays dry when its picture is darker, grey or taken with a longer lens, and
    when its verge is brown.

    Parameters
    ----------
    pictures : uint8 [N, 3, SIDE, SIDE]
    draw : of the variations
    """

    def spread(low: float, high: float, channels: int = 1) -> torch.Tensor:
        return low + (high - low) * torch.rand(len(pictures), channels, 1, 1, generator=draw)

    seen = _crop_pictures(pictures.float() / 255, spread)
    grey = seen.mean(dim=1, keepdim=True)
    coloured = spread(0, 1) > GREY
    seen = grey + coloured * torch.exp(spread(*SATURATION)) * (_turn_hues(seen, spread(*HUE)) - grey)
    light = grey[:, :, ::4, ::4].flatten(1)  # enough of the pixels to know how many are darker
    black, white = light.quantile(torch.tensor(LEVELS), dim=1)[..., None, None, None]
    low, high = spread(*BLACK), spread(*WHITE)
    seen = low + (seen - black) * (high - low) / (white - black).clamp(min=0.05)
    seen = seen.clamp(1e-3, 1) ** torch.exp(spread(*GAMMA)) * (1 + spread(*BALANCE, 3))
    smooth = nn.functional.avg_pool2d(seen, 3, stride=1, padding=1, count_include_pad=False)
    return (seen + spread(*BLUR) * (smooth - seen)).clamp(0, 1)


def _turn_hues(pictures: torch.Tensor, angle: torch.Tensor) -> torch.Tensor:
    """Turn colours about the grey axis by angles [rad]."""
    own, across = (1 + 2 * torch.cos(angle)) / 3, torch.sin(angle) / 3**0.5
    left = (1 - torch.cos(angle)) / 3
    return own * pictures + (left - across) * pictures.roll(1, 1) + (left + across) * pictures.roll(-1, 1)


def _crop_pictures(pictures, spread):  # type: ignore[no-untyped-def]
    wide, high = (spread(*CROP)[:, 0, 0, 0] for _ in "xy")
    mirrored = torch.sign(spread(-1, 1)[:, 0, 0, 0])
    right, down = (spread(-1, 1)[:, 0, 0, 0] * (1 - size) for size in (wide, high))
    affine = torch.zeros(len(pictures), 2, 3)
    affine[:, 0, 0], affine[:, 0, 2], affine[:, 1, 1], affine[:, 1, 2] = mirrored * wide, right, high, down
    grid = nn.functional.affine_grid(affine, [len(pictures), 3, SEEN, SEEN], align_corners=False)
    return nn.functional.grid_sample(pictures, grid, padding_mode="reflection", align_corners=False)


def _as_tensor(pictures: Pictures) -> torch.Tensor:
    return torch.from_numpy(np.ascontiguousarray(pictures.pixels.transpose(0, 3, 1, 2)))
