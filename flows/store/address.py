"""A dataset by its address: a folder, or ``s3://bucket/prefix``, which is accessed through a local folder.

What reads a finished dataset gets a folder in the user's cache, named by the hash of the manifest: files come once, and
only with their recorded bytes. What writes, or asks whether the bytes are right, gets a folder of its own for its time,
filled from the store alone; clips go to the store as they are made, the receipt last. For a folder nothing happens.
"""

import atexit
import shutil
from collections.abc import Callable, Collection, Iterable, Iterator
from contextlib import ExitStack, contextmanager
from functools import lru_cache
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

from filelock import FileLock, Timeout

from catalogs.documents import parse_json
from catalogs.sentences import cap_problems
from flows.store.layout import Layout
from flows.store.lease import LOCK
from flows.store.links import refuse_foreign_entries
from flows.store.objects import Objects, is_address
from flows.store.sealed import check_manifest
from manifests.canonical import sha256_of, sha256_of_file
from manifests.manifest import recorded_files
from tasks.errors import InputError
from tasks.kernel_cache import cache_root

Wanted = Callable[[str], bool]
PREPARED = ("inputs/", "frames.zarr/", ".staging/")
"""Files that are sent before the plan, and mean nothing without it."""


def want_everything(name: str) -> bool:
    """Whether a file is wanted: every file is, those of unfinished clips too."""
    return True


def want_telemetry(name: str) -> bool:
    """Whether a file is needed to answer questions about numbers, or lists the frames."""
    return name.endswith("zarr.json") or not name.startswith(("frames.zarr/", "previews/"))


def want_manifest(name: str) -> bool:
    """Whether a file is wanted beside the manifest, which always is: none."""
    return False


def want_plan(name: str) -> bool:
    """Whether a worker needs the file to make a clip."""
    return name == "plan.json" or name.startswith("inputs/") or name.endswith("zarr.json")


def want_record(name: str) -> bool:
    """Whether a file records how far a dataset is, or was staged by a killed run."""
    return name in {"plan.json", "manifest.json"} or name.startswith(".staging/")


def want_progress(name: str) -> bool:
    """Whether a file is needed to continue a run: its plan, and which clips are complete."""
    return (
        want_plan(name)
        or name == "manifest.json"
        or (name.startswith(".staging/") and name.endswith(".json"))
    )


def open_for_reading(address: str | Path, wanted: Wanted = want_everything) -> Layout:
    """Return a finished dataset to read from; one that contains links is refused.

    Parameters
    ----------
    address : folder, or address in an object store
    wanted : which files have to be here; those of a folder are all

    Raises
    ------
    InputError
        The address holds no finished dataset, or files of it are missing or not the recorded ones, or it holds links.
    """
    if not is_address(address):
        layout = Layout(Path(address).resolve())
        refuse_foreign_entries(layout.root, wanted)
        return layout
    objects = Objects(str(address))
    content = objects.read("manifest.json")
    if content is None:
        raise InputError(_describe_unfinished(objects))
    layout = Layout(_find_mirrors() / sha256_of([content])[:32], objects.address)
    origin = f"{layout}/manifest.json"
    manifest = check_manifest(parse_json(content, origin, "manifest"), origin)
    recorded = {name: digest for name, (digest, _) in recorded_files(manifest).items() if wanted(name)}
    missing = {name for name in recorded if not (layout.root / name).is_file()}
    absent = objects.fetch(missing, layout.root)
    wrong = sorted(
        name for name in missing.difference(absent) if sha256_of_file(layout.root / name) != recorded[name]
    )
    for name in wrong:
        (layout.root / name).unlink()
    if absent or wrong:
        problems = [(name, "missing") for name in absent] + [
            (name, "not the recorded bytes") for name in wrong
        ]
        raise InputError(
            cap_problems(
                [f"{layout}/{name}: {fault}: musync lab repair makes it again" for name, fault in problems]
            )
        )
    objects.fetch(["manifest.json"], layout.root)
    return layout


@contextmanager
def open_for_writing(address: str, wanted: Wanted) -> Iterator[Layout]:
    """Yield a dataset to write to or to examine; of an address in an object store, the files that it holds now.

    Parameters
    ----------
    address : folder, or address in an object store; neither need exist
    wanted : which files of a store are brought here

    Raises
    ------
    InputError
        If the store cannot be used, or holds something else at that address.
    """
    if not is_address(address):
        yield Layout(Path(address).resolve())
        return
    objects = Objects(address)
    names = set(objects.sizes())
    if not {"plan.json", "manifest.json"} & names:
        if any(not name.startswith(PREPARED) for name in names):
            raise InputError(f"{address}: must be empty, new or a muSync dataset; it holds other objects")
        names = set()
    with _work_folder() as folder:
        layout = Layout(folder / "dataset", address)
        objects.fetch([name for name in names if wanted(name) and name != LOCK], layout.root)
        yield layout


def find_local(layout: Layout) -> Layout:
    """Return the dataset of a worker in a local folder; with an object store, no folder need be shared."""
    return layout if layout.origin is None or layout.root.parent.is_dir() else _open_elsewhere(layout)


def fetch_files(layout: Layout, paths: Iterable[Path]) -> None:
    """Fetch files that other machines or earlier runs sent to the store.

    Raises
    ------
    InputError
        If the store lacks some.
    """
    if layout.origin is not None:
        missing = [layout.relative(path) for path in paths if not path.is_file()]
        absent = Objects(layout.origin).fetch(missing, layout.root)
        if absent:
            raise InputError(
                f"{layout}: the store has lost {len(absent)} objects, {absent[0]} first: run it again"
            )


def send_files(layout: Layout, paths: Iterable[Path], last: Path | None = None) -> None:
    """Send files to the store; ``last`` is sent after the others, and marks them as complete."""
    if layout.origin is not None:
        objects = Objects(layout.origin)
        objects.send({layout.relative(path): path for path in paths})
        if last is not None:
            objects.write(layout.relative(last), last)


def send_first(layout: Layout, path: Path) -> None:
    """Send a file that must not exist in the store yet.

    Raises
    ------
    InputError
        If another run was faster.
    """
    if layout.origin is not None and (
        Objects(layout.origin).write(layout.relative(path), path, expected="") is None
    ):
        raise InputError(
            f"{layout}: another run has begun a dataset there just now: wait for it, or give another address"
        )


def remove_files(layout: Layout, paths: Collection[Path]) -> None:
    """Remove files from the store."""
    if layout.origin is not None:
        Objects(layout.origin).remove([layout.relative(path) for path in paths])


def forget_begun(layout: Layout) -> None:
    """Remove the files that a run sent to the store and that was stopped before its plan."""
    if layout.origin is not None:
        objects = Objects(layout.origin)
        objects.remove([name for name in objects.sizes() if name != LOCK])


def stored_bytes(layout: Layout) -> int:
    """Size of all files of a dataset where it lies [B]."""
    if layout.origin is not None:
        return sum(Objects(layout.origin).sizes().values())
    return sum(path.stat().st_size for path in layout.root.rglob("*") if path.is_file())


def frames_store(layout: Layout, recorded: Iterable[str]) -> Any:
    """Return the Zarr store of the frames, which are read from the folder or the object store.

    Parameters
    ----------
    layout : of the dataset
    recorded : files of the dataset that its manifest records
    """
    if layout.origin is None:
        return layout.frames
    inside = f"{layout.frames.name}/"
    names = frozenset(path.removeprefix(inside) for path in recorded if path.startswith(inside))
    return Objects(f"{layout.origin}/{layout.frames.name}").as_zarr(names)


def _describe_unfinished(objects: Objects) -> str:
    names = objects.sizes().keys()
    if "plan.json" not in names:
        return f"{objects.address}: there is no muSync dataset"
    done = sum(name.startswith(".staging/") and name.endswith(".json") for name in names)
    return (
        f"{objects.address}: the dataset must be finished; {done} clips of it are made: run its musync generate"
        " command again"
    )


def _find_mirrors() -> Path:
    return cache_root() / "stores"


@contextmanager
def _work_folder() -> Iterator[Path]:
    """Yield a new folder beside the mirrors, removed after the run; those of killed runs are removed now."""
    _find_mirrors().mkdir(parents=True, exist_ok=True)
    for left in _find_mirrors().glob("work-*"):
        with ExitStack() as stack:
            if _try_lock(left, stack):
                shutil.rmtree(left, ignore_errors=True)
    with ExitStack() as stack:
        folder = Path(mkdtemp(prefix="work-", dir=_find_mirrors()))
        while not _try_lock(folder, stack):  # another run has just removed it as a left-over
            folder = Path(mkdtemp(prefix="work-", dir=_find_mirrors()))
        try:
            yield folder
        finally:
            shutil.rmtree(folder, ignore_errors=True)


def _try_lock(folder: Path, stack: ExitStack) -> bool:
    """Lock a work folder for as long as the stack lives, if no live process holds it."""
    try:
        # whichever thread ends the run lets go
        stack.enter_context(FileLock(folder / "alive", blocking=False, thread_local=False))
    except (OSError, Timeout):
        return False
    return True


@lru_cache(maxsize=1)
def _open_elsewhere(layout: Layout) -> Layout:
    """This process's own folder for a run whose folder lies on another machine."""
    assert layout.origin is not None
    stack = ExitStack()
    atexit.register(stack.close)
    return stack.enter_context(open_for_writing(layout.origin, want_plan))
