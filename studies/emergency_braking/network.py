"""The network of network.npz: pictures and brake command in, deceleration out."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn

from musync import SeededOrder
from studies.learn_friction.samples import Samples

EPOCHS, BATCH, RATE, DECAY = 60, 32, 2e-3, 1e-4
"""Passes over the samples [1], samples in a step [1], learning rate [1], weight decay [1]."""


class BrakeNetwork(nn.Module):
    """Three convolutions see the pictures; two layers join what they saw with the command.

    Parameters
    ----------
    channels : of all pictures of a sample [1]
    """

    def __init__(self, channels: int):
        super().__init__()
        self.see = nn.Sequential(
            nn.Conv2d(channels, 16, 5, stride=2, padding=2), nn.ReLU(),
            nn.Conv2d(16, 32, 3, stride=2, padding=1), nn.ReLU(),
            nn.Conv2d(32, 32, 3, stride=2, padding=1), nn.ReLU(),
            nn.AdaptiveAvgPool2d((2, 1)), nn.Flatten(),
        )  # fmt: skip
        self.join = nn.Sequential(
            nn.Linear(2 * 32 + 2, 64), nn.ReLU(), nn.Linear(64, 64), nn.ReLU(), nn.Linear(64, 1)
        )

    def forward(self, pictures: torch.Tensor, command: torch.Tensor) -> torch.Tensor:
        """Return the standardised deceleration of uint8 pictures and standardised commands."""
        seen = self.see(pictures.float() / 127.5 - 1)
        return self.join(torch.cat([seen, command], dim=1))[:, 0]


@dataclass(frozen=True, kw_only=True)
class Trained:
    """A trained network with the scales of its numbers.

    Parameters
    ----------
    network : its weights
    centre, scale : of speed [m/s], pressure [MPa] and deceleration [m/s2]
    losses : mean squared error of each epoch, standardised [1]
    """

    network: BrakeNetwork
    centre: NDArray[np.float64]
    scale: NDArray[np.float64]
    losses: tuple[float, ...]

    def predict(self, samples: Samples) -> NDArray[np.float64]:
        """Return the deceleration of each sample [m/s2]."""
        return self.answer(samples.pictures, samples.command)

    def answer(self, pictures: torch.Tensor, command: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the deceleration for pictures and commands, as of `Samples` [m/s2]."""
        numbers = torch.from_numpy((command - self.centre[:2]) / self.scale[:2]).float()
        with torch.no_grad():
            answer = torch.cat([
                self.network(*part) for part in zip(pictures.split(256), numbers.split(256), strict=True)
            ])  # fmt: skip
        return answer.double().numpy() * self.scale[2] + self.centre[2]

    def write(self, path: Path) -> None:
        """Write weights and scales; the same ones give the same bytes."""
        weights = {name: values.numpy() for name, values in self.network.state_dict().items()}
        np.savez(path, centre=self.centre, scale=self.scale, **weights)


def read_trained(path: Path) -> Trained:
    """Return a network that `Trained.write` wrote, without its losses.

    Parameters
    ----------
    path : of the file
    """
    with np.load(path) as kept:
        weights = {name: torch.from_numpy(kept[name]) for name in kept.files}
    centre, scale = (weights.pop(name).numpy() for name in ("centre", "scale"))
    network = BrakeNetwork(weights["see.0.weight"].shape[1])
    network.load_state_dict(weights)
    return Trained(network=network, centre=centre, scale=scale, losses=())


def train_network(samples: Samples, *, seed: int, epochs: int = EPOCHS) -> Trained:
    """Train for a fixed number of epochs; the same seed gives the same weights on one machine.

    Nothing is chosen by looking at other samples than these.

    Parameters
    ----------
    samples : to learn from
    seed : of the first weights and of the order
    epochs : passes over the samples [1]
    """
    torch.use_deterministic_algorithms(True)
    numbers = np.column_stack([samples.command, samples.deceleration])
    centre, scale = numbers.mean(axis=0), numbers.std(axis=0) + 1e-9
    standard = torch.from_numpy((numbers - centre) / scale).float()
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        network = BrakeNetwork(samples.pictures.shape[1])
    descent = torch.optim.AdamW(network.parameters(), lr=RATE, weight_decay=DECAY)
    order, losses = SeededOrder(len(samples), seed), []
    for epoch in range(epochs):
        order.set_epoch(epoch)
        total = 0.0
        for batch in torch.tensor(list(order)).split(BATCH):
            answer = network(samples.pictures[batch], standard[batch, :2])
            loss = nn.functional.mse_loss(answer, standard[batch, 2])
            descent.zero_grad()
            loss.backward()
            descent.step()
            total += float(loss.detach()) * len(batch)
        losses.append(total / len(samples))
    return Trained(network=network, centre=centre, scale=scale, losses=tuple(losses))
