"""Processors and memory of a process, on Linux and macOS."""

import os
import resource
import sys


def count_processors() -> int:
    """Processors that this process may use; where the system does not say, as on macOS, those of the machine [1]."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def measure_peak_memory() -> float:
    """The most memory that this process has held so far [MiB]; Linux gives it in KiB, macOS in bytes (getrusage(2))."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (2**20 if sys.platform == "darwin" else 2**10)
