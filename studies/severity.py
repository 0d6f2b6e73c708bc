"""Does the weather one sees grow with the weather that falls? Image statistics, by street, branch and seed."""

import argparse
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from catalogs.entries import load
from flows.cli import run_to_end
from flows.making.catalogue import Catalogue
from flows.making.driving import simulate_drive
from flows.making.pictures import frame_rows, render_frames, rig_of
from flows.making.plan import freeze_grid
from flows.store.layout import write_atomically
from studies.evaluation.metrics.severity import measure_image, severity_agreement
from tasks.conventions import ROAD_CLASSES

SEEDS = (1, 2, 3)
FRAMES, FRAME_RATE_HZ = 5, 2.0
"""Frames of each clip and their rate: 2 s from 60 km/h, braked from one second on."""


def measure_rows(
    scenes: tuple[str, ...] = ("street",), seeds: tuple[int, ...] = SEEDS
) -> Iterator[dict[str, Any]]:
    """Render the severity grid and rank every statistic against the rate.

    Parameters
    ----------
    scenes : names or folders
    seeds : of the grid, hence of particles and snow; the drive stays the same [1]

    Returns
    -------
    Rows of scene, seed, branch, statistic, its values from the lowest rate to the highest, Spearman's rank
    correlation and the share of neighbouring levels in order.
    """
    for scene in scenes:
        for seed in seeds:
            rates, values = _measure_clips(scene, seed)
            for branch in ("rain", "snow"):
                levels = {label: rate for label, rate in rates.items() if label.startswith((branch, "sunny"))}
                order = sorted(levels, key=lambda label: levels[label])
                for name in values["sunny"]:
                    of_levels = {label: values[label][name] for label in order}
                    rho, adjacent = severity_agreement(levels, of_levels)
                    yield {
                        "scene": Path(scene).name, "seed": seed, "branch": branch, "statistic": name,
                        "values": [of_levels[label] for label in order], "spearman": rho, "adjacent": adjacent,
                    }  # fmt: skip


def _measure_clips(scene: str, seed: int) -> tuple[dict[str, float], dict[str, dict[str, float]]]:
    """Rate and statistics of each clip of the severity grid, by its label."""
    grid = load("grid", "severity")
    short = {"scene": scene, "seed": seed, "frames": FRAMES, "frame_rate_hz": FRAME_RATE_HZ}
    grid = replace(grid, settings=grid.settings.model_copy(update=short))
    plan, inputs = freeze_grid(grid, "severity", "cpu")
    with tempfile.TemporaryDirectory() as folder:
        for name, content in inputs.items():
            write_atomically(Path(folder) / name, content)
        catalogue = Catalogue(Path(folder), scene)
        rates, values = {}, {}
        for clip in plan.clips:
            state, ride = simulate_drive(
                clip.scenario, catalogue.vehicle, catalogue.surface, plan.settings.vehicle_mode, plan.duration_s,
                catalogue.steady,
            )  # fmt: skip
            frames = frame_rows(ride, plan, catalogue)
            rig_at = rig_of(ride, frames, catalogue)
            shown = render_frames(clip.scenario, state, frames, plan, catalogue, int(clip.seed), rig_at)
            rates[clip.label] = clip.scenario.precipitation_mm_h
            values[clip.label] = measure_image(shown["rgb"], np.isin(shown["class"], ROAD_CLASSES))
    return rates, values


def run_benchmark() -> None:
    """Rank the levels of the scenes that the command line names, and print each row as it comes."""
    parser = argparse.ArgumentParser(prog="python -m studies.severity")
    parser.add_argument("scene", nargs="*", default=["street"], help="scene folder, or street")
    for row in measure_rows(tuple(parser.parse_args().scene)):
        levels = " ".join(f"{value:.4f}" for value in row["values"])
        print(
            f"{row['scene']:8} seed {row['seed']} {row['branch']} {row['statistic']:17} rho {row['spearman']:+.2f}"
            f" adjacent {row['adjacent']:.2f}  {levels}",
            flush=True,
        )


if __name__ == "__main__":
    run_to_end(run_benchmark)
