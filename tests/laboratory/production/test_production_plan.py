"""Time, bytes and money of a large production follow from those of a clip."""

from pathlib import Path

import pytest

from flows.store.layout import Layout
from studies.production.plan import ClipCosts, Prices, measure_scheduling, plan_production
from tasks.errors import InputError

COSTS = ClipCosts(
    cpu_s=9.0, gather_cpu_s=1.0, driver_cpu_s=0.1, scheduler_cpu_s=0.02, frames_bytes=1e6, tables_bytes=1e6,
    manifest_bytes=1000, files=3.0, puts=6.0, gets=4.0,
)  # fmt: skip
PRICES = Prices(core_hour=0.1, put_per_thousand=1.0, get_per_thousand=0.5, gigabyte_month=0.01)


def test_a_production_is_counted_from_its_clips():
    rows = {name: (value, unit) for name, value, unit in plan_production(36_000, 100, 10_000, COSTS, PRICES)}
    expected = {
        "datasets, one a grid": (4, "1"),
        "clips handed out a second": (10.0, "1/s"),
        "workers' time": (100.0, "CPU-h"),
        "making, all workers busy": (1.0, "h"),
        "driver and scheduler": (1.2, "CPU-h"),
        "workers that one driver keeps busy": (450.0, "1"),
        "stored": (0.072, "TB"),
        "written a second": (20.0, "MB/s"),
        "manifest of one dataset": (10.0, "MB"),
        "files": (0.108, "million"),
        "requests to a store": (0.36, "million"),
        "requests a second": (100.0, "1/s"),
        "cores": (10.0, "$"),
        "requests": (288.0, "$"),
        "a month of storage": (0.72, "$"),
    }
    assert {name: unit for name, (_, unit) in rows.items()} == {
        name: unit for name, (_, unit) in expected.items()
    }
    assert {name: value for name, (value, _) in rows.items()} == pytest.approx(
        {name: value for name, (value, _) in expected.items()}
    )


@pytest.mark.minutes
def test_workers_of_another_process_are_kept_busy_and_only_scheduler_and_driver_are_counted():
    found = measure_scheduling(Layout(Path("/shared/sets/x")), workers=4, calls=12, clip_s=1.0)
    assert found["calls"] == 12 and 0.5 < found["busy"] <= 1.0
    assert 0.0 < found["cpu_ms_per_call"] < 200.0


def test_no_clips_no_workers_and_clips_that_take_no_time_are_refused_together():
    with pytest.raises(InputError) as caught:
        list(plan_production(-5, 0, 10_000, ClipCosts(cpu_s=float("nan"))))
    assert list(caught.value.problems) == [
        "--clips must be more than 0; it is -5",
        "--workers must be more than 0; it is 0",
        "--cpu-s must be more than 0; it is nan",
    ]
