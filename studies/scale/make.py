"""``python -m studies.scale.make GRID DIR``: drive a run of copied clips; a line of JSON a stage."""

import json
import os
import sys
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any
from unittest.mock import patch

import psutil

import flows.making.gathering as gathering
import flows.making.generate as generate
from studies.scale.copies import CopiedClips

EVERY_S = 0.02


class Sampler:
    """The largest memory of this process since the last call of ``start`` [MiB]."""

    def __init__(self) -> None:
        self._process, self.peak = psutil.Process(), 0.0
        threading.Thread(target=self._watch, daemon=True).start()

    def start(self) -> None:
        self.peak = self.now()

    def now(self) -> float:
        return self._process.memory_info().rss / 2**20

    def _watch(self) -> None:
        while True:
            self.peak = max(self.peak, self.now())
            time.sleep(EVERY_S)


def measure_stages(grid: str, folder: str) -> None:
    """Make the dataset and print a line for planning and for each stage."""
    copied, sampler = CopiedClips(), Sampler()

    def measured(stage: Callable[..., Any]) -> Callable[..., Any]:
        def run(*arguments: Any, **options: Any) -> Any:
            clock, processor, before = time.perf_counter(), time.process_time(), sampler.now()
            sampler.start()
            result = stage(*arguments, **options)
            row = {
                "stage": stage.__name__,
                "wall_s": time.perf_counter() - clock,
                "cpu_s": time.process_time() - processor,
                "before_mib": before,
                "peak_mib": max(sampler.peak, sampler.now()),
            }
            print(json.dumps(row), flush=True)
            return result

        return run

    with (
        # as on processes, whose work a thread does here
        patch.object(generate, "open_executor", lambda *_: ThreadPoolExecutor(1)),
        patch.object(generate, "make_clip", copied.make_clip),
        patch.object(gathering, "gather_part", copied.gather_part),
        patch.object(generate, "make_plan", measured(generate.make_plan)),
        patch.object(generate, "run_as_stage", measured),
        open(os.devnull, "w") as silence,
        patch.object(sys, "stderr", silence),
    ):
        generate.generate_dataset(grid, folder, runner="processes", pictures=False)


if __name__ == "__main__":
    measure_stages(*sys.argv[1:3])
