"""``python -m studies.learn_friction [DATASET]``: how hard will the car brake, told from the pictures before?

A dataset of the grid beside this file is made first, unless it is there, and beside it the telemetry of the same grid
with ``variant: appearance-only``; docs/tutorial/learn-friction.md walks through.
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

GRID = Path(__file__).with_name("grid.yaml")


def paint_grid() -> Grid:
    """Return the grid of the world in which weather is seen and not felt."""
    grid = load("grid", GRID)
    return replace(grid, settings=grid.settings.model_copy(update={"variant": "appearance-only"}))


def open_made(place: str) -> musync.Dataset:
    """Return the dataset of the grid beside this file, which is made unless it is there.

    Parameters
    ----------
    place : its folder

    Raises
    ------
    InputError
        If a finished dataset of another grid lies there, or something else.
    """
    if not Path(place, "manifest.json").is_file():
        generate_dataset(str(GRID), place, runner="threads")
    data, wanted = musync.open(place), {label for label, _ in load("grid", GRID).scenarios}
    if set(data) != wanted:
        raise InputError(
            f"{place}: must be the dataset of studies/learn_friction/grid.yaml; its clips are others: name another"
            " folder"
        )
    return data


def run_study() -> None:
    """Read the command line, make what is missing, and print both tables."""
    parser = argparse.ArgumentParser(prog="python -m studies.learn_friction", description=__doc__)
    parser.add_argument("dataset", nargs="?", default="datasets/learn-friction")
    parser.add_argument("--seeds", type=int, default=3, help="networks trained in each world")
    asked = parser.parse_args()
    started = time.perf_counter()
    data = open_made(asked.dataset)
    painted = f"{asked.dataset}-appearance-only"  # before the brake its pictures are those of the other: none is made
    generate_dataset(paint_grid(), painted, runner="threads", pictures=False)
    torch.set_num_threads(
        1
    )  # small pictures: a second thread costs more than it gives, and sums in another order
    made = time.perf_counter()
    samples = read_samples(data)
    relabelled = relabel_samples(samples, read_brakes(musync.open(painted)))
    found = compare_predictors(samples, relabelled, seeds=range(1, asked.seeds + 1))
    print(format_errors(found), format_promises(found), sep="\n\n")
    print(f"\ndataset {made - started:.0f} s, training and test {time.perf_counter() - made:.0f} s")


if __name__ == "__main__":
    run_to_end(run_study)
