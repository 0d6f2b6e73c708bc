"""From measured constants to what a large dataset takes: time, memory, files, requests and money."""

from collections.abc import Iterator
from dataclasses import dataclass
from math import ceil

from flows.running.runner import IN_FLIGHT
from tasks.errors import InputError

Row = tuple[str, float, str]
"""Name, value and unit."""
SECONDS_PER_HOUR = 3600


@dataclass(frozen=True, kw_only=True)
class ClipCosts:
    """Cost of one clip; the defaults are of 81 frames at 480 x 320 on the built-in street (docs/how-to).

    Parameters
    ----------
    cpu_s : of a worker that makes it [s]
    gather_cpu_s : of a worker that gathers its tables with those of others [s]
    driver_cpu_s : of the driver, planning and sealing [s]
    scheduler_cpu_s : of scheduler and driver, handing it out [s]
    frames_bytes, tables_bytes : stored [B]
    manifest_bytes : of its record in the manifest [B]
    files : that stay [1]
    puts, gets : requests to an object store while it is made and sealed [1]
    """

    cpu_s: float = 11.2
    gather_cpu_s: float = 0.012
    driver_cpu_s: float = 0.0015
    scheduler_cpu_s: float = 0.0062
    frames_bytes: float = 29.9e6
    tables_bytes: float = 0.22e6
    manifest_bytes: float = 2000
    files: float = 3.02
    puts: float = 6.02
    gets: float = 3.0


@dataclass(frozen=True, kw_only=True)
class Prices:
    """List prices in dollars.

    Parameters
    ----------
    core_hour : of one virtual core with 4 GB
    put_per_thousand, get_per_thousand : of requests
    gigabyte_month : stored
    """

    core_hour: float = 0.0408
    put_per_thousand: float = 0.005
    get_per_thousand: float = 0.0004
    gigabyte_month: float = 0.023


def plan_production(
    clips: int, workers: int, most_clips: int, costs: ClipCosts | None = None, prices: Prices | None = None
) -> Iterator[Row]:
    """Yield what a production takes, a row at a time.

    Parameters
    ----------
    clips, workers : of the production [1]
    most_clips : of one grid [1]
    costs, prices : None takes the defaults

    Raises
    ------
    InputError
        If there is no clip, no worker, or a clip takes no time.
    """
    c, p = costs or ClipCosts(), prices or Prices()
    asked = {"--clips": clips, "--workers": workers, "--cpu-s": c.cpu_s}
    if wrong := [
        f"{name} must be more than 0; it is {value:g}" for name, value in asked.items() if not value > 0
    ]:
        raise InputError(wrong)
    work_s = clips * (c.cpu_s + c.gather_cpu_s)
    making_s, driver_s = work_s / workers, clips * (c.driver_cpu_s + c.scheduler_cpu_s)
    size = clips * (c.frames_bytes + c.tables_bytes)
    requests = clips * (c.puts * p.put_per_thousand + c.gets * p.get_per_thousand) / 1000
    yield "datasets, one a grid", ceil(clips / most_clips), "1"
    yield "clips handed out a second", clips / making_s, "1/s"
    yield "workers' time", work_s / SECONDS_PER_HOUR, "CPU-h"
    yield "making, all workers busy", making_s / SECONDS_PER_HOUR, "h"
    yield "driver and scheduler", driver_s / SECONDS_PER_HOUR, "CPU-h"
    yield "workers that one driver keeps busy", min(c.cpu_s / c.scheduler_cpu_s, IN_FLIGHT), "1"
    yield "stored", size / 1e12, "TB"
    yield "written a second", size / making_s / 1e6, "MB/s"
    yield "manifest of one dataset", min(clips, most_clips) * c.manifest_bytes / 1e6, "MB"
    yield "files", clips * c.files / 1e6, "million"
    yield "requests to a store", clips * (c.puts + c.gets) / 1e6, "million"
    yield "requests a second", clips * (c.puts + c.gets) / making_s, "1/s"
    yield "cores", work_s / SECONDS_PER_HOUR * p.core_hour, "$"
    yield "requests", requests, "$"
    yield "a month of storage", size / 1e9 * p.gigabyte_month, "$"
