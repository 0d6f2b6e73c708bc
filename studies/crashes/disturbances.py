"""A run sleeps, its clock jumps, it may not write, another writes there too: are the bytes those of a run left alone?

The runs make telemetry alone; the disturbance comes when the first clip is committed.
"""

import ctypes
import os
import signal
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from flows.store.layout import Layout
from studies.crashes.kills import GRID, files_of
from studies.crashes.processes import Cluster, Process, finish_run, kill_group, list_children, start_run

MORE_CLIPS = (
    "  speed: {v30: {initial_speed_km_h: 30}, v50: {initial_speed_km_h: 50}, v70: {initial_speed_km_h: 70}}\n"
)
DAY_S = 86_400
DROP_FROM_BOUNDING_SET, DAC_OVERRIDE, DAC_READ_SEARCH = 24, 1, 2
"""Linux: a call of prctl, and what lets root pass over the modes of files."""


def disturb_runs(place: Path, stop_s: float) -> dict[str, dict[str, Any]]:
    """Disturb one run after another.

    Parameters
    ----------
    place : folder to work in; made here
    stop_s : how long a process is stopped [s]

    Returns
    -------
    By disturbance: ``right``; ``committed``, the clips at the time of it; what was ``said``. The clock is turned with
    the library of the package libfaketime; where that is missing, its two rows are.
    """
    grid, whole = place / "grid.yaml", place / "whole"
    place.mkdir()
    grid.write_text(GRID + MORE_CLIPS)
    start_run(grid, whole, None, "--no-frames").wait()
    wanted = files_of(whole)
    found: dict[str, dict[str, Any]] = {}

    def disturb(name: str, act: Callable[[Process, Path], str], **how: Any) -> None:
        folder = place / name.replace(" ", "-")
        run = start_run(grid, folder, how.pop("scheduler", None), "--no-frames", **how)
        try:
            committed = _wait_for_clip(run, Layout(folder))
            said = act(run, folder)
            right = run.wait(600) == 0 and files_of(folder) == wanted
        finally:
            kill_group(run)
        found[name] = {"right": right, "committed": committed, "said": said}
        print(f"{name}: {found[name]}", file=sys.stderr)

    def stop(pids: Callable[[Process], list[int]]) -> Callable[[Process, Path], str]:
        return lambda run, _: _stop_processes(pids(run), stop_s)

    disturb("driver stopped", stop(lambda run: [run.pid]))
    disturb("worker stopped", stop(lambda run: list_children(run)[:1]))
    disturb("run stopped", stop(lambda run: [run.pid, *list_children(run)]))
    cluster = Cluster(place / "cluster")
    try:
        disturb(
            "worker of a cluster stopped", stop(lambda _: [cluster.workers[0].pid]), scheduler=cluster.address
        )
    finally:
        cluster.stop()
    for name, seconds in (("clock a day ahead", DAY_S), ("clock a day back", -DAY_S)):
        if library := _find_clock():
            clock = place / name.replace(" ", "-").replace("clock", "turned")
            clock.write_text("+0")
            settings = {
                "LD_PRELOAD": library, "FAKETIME_TIMESTAMP_FILE": str(clock), "FAKETIME_NO_CACHE": "1",
                "FAKETIME_DONT_FAKE_MONOTONIC": "1", "NO_FAKE_STAT": "1",
            }  # fmt: skip
            disturb(name, lambda *_, clock=clock, to=seconds: _turn_clock(clock, to), settings=settings)
    disturb("second writer", lambda run, folder: _write_too(run, grid, folder))
    said = found["second writer"]["said"]
    found["second writer"]["right"] &= (
        said.startswith("2: ") and "another run is writing this dataset" in said
    )
    found["folder of another"] = write_without_right(grid, place / "closed")
    return found


def _wait_for_clip(run: Process, layout: Layout) -> int:
    committed = 0
    while not committed and run.poll() is None:
        time.sleep(0.005)
        committed = len(list(layout.staging.glob("*.json")))
    return committed


@contextmanager
def _stopped(pids: list[int]) -> Iterator[None]:
    if not pids:
        raise RuntimeError("the run had ended, and nothing was left to stop")
    for pid in pids:
        os.kill(pid, signal.SIGSTOP)
    try:
        yield
    finally:
        for pid in pids:
            os.kill(pid, signal.SIGCONT)


def _stop_processes(pids: list[int], seconds: float) -> str:
    with _stopped(pids):
        time.sleep(seconds)
    return ""


def _find_clock() -> str | None:
    found = find_spec("libfaketime")
    folders = list(found.submodule_search_locations or ()) if found else []
    return next((str(path) for folder in folders for path in Path(folder).rglob("libfaketime.so.1")), None)


def _turn_clock(clock: Path, seconds: int) -> str:
    turned = clock.with_suffix(".new")
    turned.write_text(f"{seconds:+d}")
    turned.replace(clock)
    return ""


def _write_too(run: Process, grid: Path, folder: Path) -> str:
    with _stopped([run.pid, *list_children(run)]):  # or it may have ended before the second asks
        code, said = finish_run(grid, folder, "--no-frames")
    return f"{code}: {said.strip()}"


def write_without_right(grid: Path, closed: Path) -> dict[str, Any]:
    """Make a dataset in a folder that nobody may write to, without the rights by which root may."""
    closed.mkdir(mode=0o555)
    code, said = finish_run(grid, closed / "data", "--no-frames", before=_obey_modes)
    told = code == 2 and said.count("\n") == 1 and "there is no permission" in said
    return {"right": told and not list(closed.iterdir()), "committed": 0, "said": f"{code}: {said.strip()}"}


def _obey_modes() -> None:
    if os.geteuid() == 0:
        for right in (DAC_OVERRIDE, DAC_READ_SEARCH):
            ctypes.CDLL(None).prctl(DROP_FROM_BOUNDING_SET, right)
