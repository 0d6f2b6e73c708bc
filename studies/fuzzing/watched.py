"""Inputs read by processes that are watched: a hang, a crash or a process that grows is counted and ends nothing."""

import contextlib
import os
import re
import resource
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from multiprocessing import get_context
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any

from studies.fuzzing.desk import FINDINGS, Desk, Outcome

LONGEST_S = 10.0
"""An input on which a process works longer is a hang [s]: its own time, so that a busy machine makes none."""
LONGEST_WAIT_S = 120.0
"""And one that takes longer by the clock: then it waits for what never comes [s]."""
LOOKED_AT_S = 1.0
"""Time between two looks at the processes that are silent [s]."""
LARGEST_BYTES = 2**30
"""A process that holds more memory has grown beyond bounds."""
ROOM_BYTES = 3 * 2**30
"""Address space that a process may take beyond what it starts with; the machine is shared."""
START = "spawn"
"""How processes begin: with nothing of this one's memory."""
RETIRED_BYTES = 2**29
"""A process that has come to hold this much is replaced: what libraries keep is not the input's."""
CHUNK = 100
"""Inputs that a process is given at once."""


@dataclass(frozen=True, kw_only=True)
class Reading:
    """Outcome of one input, where it was raised and how, its time [s] and the memory of the process."""

    parser: str
    number: int
    outcome: Outcome
    detail: str = ""
    seconds: float = 0.0
    cpu_seconds: float = 0.0
    peak_bytes: int = 0


def read_watched(
    plan: Sequence[tuple[str, range]], shelf: Path, seed: int, workers: int
) -> Iterator[Reading]:
    """Yield the outcome of every input of a plan, as it becomes known.

    Parameters
    ----------
    plan : parser names and the numbers of their inputs
    shelf : where `write_documents` wrote the sound documents
    seed : of all inputs
    workers : processes
    """
    waiting = [
        (name, range(start, min(start + CHUNK, numbers.stop)))
        for name, numbers in plan
        for start in range(numbers.start, numbers.stop, CHUNK)
    ]
    waiting.reverse()
    staff: list[_Worker] = []
    try:
        while waiting or staff:
            while waiting and len(staff) < workers:
                staff.append(_Worker(shelf, seed))
                staff[-1].give(waiting.pop())
            for worker in _list_ready(staff):
                reading = worker.collect()
                if reading is not None:
                    yield reading
                if worker.alive and worker.left:
                    continue
                if worker.left:
                    waiting.append((worker.parser, worker.left))
                if worker.alive and waiting and worker.peak_bytes < RETIRED_BYTES:
                    worker.give(waiting.pop())
                else:
                    worker.stop()
                    staff.remove(worker)
    finally:
        for worker in staff:
            worker.stop()


def _list_ready(staff: "list[_Worker]") -> "list[_Worker]":
    """The workers that have a result, or are silent for too long."""
    speaking = wait([worker.line for worker in staff], timeout=LOOKED_AT_S)
    return [worker for worker in staff if worker.line in speaking or worker.is_late]


class _Worker:
    """A process that reads one input after the other and reports each."""

    def __init__(self, shelf: Path, seed: int):
        context = get_context(START)
        self.line, other = context.Pipe()
        self._process = context.Process(target=_serve_inputs, args=(other, str(shelf), seed), daemon=True)
        self._process.start()
        other.close()
        self.alive, self.parser, self.left, self.peak_bytes = True, "", range(0), 0
        self._heard, self._worked, self._started = 0.0, 0.0, False

    def give(self, task: tuple[str, range]) -> None:
        """Have it read these inputs."""
        self.parser, self.left = task
        self._heard, self._started = time.monotonic(), False
        with contextlib.suppress(BrokenPipeError):
            self.line.send(task)

    @property
    def is_late(self) -> bool:
        """Whether the input at hand takes too long; what comes before the first, such as imports, may take longer."""
        waited = time.monotonic() - self._heard
        if not self._started or waited <= LONGEST_S:
            return waited > 2 * LONGEST_WAIT_S
        return waited > LONGEST_WAIT_S or _cpu_seconds(self._process.pid) - self._worked > LONGEST_S

    def collect(self) -> Reading | None:
        """The next reading: as told, or, of a process that hangs or is gone, as seen from here."""
        if not self.line.poll() and self.is_late:
            return self._lost("hang", f"over {LONGEST_S:g} s")
        try:
            told: Reading | None = self.line.recv()
        except (EOFError, ConnectionResetError):
            self._process.join(10)
            return self._lost("traceback", f"the process ended with {self._process.exitcode}")
        self._started, self._heard = True, time.monotonic()
        self._worked = _cpu_seconds(self._process.pid)
        if told is None:
            return None
        self.left, self.peak_bytes = self.left[1:], told.peak_bytes
        if told.outcome == "memory":
            self.alive = False
        return told

    def _lost(self, outcome: Outcome, detail: str) -> Reading:
        self.alive = False
        number, self.left = self.left[0], self.left[1:]
        return Reading(parser=self.parser, number=number, outcome=outcome, detail=detail, seconds=LONGEST_S)

    def stop(self) -> None:
        """End the process."""
        self.line.close()
        self._process.kill()
        self._process.join()


def _cpu_seconds(process: int | None) -> float:
    """Time that a process has worked [s]; none of one that is gone."""
    try:
        fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return 0.0
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def _serve_inputs(line: Connection, shelf: str, seed: int) -> None:
    """Read inputs as they are asked for, until the line is closed."""
    silence = os.open(os.devnull, os.O_WRONLY)
    for channel in (1, 2):  # C libraries tell of damaged files there
        os.dup2(silence, channel)
    size = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (size + ROOM_BYTES, resource.RLIM_INFINITY))
    with tempfile.TemporaryDirectory() as place, contextlib.suppress(EOFError, BrokenPipeError):
        desk = Desk(Path(shelf), Path(place))
        while True:
            name, numbers = line.recv()
            desk.open(name)
            line.send(None)
            for number in numbers:
                line.send(_make_reading(desk, name, seed, number))


def read_peak() -> int:
    """Most memory that this process has held [B]; `getrusage` would count that of the process that started it."""
    status = Path("/proc/self/status").read_text()
    return int(re.findall(r"^VmHWM:\s+(\d+) kB$", status, flags=re.MULTILINE)[0]) * 1024


def _make_reading(desk: Desk, name: str, seed: int, number: int) -> Reading:
    before, cpu = time.monotonic(), time.process_time()
    _, outcome, detail = desk.read(name, seed, number)
    seconds, worked = time.monotonic() - before, time.process_time() - cpu
    peak = read_peak()
    if worked > LONGEST_S or seconds > LONGEST_WAIT_S:
        outcome, detail = "hang", f"{seconds:.1f} s; {detail}"
    if peak > LARGEST_BYTES:
        outcome, detail = "memory", f"{peak / 2**20:.0f} MiB; {detail}"
    return Reading(
        parser=name, number=number, outcome=outcome, detail=detail, seconds=seconds,
        cpu_seconds=worked, peak_bytes=peak,
    )  # fmt: skip


def count_outcomes(readings: Sequence[Reading]) -> dict[str, Any]:
    """Outcomes of one parser's inputs, their CPU time [s] and the largest process [MiB]."""
    outcomes = ("refused", "accepted", *FINDINGS)
    return {
        "inputs": len(readings),
        **{outcome: sum(reading.outcome == outcome for reading in readings) for outcome in outcomes},
        "cpu_s": round(sum(reading.cpu_seconds for reading in readings), 1),
        "slowest_s": round(max((reading.seconds for reading in readings), default=0.0), 2),
        "largest_mib": max((reading.peak_bytes for reading in readings), default=0) // 2**20,
    }
