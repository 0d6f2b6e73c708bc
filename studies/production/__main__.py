"""``python -m studies.production [--clips N] [--workers N] [--frames later] [--measure]``: what a production takes.

With ``--measure`` the scheduler's share is measured (three minutes), and the requests are counted on a server here;
else the constants of docs/how-to/plan-a-million-clips.md stand.
"""

import argparse
from dataclasses import replace
from pathlib import Path

from catalogs.grids.form import MOST_CLIPS
from flows.cli import run_to_end
from flows.store.layout import Layout
from studies.production.plan import (
    CALLS,
    RECIPES,
    WORKERS,
    ClipCosts,
    count_requests,
    measure_scheduling,
    plan_production,
)


def print_plan() -> None:
    """Read the command line, and print what the production takes."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--clips", type=int, default=1_000_000)
    parser.add_argument("--workers", type=int, default=500)
    parser.add_argument("--frames", choices=("stored", "later"), default="stored")
    parser.add_argument("--cpu-s", type=float, help="of a clip [s]")
    parser.add_argument("--measure", action="store_true")
    asked = parser.parse_args()
    costs = RECIPES if asked.frames == "later" else ClipCosts()
    if asked.cpu_s is not None:
        costs = replace(costs, cpu_s=asked.cpu_s)
    if asked.measure:
        found = measure_scheduling(Layout(Path("/shared/sets/million")), WORKERS, CALLS)
        print(found, count_requests(), sep="\n")
        costs = replace(costs, scheduler_cpu_s=found["cpu_ms_per_call"] / 1e3)
    for name, value, unit in plan_production(asked.clips, asked.workers, MOST_CLIPS, costs):
        print(f"{name:36} {value:12,.1f} {unit}")


if __name__ == "__main__":
    run_to_end(print_plan)
