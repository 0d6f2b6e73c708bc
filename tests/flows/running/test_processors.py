"""What a process has of its machine, on systems that tell it in other ways."""

import os
import resource
from types import SimpleNamespace

import pytest

from flows.running.processors import count_processors, measure_peak_memory


def test_where_the_system_tells_no_affinity_the_processors_of_the_machine_count(monkeypatch):
    monkeypatch.setattr(os, "sched_getaffinity", lambda process: {0, 3}, raising=False)
    assert count_processors() == 2
    monkeypatch.delattr(os, "sched_getaffinity")
    monkeypatch.setattr(os, "cpu_count", lambda: 6)
    assert count_processors() == 6
    monkeypatch.setattr(os, "cpu_count", lambda: None)
    assert count_processors() == 1


@pytest.mark.parametrize(("system", "unit"), [("linux", 2**10), ("darwin", 2**20)])
def test_peak_memory_is_told_in_the_unit_of_the_system(monkeypatch, system, unit):
    monkeypatch.setattr("sys.platform", system)
    monkeypatch.setattr(resource, "getrusage", lambda who: SimpleNamespace(ru_maxrss=300 * unit))
    assert measure_peak_memory() == 300.0
