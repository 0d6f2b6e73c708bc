"""The staging folder of a dataset: what muSync puts there, by the form of its name, and taking just that away again."""

import errno
import os
import re
import shutil
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from flows.store.address import remove_files
from flows.store.layout import PARTIAL, STAGED_TABLES, Layout, is_alive
from flows.store.lock import sole_writer
from manifests.canonical import ID_LENGTH
from tasks.errors import InputError

BEGUN = "begun"
"""Written before anything else: until there is a plan, `inputs` and `frames.zarr` beside it are muSync's own."""
_SCRATCH = re.compile(r"scratch-(?:(\d+)-)?\w+")
"""The number is that of the process that made it."""
_PLAN_HALF_WRITTEN = re.compile(rf"plan\.json\.\d+-\d+{re.escape(PARTIAL)}")
_STAGED = re.compile(
    rf"{BEGUN}|[0-9a-f]{{{ID_LENGTH}}}\.(json|({'|'.join(STAGED_TABLES)})\.parquet)|.*{re.escape(PARTIAL)}"
)


def staged_files(layout: Layout) -> list[Path]:
    """Files in the staging folder that muSync wrote, but for the lock."""
    return sorted(path for path in _list_entries(layout) if _STAGED.fullmatch(path.name) and path.is_file())


def is_of_begun_run(layout: Layout, name: str) -> bool:
    """Whether an entry of the folder is of a run that was stopped before its plan was there, by its name."""
    if name == layout.staging.name:
        return True
    ours = name in {layout.inputs.name, layout.frames.name} or _PLAN_HALF_WRITTEN.fullmatch(name) is not None
    return ours and (layout.staging / BEGUN).is_file()


def partial_files(layout: Layout) -> list[Path]:
    """Files anywhere in the dataset that a killed run was writing; committed files never have such a name."""
    return sorted(path for path in layout.root.rglob(f"*{PARTIAL}") if path.is_file())


def abandoned_scratch(layout: Layout) -> list[Path]:
    """Scratch folders of runs that are no more."""
    return sorted(
        path
        for path in _list_entries(layout)
        if (named := _SCRATCH.fullmatch(path.name))
        and path.is_dir()
        and _is_abandoned(Layout(path), named[1])
    )


def left_overs(layout: Layout) -> list[Path]:
    """List what killed runs left: half-written files, scratch folders, and staged files of a finished dataset."""
    staged = staged_files(layout) if layout.manifest.is_file() else []
    return sorted({*partial_files(layout), *abandoned_scratch(layout), *staged})


def remove_staged(paths: Iterable[Path]) -> None:
    """Remove files and folders of the lists above."""
    for path in paths:
        if path.is_dir():
            shutil.rmtree(path)
        else:
            path.unlink(missing_ok=True)


def remove_staging(layout: Layout) -> None:
    """Remove the lock and the folder of a finished dataset; what others put there keeps the folder."""
    (layout.staging / "lock").unlink(missing_ok=True)
    with suppress(OSError):
        layout.staging.rmdir()


def remove_left_overs(layout: Layout) -> list[Path]:
    """Remove the files that killed runs left, in a store too, and return their paths; needs the writer's lock."""
    found = left_overs(layout)
    remove_files(layout, [path for path in found if path.is_file()])
    remove_staged(found)
    if layout.manifest.is_file():
        remove_staging(layout)
    return found


@contextmanager
def scratch_dataset(layout: Layout) -> Iterator[Layout]:
    """A dataset of its own in which clips of another are made again; it goes with the run.

    It lies in the dataset's staging folder, which workers reach as they reach the dataset, or, where nothing can be
    written there, among the temporary files of this machine.

    Parameters
    ----------
    layout : of the dataset

    Raises
    ------
    InputError
        Whatever the block raises, about the dataset: the scratch folder is gone when the sentences are read.
    """
    try:
        layout.staging.mkdir(exist_ok=True)
        folder = Path(tempfile.mkdtemp(prefix=f"scratch-{os.getpid()}-", dir=layout.staging))
    except OSError as error:
        if error.errno not in {errno.EROFS, errno.EACCES, errno.EPERM}:
            raise
        folder = Path(tempfile.mkdtemp(prefix="musync-scratch-"))
    scratch = Layout(folder)
    try:
        with sole_writer(
            scratch
        ):  # without a lock it is left over from a killed run, or its maker is about to lock it
            yield scratch
    except InputError as error:
        raise InputError([problem.replace(str(folder), str(layout)) for problem in error.problems]) from error
    finally:
        shutil.rmtree(folder, ignore_errors=True)
        with suppress(OSError):
            layout.staging.rmdir()


def _is_abandoned(scratch: Layout, maker: str | None) -> bool:
    """Whether no live run holds a scratch folder; one without a lock is just being made, while its maker lives."""
    if not (scratch.staging / "lock").is_file():
        return maker is not None and not is_alive(int(maker))
    try:
        with sole_writer(scratch):
            return True
    except InputError:
        return False


def _list_entries(layout: Layout) -> list[Path]:
    return list(layout.staging.iterdir()) if layout.staging.is_dir() else []
