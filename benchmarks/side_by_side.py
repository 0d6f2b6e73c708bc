"""Rows of a benchmark that holds this code beside its peers: least processor time of several calls, and the ratio."""

import time
from collections.abc import Callable
from typing import Any

REPEATS = 5


def make_row(
    name: str, value: float, unit: str, peer: str | None = None, peer_value: float | None = None
) -> dict[str, Any]:
    """Return a row of a benchmark; ``ratio`` is value over the peer's value.

    Parameters
    ----------
    name, value, unit : what was measured
    peer, peer_value : what the value is held against, and its value
    """
    ratio = None if peer_value is None else value / peer_value
    return {"name": name, "value": value, "unit": unit, "peer": peer, "ratio": ratio}


def least_cpu_s(work: Callable[[], object], repeats: int = REPEATS) -> float:
    """Return the least processor time of a call, of all threads, after one that loads what it needs [CPU-s].

    Parameters
    ----------
    work : what is measured
    repeats : measured calls [1]
    """
    work()
    times = []
    for _ in range(repeats):
        started = time.process_time()
        work()
        times.append(time.process_time() - started)
    return min(times)


def print_rows(rows: list[dict[str, Any]]) -> None:
    """Print a line a row."""
    for row in rows:
        ratio = "" if row["ratio"] is None else f"{row['ratio']:8.3f} of {row['peer']}"
        print(f"{row['name']:52} {row['value']:12.5g} {row['unit']:9} {ratio}")
