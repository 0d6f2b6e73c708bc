"""A small convolutional network that tells the class of a picture, and the variation of pictures while it learns."""

import copy
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn

from studies.picture_variation import crop_pictures, draw_uniform, vary_colours, vary_tones
from studies.real_photos.pictures import CLASSES, Pictures

SEEN = 48
"""Side of the square that the network sees [px]."""
BATCH, RATE, TUNING_RATE, DECAY, SMOOTHING = 32, 2e-3, 5e-4, 1e-3, 0.05
"""Pictures in a step [1], learning rates [1], weight decay [1], label smoothing [1]."""
CROP = 0.5
"""Share of each side of a picture that is kept at least [1]."""
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
    """Return uint8 pictures [N, 3, SIDE, SIDE], varied, as the network sees them.

    Parameters
    ----------
    pictures : to be cropped, of other colours, levels, tones and sharpness
    draw : of the variations
    """
    seen = crop_pictures(pictures.float() / 255, CROP, (SEEN, SEEN), draw)
    light = seen.mean(dim=1)[:, ::4, ::4].flatten(1)  # enough of the pixels to know how many are darker
    seen = vary_colours(seen, draw)
    black, white = light.quantile(torch.tensor(LEVELS), dim=1)[..., None, None, None]
    low, high = draw_uniform(seen, BLACK, draw), draw_uniform(seen, WHITE, draw)
    return vary_tones(low + (seen - black) * (high - low) / (white - black).clamp(min=0.05), draw)


def _as_tensor(pictures: Pictures) -> torch.Tensor:
    return torch.from_numpy(np.ascontiguousarray(pictures.pixels.transpose(0, 3, 1, 2)))
