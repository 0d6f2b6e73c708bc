"""What a brake reads from one picture of the road: its friction.

``python -m studies.emergency_braking.seeing`` trains the network on the full brakes of pictures.yaml, on streets that
no protocol uses, prints how far off it is on two streets that it never saw, and writes network.npz beside this file.
"""

import argparse
from dataclasses import dataclass
from functools import cache
from hashlib import sha256
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray

import musync
from catalogs.scenario import Scenario
from flows.cli import run_to_end
from flows.driving.simulator import Simulator
from flows.making.generate import generate_dataset
from studies.learn_friction.network import Trained, read_network, train_network
from studies.learn_friction.samples import Samples, read_samples, split_samples
from tasks.surface.state import SurfaceParameters
from tasks.vehicle.parameters import Vehicle

GRID, WEIGHTS = (Path(__file__).with_name(name) for name in ("pictures.yaml", "network.npz"))
CAMERA = str(Path(__file__).parents[1] / "learn_friction" / "streets-camera.yaml")
OVER_S = 0.5
"""The deceleration that the network learns is the mean over this time from the brake onset on [s]."""
SEED = 1
"""Of the network whose weights are kept [1]."""


@dataclass(frozen=True, kw_only=True)
class Reader:
    """Reads the friction of a road from a picture.

    Parameters
    ----------
    trained : the network
    sha256 : of the file of its weights
    """

    trained: Trained
    sha256: str

    def look(self, scenario: Scenario, car: Vehicle, pavement: SurfaceParameters) -> float:
        """Return the friction that it reads from the picture with which a drive begins [1].

        Parameters
        ----------
        scenario : the drive, whose brake acts later
        car, pavement : of the drive
        """
        seen = Simulator(scenario, vehicle=car, surface=pavement, camera=CAMERA).reset()
        assert seen.frame is not None
        return float(self.trained.estimate_friction(seen.frame[None])[0])


@cache
def load_reader() -> Reader:
    """Return the reader whose weights lie beside this file."""
    return Reader(trained=read_network(WEIGHTS), sha256=sha256(WEIGHTS.read_bytes()).hexdigest())


def make_samples(place: str) -> Samples:
    """Return pictures before full brakes, and the decelerations; only the motion is stored.

    Parameters
    ----------
    place : folder of the dataset of pictures.yaml, made unless it is there
    """
    if not Path(place, "manifest.json").is_file():
        generate_dataset(str(GRID), place, pictures="later", runner="threads")
    return read_samples(musync.open(place), over_s=OVER_S)


def format_errors(test: Samples, answers: list[NDArray[np.float64]]) -> str:
    """Return a table of the true friction, and of what each network reads, by weather and rate [1]."""
    rows = ["| weather | mm/h | true | read |", "| --- | --- | --- | --- |"]
    for kind, rate in sorted(set(zip(test.weather, test.rate, strict=True))):
        here = (test.weather == kind) & (test.rate == rate)
        read = ", ".join(f"{answer[here].mean():.2f}" for answer in answers)
        rows.append(f"| {kind} | {rate:g} | {test.friction[here].mean():.2f} | {read} |")
    return "\n".join(rows)


def run_study() -> None:
    """Read the command line, train, print the errors and write the weights of the first network."""
    parser = argparse.ArgumentParser(prog="python -m studies.emergency_braking.seeing", description=__doc__)
    parser.add_argument("dataset", nargs="?", default="datasets/full-brakes")
    parser.add_argument("--seeds", type=int, default=3, help="networks that are trained")
    asked = parser.parse_args()
    torch.set_num_threads(1)
    train, test = split_samples(make_samples(asked.dataset))
    networks = [train_network(train, seed=SEED + place) for place in range(asked.seeds)]
    pictures = test.pictures.permute(0, 2, 3, 1).numpy()
    print(format_errors(test, [network.estimate_friction(pictures) for network in networks]))
    networks[0].write(WEIGHTS)


if __name__ == "__main__":
    run_to_end(run_study)
