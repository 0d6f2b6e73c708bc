"""Results in a folder of the user's: a command overwrites and deletes only files that it wrote there itself before.

The folder's marker lists them by command. A name stands in it before the file is there, so that a killed command
knows its files again. What a marker from elsewhere claims is still only a name inside the folder, and no link is
followed.
"""

import errno
import fcntl
import json
import os
import re
import stat
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from glob import escape
from pathlib import Path, PurePosixPath
from typing import Any

from catalogs.documents import parse_json
from catalogs.sentences import cap_problems
from flows.store.layout import PARTIAL, list_abandoned, write_atomically, write_json
from tasks.errors import InputError

MARKER = ".musync-written"
FORMAT = "musync-written/1"
MOST_BYTES = 64 * 2**20
"""Size of the largest marker that is read [B]: half a million names."""
NAME_BYTES = 220
"""Longest name of a file [B]: file systems take 255, and a file that is being written has a longer name."""


class Outputs:
    """Files of one command in a folder; without a folder nothing is written.

    Parameters
    ----------
    out : the folder, which need not exist; None writes nothing
    command : as the user types it after ``musync``
    names : of the files, relative to the folder, with ``/`` between its parts

    Raises
    ------
    InputError
        Listing every file in the way that the command did not write, every link, and a folder that cannot be used or
        lies in a dataset.
    """

    def __init__(self, out: str | Path | None, command: str, *names: str) -> None:
        self.folder = None if out is None else Path(out)
        self.command, self.names = command, names
        self._claimed = self._alone = False
        if self.folder is not None:
            self._refuse_strangers(self.folder)

    def write(self, name: str, content: str | bytes | memoryview) -> None:
        """Write a file whole or not at all."""
        if self.folder is not None:
            write_atomically(self.path(name), content.encode() if isinstance(content, str) else content)

    def write_json(self, name: str, value: Any) -> None:
        """Write readable JSON; the same value gives the same bytes."""
        if self.folder is not None:
            write_json(self.path(name), value)

    def path(self, name: str) -> Path:
        """Where a file of this command lies; from now on the marker lists it."""
        if self.folder is None or name not in self.names:
            raise ValueError(f"{name} is none of the files that {self._title} has announced")
        if not self._claimed:
            self._refuse_strangers(self.folder)
            self.folder.mkdir(parents=True, exist_ok=True)
            with self._locked(self.folder):
                self._remove_abandoned(self.folder)
                _write_marker(self.folder, read_marker(self.folder) | dict.fromkeys(self.names, self.command))
            self._claimed = True
        return self.folder / name

    def remove_others(self, like: Callable[[str], object]) -> None:
        """Delete what earlier calls of the command wrote and this one does not.

        Parameters
        ----------
        like : whether a name has the form of those that may be deleted
        """
        if self.folder is None:
            return
        with self._locked(self.folder):
            known = read_marker(self.folder)
            mine = {name for name, command in known.items() if command == self.command}
            gone = {name for name in mine - set(self.names) if like(name)}
            for name in gone:
                if _in_the_way(self.folder, name, known, self.command) is None:
                    (self.folder / name).unlink(missing_ok=True)
            _write_marker(self.folder, {name: command for name, command in known.items() if name not in gone})

    @contextmanager
    def alone(self) -> Iterator[None]:
        """Lock the folder against other calls, and remove files that killed calls of this command left.

        Raises
        ------
        InputError
            If one is writing there now.
        """
        if self.folder is None:
            yield
            return
        self.folder.mkdir(parents=True, exist_ok=True)
        with _lock_folder(self.folder, wait=False):
            self._alone = True
            try:
                self._clear_halves(self.folder)
                yield
            finally:
                self._alone = False

    def _clear_halves(self, folder: Path) -> None:
        for name, command in read_marker(folder).items():
            if command == self.command and _no_folder_above(folder, name) is None:
                path = folder / name
                for half in path.parent.glob(f"{escape(path.name)}.*{PARTIAL}"):
                    if stat.S_ISREG(half.lstat().st_mode):
                        half.unlink()

    def _remove_abandoned(self, folder: Path) -> None:
        """Remove what a killed call was writing; the folders above are those that `_refuse_strangers` has looked at."""
        by_folder: dict[Path, set[str]] = {folder: {MARKER}}
        for name in self.names:
            by_folder.setdefault((folder / name).parent, set()).add(PurePosixPath(name).name)
        for parent, names in by_folder.items():
            for half in list_abandoned(parent, names):
                if stat.S_ISREG(half.lstat().st_mode):
                    half.unlink()

    def _locked(self, folder: Path) -> AbstractContextManager[None]:
        return nullcontext() if self._alone else _lock_folder(folder, wait=True)

    def _refuse_strangers(self, folder: Path) -> None:
        problems = [f"{folder}: {problem}" for problem in map(find_name_problem, self.names) if problem]
        nearest = next(parent for parent in (folder, *folder.absolute().parents) if os.path.lexists(parent))
        if not nearest.is_dir():
            problems.append(f"{nearest}: must be a folder; name another one for the files of {self._title}")
        elif not os.access(nearest, os.W_OK | os.X_OK):
            problems.append(f"{nearest}: must be a folder that can be written; name another one")
        else:
            problems += find_dataset_problems(folder, folder)
        if problems:
            raise InputError(problems)
        if not folder.is_dir():
            return
        known = read_marker(folder)
        found = (_in_the_way(folder, name, known, self.command) for name in self.names)
        strangers = list(dict.fromkeys(problem for problem in found if problem is not None))
        if strangers:
            raise InputError(cap_problems(strangers))

    @property
    def _title(self) -> str:
        return f"musync {self.command}"


def find_dataset_problems(out: object, folder: Path) -> list[str]:
    """Return a sentence where what is to be written would join the files of a dataset.

    Parameters
    ----------
    out : what is to be written, as messages call it
    folder : that must neither be a dataset nor lie in one; it need not exist
    """
    resolved = folder.resolve()
    return [
        f"{out}: must lie outside the dataset {around.name}, whose files are all recorded; name another folder"
        for around in (resolved, *resolved.parents)
        if (around / "inputs").is_dir()
        and ((around / "plan.json").is_file() or (around / "manifest.json").is_file())
    ][:1]


def find_name_problem(name: str) -> str | None:
    """Why a name cannot be a file's inside the folder; None if it can."""
    parts = PurePosixPath(name).parts
    if not parts or name != "/".join(parts) or parts[0] == "/" or ".." in parts:
        return f"{name!r} must be a name inside the folder, without '..' or a slash in front"
    if re.search(r"[\x00-\x1f\x7f\ud800-\udfff]", name):
        return f"{name!r} must be a file name without control characters"
    if any(len(part.encode()) > NAME_BYTES for part in parts):
        return f"{name[:40]!r}... must be at most {NAME_BYTES} bytes long; it has {len(name.encode())}"
    return None


def read_marker(folder: Path) -> dict[str, str]:
    """Which command wrote which file of a folder; empty where no marker lies.

    Raises
    ------
    InputError
        If the marker is no file of ours.
    """
    path = folder / MARKER
    if not os.path.lexists(path):
        return {}
    facts = path.lstat()
    if not stat.S_ISREG(facts.st_mode) or facts.st_size > MOST_BYTES:
        raise _not_a_marker(path)
    try:
        value = parse_json(path.read_bytes(), path, "list of files")
    except InputError:
        raise _not_a_marker(path) from None
    files = value.get("files") if isinstance(value, dict) and value.get("format") == FORMAT else None
    if not isinstance(files, dict) or not all(
        isinstance(command, str) and find_name_problem(name) is None for name, command in files.items()
    ):
        raise _not_a_marker(path)
    return files


def refuse_link(path: Path) -> None:
    """Refuse to write through a link, or to something that is no file.

    Raises
    ------
    InputError
        If something else than a regular file lies there.
    """
    if os.path.lexists(path) and not stat.S_ISREG(path.lstat().st_mode):
        raise InputError(f"{path}: must be a file and no link, folder or device; move it away")


def _in_the_way(folder: Path, name: str, known: dict[str, str], command: str) -> str | None:
    """The reason why a command must not write a file; None for a free name and for its own earlier file."""
    problem, path = _no_folder_above(folder, name), folder / name
    if problem is not None or not os.path.lexists(path):
        return problem
    if not stat.S_ISREG(path.lstat().st_mode):
        return f"{path}: must be a file and no link or folder; move it away or name another folder"
    if known.get(name) != command:
        return (
            f"{path} is not a file that musync {command} wrote, or an earlier version wrote it, which kept no list:"
            " move it away or name another folder"
        )
    return None


def _no_folder_above(folder: Path, name: str) -> str | None:
    """Return the link or file where a parent folder belongs; None if there is none."""
    above = [
        folder.joinpath(*PurePosixPath(name).parts[:k]) for k in range(1, len(PurePosixPath(name).parts))
    ]
    wrong = next((path for path in above if path.is_symlink() or (path.exists() and not path.is_dir())), None)
    return (
        None
        if wrong is None
        else f"{wrong}: must be a folder and no link; move it away or name another folder"
    )


def _not_a_marker(path: Path) -> InputError:
    return InputError(
        f"{path}: must be muSync's list of the files that it wrote there ({FORMAT}); name another folder"
    )


def _write_marker(folder: Path, files: dict[str, str]) -> None:
    value = {"format": FORMAT, "files": files}
    text = json.dumps(value, indent=0, sort_keys=True, ensure_ascii=False)
    write_atomically(folder / MARKER, (text + "\n").encode())


@contextmanager
def _lock_folder(folder: Path, *, wait: bool) -> Iterator[None]:
    """Lock a folder itself, so that no lock file stays behind."""
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
        except BlockingIOError:
            raise InputError(
                f"{folder}: another musync command is writing there; wait for it or name another folder"
            ) from None
        except OSError as error:
            if error.errno not in {errno.EBADF, errno.EOPNOTSUPP, errno.ENOLCK}:
                raise
            # a network file system that locks no folders: commands that run one after another need no lock
        yield
    finally:
        os.close(descriptor)
