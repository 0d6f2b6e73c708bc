"""``python -m studies.learn_friction [DATASET]``: how hard will the car brake, told from the pictures before?

A dataset of grid.yaml beside this file is made first, unless it is there, and beside it the telemetry of the same grid
with ``variant: appearance-only``; docs/tutorial/learn-friction.md walks through. ``--grid`` takes another one, such as
streets.yaml beside this file, whose test has streets that training never saw.
"""

import argparse
import time
from dataclasses import replace
from pathlib import Path

import torch

import musync
from catalogs.entries import load
from catalogs.grids import Grid
from flows.cli import run_to_end
from flows.making.generate import generate_dataset
from studies.learn_friction.comparison import compare_predictors, format_errors, format_promises
from studies.learn_friction.samples import read_brakes, read_samples, relabel_samples
from tasks.errors import InputError

GRID, STREETS = (Path(__file__).with_name(name) for name in ("grid.yaml", "streets.yaml"))
"""One street on which the test drives farther on, and streets of which training never saw those of the test."""


def paint_grid(path: Path = GRID) -> Grid:
    """Return a grid in the world in which weather is seen and not felt."""
    grid = load("grid", path)
    return replace(grid, settings=grid.settings.model_copy(update={"variant": "appearance-only"}))


def open_made(place: str, path: Path = GRID) -> musync.Dataset:
    """Return the dataset of a grid, which is made unless it is there.

    Parameters
    ----------
    place : its folder
    path : of the grid

    Raises
    ------
    InputError
        If a finished dataset of another grid lies there, or something else.
    """
    if not Path(place, "manifest.json").is_file():
        generate_dataset(str(path), place, runner="threads")
    data, wanted = musync.open(place), {label for label, _ in load("grid", path).scenarios}
    if set(data) != wanted:
        raise InputError(f"{place}: must be the dataset of {path}; its clips are others: name another folder")
    return data


def run_study() -> None:
    """Read the command line, make what is missing, and print both tables."""
    parser = argparse.ArgumentParser(prog="python -m studies.learn_friction", description=__doc__)
    parser.add_argument("dataset", nargs="?", default="datasets/learn-friction")
    parser.add_argument(
        "--grid", type=Path, default=GRID, help="of the dataset, with the splits train and test"
    )
    parser.add_argument("--seeds", type=int, default=3, help="networks trained in each world")
    parser.add_argument("--weights", type=Path, help="file for the weights of the first network")
    asked = parser.parse_args()
    started = time.perf_counter()
    data = open_made(asked.dataset, asked.grid)
    painted = f"{asked.dataset}-appearance-only"  # before the brake its pictures are those of the other: none is made
    generate_dataset(paint_grid(asked.grid), painted, runner="threads", pictures=False)
    torch.set_num_threads(
        1
    )  # small pictures: a second thread costs more than it gives, and sums in another order
    made = time.perf_counter()
    samples = read_samples(data)
    relabelled = relabel_samples(samples, read_brakes(musync.open(painted)))
    found = compare_predictors(samples, relabelled, seeds=range(1, asked.seeds + 1))
    print(format_errors(found), format_promises(found), sep="\n\n")
    if asked.weights:
        found.networks[0].write(asked.weights)
    print(f"\ndataset {made - started:.0f} s, training and test {time.perf_counter() - made:.0f} s")


if __name__ == "__main__":
    run_to_end(run_study)
