"""Inputs read by processes that are watched: a hang, a crash or a process that grows is counted and ends nothing."""

import contextlib
import io
import os
import re
import resource
import shutil
import tempfile
import time
import traceback
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from multiprocessing import get_context
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any, Literal

from benchmarks.fuzzing.inputs import Documents, Input, make_input
from benchmarks.fuzzing.parsers import BY_NAME, Parser
from tasks.errors import InputError

LONGEST_S = 10.0
"""An input on which a process works longer is a hang [s]: its own time, so that a busy machine makes none."""
LONGEST_WAIT_S = 120.0
"""And one that takes longer by the clock: then it waits for what never comes [s]."""
LARGEST_BYTES = 2**30
"""A process that holds more memory has grown beyond bounds."""
ROOM_BYTES = 3 * 2**30
"""Address space that a process may take beyond what it starts with; the machine is shared."""
LONGEST_MESSAGE = 20_000
"""Characters of all the sentences about one input."""
START = "spawn"
"""How processes begin: with nothing of this one's memory."""
RETIRED_BYTES = 2**29
"""A process that has come to hold this much is replaced: what libraries keep is not the input's."""
CHUNK = 100
"""Inputs that a process is given at once."""

Outcome = Literal["refused", "accepted", "traceback", "hang", "memory", "silent"]
FINDINGS: tuple[Outcome, ...] = ("traceback", "hang", "memory", "silent")


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


def read_input(documents: Documents, made: Input, folder: Path) -> tuple[Outcome, str]:
    """Hand an input to its parser.

    Parameters
    ----------
    documents : of the parser
    made : the input
    folder : holds the sound document, and holds it again afterwards
    """
    parser, sound = documents.parser, documents.files[made.document]
    try:
        for name, content in made.changed.items():
            (folder / name).write_bytes(content)
        return _read_documents(parser, folder, made.broken)
    finally:
        if parser.writes:
            shutil.rmtree(folder)
            lay_out(sound, folder)
        for name in made.changed:
            (folder / name).write_bytes(sound[name])


def _read_documents(parser: Parser, folder: Path, broken: str | None) -> tuple[Outcome, str]:
    try:
        parser.read(folder)
    except InputError as error:
        length = sum(map(len, error.problems))
        if not 0 < length <= LONGEST_MESSAGE or not all(error.problems):
            return "traceback", f"sentences of {length} characters"
        return "refused", error.problems[0]
    except BaseException as error:
        if isinstance(error, KeyboardInterrupt | SystemExit):
            raise
        return (
            "traceback",
            f"{_find_place(error)} {type(error).__name__}: {' '.join(str(error).split())[:120]}",
        )
    return ("silent", f"accepted although {broken}") if broken else ("accepted", "")


def _find_place(error: BaseException) -> str:
    """File and line of the project from which an exception comes."""
    root = Path(__file__).parents[2]
    own = [
        f"{Path(frame.filename).relative_to(root)}:{frame.lineno}"
        for frame in traceback.extract_tb(error.__traceback__)
        if frame.filename.startswith(f"{root}/")
        and "/.venv/" not in frame.filename
        and Path(frame.filename).is_file()
    ]
    return own[-1] if own else "elsewhere"


def lay_out(files: dict[str, bytes], folder: Path) -> None:
    """Write a document's files below a folder."""
    for name, content in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)


def write_documents(parsers: Sequence[Parser], shelf: Path) -> None:
    """Write the sound documents of the parsers, a folder each, and see that their loaders take them."""
    for parser in parsers:
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            parser.write(shelf / parser.name)
        for document in sorted((shelf / parser.name).iterdir()):
            with tempfile.TemporaryDirectory() as place:
                copy = shutil.copytree(document, Path(place) / document.name)
                parser.read(copy)


class Desk:
    """Sound documents laid out where inputs are read, as they are needed.

    Parameters
    ----------
    shelf : where `write_documents` wrote them
    place : scratch folder
    """

    def __init__(self, shelf: Path, place: Path):
        self._shelf, self._place = shelf, place
        self._documents: dict[str, Documents] = {}

    def read(self, name: str, seed: int, number: int) -> tuple[Input, Outcome, str]:
        """Make and read one input."""
        documents = self.open(name)
        made = make_input(documents, seed, number)
        return made, *read_input(documents, made, self._place / name / made.document)

    def open(self, name: str) -> Documents:
        """The documents of a parser; read once, so that no input's time is that of imports and compilers."""
        if name not in self._documents:
            documents = self._documents[name] = Documents(BY_NAME[name], self._shelf / name)
            for document, files in documents.files.items():
                folder = self._place / name / document
                lay_out(files, folder)
                read_input(
                    documents, Input(document=document, changed={}, what="nothing", broken=None), folder
                )
        return self._documents[name]


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
    """The workers that have something to tell, or are silent for too long."""
    speaking = wait([worker.line for worker in staff], timeout=1.0)
    return [worker for worker in staff if worker.line in speaking or worker.is_late]


class _Worker:
    """A process that reads one input after the other and tells of each."""

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
