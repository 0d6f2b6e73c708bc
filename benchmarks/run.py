"""Benchmarks by name, for ``musync lab bench``."""

from importlib import import_module
from typing import Any

from flows.store.outputs import Outputs
from tasks.errors import InputError

BENCHMARKS = (
    *(
        f"benchmarks.{name}"
        for name in ("rasteriser", "vehicle", "weather", "camera", "pose_checks", "pipeline")
    ),
    *(f"studies.peers.{name}" for name in ("queries", "store", "loading", "rollouts")),
)


def run_benchmarks(name: str | None = None, *, out: str | None = None) -> dict[str, Any]:
    """Run one benchmark, or all of them.

    Raises
    ------
    InputError
        For an unknown name.
    """
    modules = {module.rpartition(".")[2]: module for module in BENCHMARKS}
    if name is not None and name not in modules:
        raise InputError(f"bench {name}: no such benchmark; there are: {', '.join(modules)}")
    results = Outputs(out, "lab bench", "bench.json")
    chosen = [modules[name]] if name else modules.values()
    rows = [row for module in chosen for row in import_module(module).measure_rows()]
    results.write_json("bench.json", {"rows": rows})
    return {"rows": rows}
