"""A stranger's dataset beside somebody's files, and every command that may be tried on it."""

import hashlib
import json
import os
import signal
import stat
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import musync
from flows.auditing.audit import audit_dataset
from flows.auditing.dataset_diff import compare_datasets
from flows.auditing.explain import explain_frame
from flows.auditing.repair import repair_dataset
from flows.auditing.signing import sign_dataset
from flows.auditing.verify import collect_garbage, verify_dataset
from flows.making.generate import generate_dataset
from flows.reading.describe import describe_dataset
from flows.reading.previews import make_films
from flows.reading.query import query_dataset
from flows.reading.report import make_report
from flows.store.layout import Layout
from studies.paper.sheets import draw_sheets
from studies.physics_judge.audit_physics import audit_physics
from tasks.errors import InputError

SECONDS = 60
"""A command that takes longer hangs [s]: on the toy dataset each takes less than one, and ten on a busy machine."""


@dataclass(frozen=True, kw_only=True)
class Stage:
    """Where an attack happens.

    Parameters
    ----------
    world : folder of it all
    original : the dataset that the stranger's is a copy of
    grid : file of the grid that both were made from
    """

    world: Path
    original: Layout
    grid: Path

    @property
    def dataset(self) -> Layout:
        return Layout(self.world / "inbox" / "data")

    @property
    def victim(self) -> Path:
        """Somebody's files; the folder lies beside that of the dataset."""
        return self.world / "victim"

    def out(self, command: str) -> str:
        return str(self.world / "results" / command)

    def manifest(self) -> Any:
        """The manifest as it stands, whatever form it has."""
        return json.loads(self.dataset.manifest.read_text())

    def first_clip(self) -> str:
        try:
            return (
                str(self.manifest()["clips"][0]["label"]) if self.dataset.manifest.is_file() else "dry/flat"
            )
        except (ValueError, LookupError, TypeError, RecursionError):
            return "dry/flat"


def _open_tables(stage: Stage) -> None:
    data = musync.open(stage.dataset.root)
    for table in ("clips", "ticks", "frames", "verdicts", "pairs"):
        data.pandas(table)
        if table != "verdicts":
            data.telemetry(table).head(3)


def _open_frames(stage: Stage) -> None:
    frames = musync.open(stage.dataset.root).frames
    for _, array in frames.arrays():
        array.attrs.asdict()


def _open_windows(stage: Stage) -> None:
    windows = musync.open(stage.dataset.root).torch(window=4, quarantined=True)
    for item in range(len(windows)):
        windows[item]


def _ask(stage: Stage) -> Any:
    return query_dataset(
        str(stage.dataset.root), "SELECT c.*, n FROM clips c, (SELECT count(*) AS n FROM frames)"
    )


COMMANDS: dict[str, Callable[[Stage], Any]] = {
    "verify": lambda s: verify_dataset(str(s.dataset.root)),
    "gc --dry-run": lambda s: collect_garbage(str(s.dataset.root), dry_run=True),
    "describe": lambda s: describe_dataset(str(s.dataset.root)),
    "sql": _ask,
    "open tables": _open_tables,
    "open frames": _open_frames,
    "open windows": _open_windows,
    "explain": lambda s: explain_frame(str(s.dataset.root), s.first_clip(), 3, out=s.out("explain")),
    "diff": lambda s: compare_datasets(str(s.original.root), str(s.dataset.root), out=s.out("diff")),
    "audit-physics": lambda s: audit_physics(str(s.dataset.root), out=s.out("audit-physics")),
    "sheets": lambda s: draw_sheets(str(s.dataset.root), s.out("sheets"), station=2.0),
    "preview": lambda s: make_films(str(s.dataset.root), s.out("preview")),
    "report": lambda s: make_report(str(s.dataset.root), out=s.out("report")),
    "audit": lambda s: audit_dataset(
        str(s.dataset.root), share=0.25, out=s.out("audit"), runner="threads", workers=1
    ),
    "repair": lambda s: repair_dataset(str(s.dataset.root), out=s.out("repair"), runner="threads", workers=1),
    "generate": lambda s: generate_dataset(str(s.grid), str(s.dataset.root), runner="threads", workers=1),
    "sign": lambda s: sign_dataset(str(s.dataset.root), key=str(s.world / "key.pem")),
    "gc": lambda s: collect_garbage(str(s.dataset.root)),
}
"""In the order in which they are tried: those that write last."""
LIGHT = (
    "verify",
    "gc --dry-run",
    "describe",
    "sql",
    "explain",
    "diff",
    "open frames",
    "repair",
    "sign",
    "generate",
    "gc",
)
"""Those that take some hundredths of a second: for attacks that most commands refuse at the door."""
WRITES = ("repair", "sign", "gc")


def listing(folder: Path, *without: Path) -> dict[str, str]:
    """Every entry below a folder with what it is and holds; links are not followed."""
    found = {}
    for place, folders, files in os.walk(folder):
        folders[:] = [name for name in folders if Path(place, name) not in without]
        for name in (*folders, *files):
            path = Path(place, name)
            found[str(path.relative_to(folder))] = _content(path)
    return found


def _content(path: Path) -> str:
    mode = path.lstat().st_mode
    if stat.S_ISLNK(mode):
        return f"link to {os.readlink(path)}"
    if stat.S_ISREG(mode):
        return f"{hashlib.sha256(path.read_bytes()).hexdigest()} {stat.S_IMODE(mode):o}"
    return f"{stat.S_IFMT(mode):o}"


class Hangs(BaseException):
    """A command took too long; no handler of errors takes it for one of its own."""


@contextmanager
def time_limit(seconds: float = SECONDS) -> Iterator[None]:
    """Raise `Hangs` where the block takes longer, also while it waits for a pipe."""

    def end(*_: object) -> None:
        raise Hangs(f"for more than {seconds} s")

    before = signal.signal(signal.SIGALRM, end)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


def endure(stage: Stage, *commands: str) -> dict[str, Any]:
    """Run commands on the stranger's dataset; each ends with a result or an `InputError`, and touches nobody's files.

    Returns
    -------
    Result or error by command.
    """
    before = listing(stage.world, stage.dataset.root, stage.world / "results")
    outcomes: dict[str, Any] = {}
    for command in commands:
        try:
            with time_limit():
                outcomes[command] = COMMANDS[command](stage)
        except InputError as error:
            assert error.problems and all(error.problems), f"{command} says nothing"
            assert "Traceback" not in str(error), f"{command}: {error}"
            outcomes[command] = error
        except (Exception, Hangs) as error:
            raise AssertionError(f"{command} ends in {type(error).__name__}: {str(error)[:300]}") from error
        after = listing(stage.world, stage.dataset.root, stage.world / "results")
        assert after == before, f"{command} touched {_difference(before, after)}"
    return outcomes


def refused(outcome: Any) -> bool:
    """Whether a command ended in a sentence, or said that something is wrong."""
    return isinstance(outcome, InputError) or (
        isinstance(outcome, dict) and (outcome.get("verified") is False or outcome.get("repaired") is False)
    )


def unrefused(outcomes: Mapping[str, Any], *commands: str) -> list[str]:
    """Which of these commands, or of all that were tried, went through."""
    return [name for name in commands or outcomes if not refused(outcomes[name])]


def _difference(before: dict[str, str], after: dict[str, str]) -> list[str]:
    return sorted(name for name in before.keys() | after.keys() if before.get(name) != after.get(name))
