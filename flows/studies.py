"""Studies of the vehicle model: the surface-parameter sensitivity, agreement with reference traces, speed."""

import time
from importlib import import_module
from pathlib import Path
from typing import Any

from flows.store.layout import write_json
from tasks.errors import InputError

BENCHMARKS = ("rasteriser", "vehicle", "pose_checks", "pipeline")


def sensitivity(*, out: str | None = None) -> dict[str, Any]:
    """The paper's Appendix E: envelopes and rank correlations, beside the printed figures."""
    from tasks.vehicle.sensitivity import sensitivity_study

    from catalogs.surfaces import load_surface
    from catalogs.vehicles import load_vehicle

    vehicle, surface = load_vehicle("paper-reference"), load_surface("dense-asphalt")
    started = time.process_time()
    result = sensitivity_study(vehicle, surface)
    return _written(result | {"cpu_s": time.process_time() - started}, out, "sensitivity.json")


def bench(name: str | None = None, *, out: str | None = None) -> dict[str, Any]:
    """Run one benchmark, or all of them.

    Raises
    ------
    InputError
        For an unknown name.
    """
    if name is not None and name not in BENCHMARKS:
        raise InputError(f"bench {name}: no such benchmark; there are: {', '.join(BENCHMARKS)}")
    rows = [
        row
        for chosen in ([name] if name else BENCHMARKS)
        for row in import_module(f"benchmarks.{chosen}").rows()
    ]
    return _written({"rows": rows}, out, "bench.json")


def _written(result: dict[str, Any], out: str | None, name: str) -> dict[str, Any]:
    if out is not None:
        write_json(Path(out) / name, result)
    return result
