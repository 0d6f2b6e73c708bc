"""Benchmarks by name, for ``musync lab bench``."""

from importlib import import_module
from typing import Any

from flows.store.outputs import Outputs
from tasks.errors import InputError

BENCHMARKS = (
    "rasteriser", "vehicle", "weather", "camera", "pose_checks", "pipeline", "queries", "store", "loading", "rollouts",
)  # fmt: skip


def run_benchmarks(name: str | None = None, *, out: str | None = None) -> dict[str, Any]:
    """Run one benchmark, or all of them.

    Raises
    ------
    InputError
        For an unknown name.
    """
    if name is not None and name not in BENCHMARKS:
        raise InputError(f"bench {name}: no such benchmark; there are: {', '.join(BENCHMARKS)}")
    results = Outputs(out, "lab bench", "bench.json")
    rows = [
        row
        for chosen in ([name] if name else BENCHMARKS)
        for row in import_module(f"benchmarks.{chosen}").measure_rows()
    ]
    results.write_json("bench.json", {"rows": rows})
    return {"rows": rows}
