"""A small convolutional network: one picture in, the road's friction out; with the brake command, the deceleration."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn

from musync import SeededOrder
from studies.learn_friction.samples import Samples
from studies.picture_variation import crop_pictures, draw_uniform, vary_colours, vary_tones
from tasks.conventions import GRAVITY

EPOCHS, BATCH, RATE, DECAY = 60, 32, 2e-3, 1e-3
"""Passes over the samples [1], samples in a step [1], largest learning rate [1], weight decay [1]."""
SEEN = (64, 96)
"""Height and width of the pictures that the network sees [px]."""
CROP, GAIN = 0.7, (-0.25, 0.25)
"""Share of each side of a training picture that is kept at least, and logarithm of its brightness [1]."""
LEAST_FRICTION = 0.02
"""Of an answer [1]."""


class BrakeNetwork(nn.Module):
    """Four convolutions see the road's friction; the car decelerates as the brake asks, or as the road gives.

    Parameters
    ----------
    centre, scale : mean and deviation of the friction [1]
    """

    spread: torch.Tensor

    def __init__(self, centre: float, scale: float) -> None:
        super().__init__()
        self.register_buffer("spread", torch.tensor([centre, scale], dtype=torch.float32))
        layers: list[nn.Module] = []
        for given, made in ((3, 16), (16, 32), (32, 64), (64, 64)):
            layers += [nn.Conv2d(given, made, 3, stride=2, padding=1), nn.BatchNorm2d(made), nn.ReLU()]
        self.see = nn.Sequential(
            *layers, nn.AdaptiveAvgPool2d((2, 1)), nn.Flatten(), nn.Dropout(0.2), nn.Linear(128, 1)
        )
        self.limits = nn.Parameter(torch.tensor([2.0, GRAVITY, 8.0]).log())

    def forward(self, pictures: torch.Tensor, pressure: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Return friction [1] and deceleration [m/s2] of pictures in 0..1 and pressures [MPa].

        The deceleration is the smooth minimum of a gain times the pressure and one times the friction; both gains and
        the sharpness are learned.
        """
        centre, scale = self.spread
        friction = (centre + scale * self.see(pictures - 0.5)[:, 0]).clamp(min=LEAST_FRICTION)
        of_brake, of_road, sharpness = self.limits.exp()
        asked, held = of_brake * pressure, of_road * friction
        return friction, (asked**-sharpness + held**-sharpness) ** (-1 / sharpness)


@dataclass(frozen=True, kw_only=True)
class Trained:
    """A trained network.

    Parameters
    ----------
    network : its weights
    losses : mean squared errors of friction and deceleration by their variances, summed, of each epoch [1]; none of
        a network that was read
    """

    network: BrakeNetwork
    losses: tuple[float, ...] = ()

    def estimate_friction(self, pictures: NDArray[np.uint8]) -> NDArray[np.float64]:
        """Return the friction of the road in each picture [1].

        Parameters
        ----------
        pictures : uint8 [N, H, W, 3] RGB, of any size
        """
        shown = torch.from_numpy(np.ascontiguousarray(np.moveaxis(pictures, -1, 1)))
        return self._ask(shown, np.ones(len(shown)))[:, 0]

    def predict(self, samples: Samples) -> NDArray[np.float64]:
        """Return the deceleration of each sample [m/s2]."""
        return self._ask(samples.pictures, samples.command[:, 1])[:, 1]

    def write(self, path: str | Path) -> None:
        """Write the weights in half precision to an NPZ file for `read_network`; the same ones give the same bytes."""
        weights = {
            name: (values.half() if values.is_floating_point() else values).numpy()
            for name, values in self.network.state_dict().items()
        }
        with open(path, "wb") as file:
            np.savez(file, **weights)

    def _ask(self, pictures: torch.Tensor, pressure: NDArray[np.float64]) -> NDArray[np.float64]:
        self.network.eval()
        asked = torch.from_numpy(pressure).float()
        with torch.no_grad():
            answers = [
                torch.stack(self.network(shrink_pictures(shown), part), dim=1)
                for shown, part in zip(pictures.split(256), asked.split(256), strict=True)
            ]
        return torch.cat(answers).double().numpy()


def read_network(path: str | Path) -> Trained:
    """Return the network whose weights `Trained.write` wrote."""
    network = BrakeNetwork(0, 1)
    with np.load(path) as weights:
        network.load_state_dict({name: torch.from_numpy(weights[name]) for name in weights.files})
    return Trained(network=network)


def train_network(samples: Samples, *, seed: int, epochs: int = EPOCHS) -> Trained:
    """Train for a fixed number of epochs; the same seed gives the same weights on one machine.

    Nothing is chosen by looking at other samples than these.

    Parameters
    ----------
    samples : to learn from
    seed : of the first weights, of the order and of the variation of the pictures
    epochs : passes over the samples [1]
    """
    torch.use_deterministic_algorithms(True)
    pressure = torch.from_numpy(samples.command[:, 1]).float()
    wanted = torch.from_numpy(np.stack([samples.friction, samples.deceleration])).float()
    variances = wanted.var(dim=1, unbiased=False) + 1e-6
    draw = torch.Generator().manual_seed(seed)
    order, losses = SeededOrder(len(samples), seed), []
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        network = BrakeNetwork(float(wanted[0].mean()), float(variances[0].sqrt()))
        descent = torch.optim.AdamW(network.parameters(), lr=RATE, weight_decay=DECAY)
        steps = epochs * -(-len(samples) // BATCH)
        slowing = torch.optim.lr_scheduler.OneCycleLR(descent, RATE, total_steps=steps)
        for epoch in range(epochs):
            order.set_epoch(epoch)
            total = 0.0
            for batch in torch.tensor(list(order)).split(BATCH):
                answer = torch.stack(
                    network(vary_pictures(shrink_pictures(samples.pictures[batch]), draw), pressure[batch])
                )
                loss = (((answer - wanted[:, batch]) ** 2).mean(dim=1) / variances).sum()
                descent.zero_grad()
                loss.backward()
                descent.step()
                slowing.step()
                total += float(loss.detach()) * len(batch)
            losses.append(total / len(samples))
    return Trained(network=network, losses=tuple(losses))


def shrink_pictures(pictures: torch.Tensor) -> torch.Tensor:
    """Return uint8 pictures [N, 3, H, W] as the network sees them, in 0..1."""
    return nn.functional.interpolate(pictures.float() / 255, SEEN, mode="bilinear", antialias=True)


def vary_pictures(pictures: torch.Tensor, draw: torch.Generator) -> torch.Tensor:
    """Return pictures [N, 3, *SEEN] with other crops, colours, brightness, tones and sharpness."""
    seen = vary_colours(crop_pictures(pictures, CROP, SEEN, draw), draw)
    return vary_tones(seen * torch.exp(draw_uniform(seen, GAIN, draw)), draw)
