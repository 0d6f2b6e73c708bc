"""How a command ends that cannot go on: the exit code, sentences for people, and a file with the traceback."""

import errno
import os
import re
import stat
import sys
import tempfile
import time
import traceback
from collections.abc import Sequence
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path

from tasks.errors import InputError
from tasks.kernel_cache import cache_root

DONE, CHECK_FAILED, INPUT_WRONG, BROKEN, INTERRUPTED = 0, 1, 2, 3, 130

KEPT = 20
"""Tracebacks that stay on disk."""
LONGEST, MOST = 2000, 200
"""Characters of a sentence, and sentences, that are printed."""
MOST_BYTES = 2**20
"""Of a traceback that is kept [B]."""
_MEMORY = re.compile(
    r"(?i)cannot allocate memory|can't allocate memory|failed to map segment|can't start new thread|out of memory"
)
"""What the loader of libraries, threads and allocators say."""
OUT_OF_MEMORY = (
    "memory ran out; what is committed is kept: raise the limit (ulimit -v), give fewer --workers, or fewer or"
    " smaller frames, and run the same command again"
)
AGAIN = "what is committed is kept: {} and run the same command again"
FULL = {
    errno.ENOSPC: "the disk is full; " + AGAIN.format("free space"),
    errno.EDQUOT: "the disk quota is used up; " + AGAIN.format("free space"),
    errno.EFBIG: "a file would grow beyond what is allowed here; "
    + AGAIN.format("raise the limit (ulimit -f)"),
}
SURROUNDINGS = {
    errno.EACCES: "there is no permission for this; change its permissions or name another place",
    errno.EPERM: "there is no permission for this; change its permissions or name another place",
    errno.EROFS: "the file system is read-only; name another place",
    errno.ENAMETOOLONG: "the name is too long for this file system; give a shorter one",
    errno.ENOTDIR: "a part of this path is a file where a folder is needed; name another place",
    errno.EISDIR: "is a folder where a file is needed; name a file",
    errno.ELOOP: "is a link where none may be, or its links lead in a circle; name the file or folder itself",
    errno.EMFILE: "too many files are open; raise the limit (ulimit -n) or give fewer --workers",
    errno.ENFILE: "too many files are open on this machine; close some or give fewer --workers",
}
"""Sentences that say what a user can do, by error number."""
NAMED = {
    errno.ENOENT: "there is no such file or folder; name one that exists",
    errno.EEXIST: "something else lies there; move it away or name another place",
    errno.ENOTEMPTY: "the folder holds other files; move them away or name another place",
}
"""The same, but a defect of ours where the path is none that the user has given."""
OWN_CACHE = "set MUSYNC_CACHE to a folder that can be written"


class ClipsFailed(RuntimeError):
    """Some clips could not be made; the others are committed and kept."""


def explain_end(error: BaseException, given: Sequence[str]) -> tuple[int, list[str]]:
    """Exit code and sentences for what ended a command; a failure that no input explains leaves a traceback file.

    Parameters
    ----------
    error : what was raised
    given : the command line's words
    """
    if isinstance(error, KeyboardInterrupt):
        return INTERRUPTED, ["interrupted; what is committed is kept"]
    if isinstance(error, InputError):
        rest = len(error.problems) - MOST
        return INPUT_WRONG, [*error.problems[:MOST], *([f"and {rest} more"] if rest > 0 else [])]
    sentence = input_sentence(error, given)
    if sentence is not None:
        return INPUT_WRONG, [sentence]
    if is_out_of_memory(error):
        return INPUT_WRONG, [OUT_OF_MEMORY]
    if isinstance(error, ClipsFailed):
        sentence = str(error)
    else:
        message = cut_middle(" ".join(f"{type(error).__name__}: {error}".split()), 300)
        sentence = f"a defect of muSync, not of your input, ended the command ({message})"
    file = keep_traceback(error, given)
    where = (
        "could not be written anywhere"
        if file is None
        else f"lies in {file}: please report it with that file"
    )
    return BROKEN, [f"{cut_middle(sentence, LONGEST)}; the traceback {where}"]


def is_out_of_memory(error: BaseException) -> bool:
    """Whether an error, or what it came from, says that memory ran out: each library has its own way."""
    while True:
        if isinstance(error, MemoryError) or (isinstance(error, OSError) and error.errno == errno.ENOMEM):
            return True
        if isinstance(error, ImportError | RuntimeError) and _MEMORY.search(str(error)):
            return True
        before = error.__cause__ or error.__context__
        if before is None:
            return False
        error = before


def input_sentence(error: BaseException, given: Sequence[str]) -> str | None:
    """The sentence for a path that cannot be used; None for an error that is no fault of such a path.

    Parameters
    ----------
    error : what was raised
    given : the command line's words, among which the user's paths stand
    """
    if isinstance(error, ValueError) and "embedded null" in str(error):
        return "a file name in the input holds a zero byte, which no file name can; correct it"
    if isinstance(error, RuntimeError) and "no locator available" in str(error):  # of Numba's cache
        return f"compiled kernels can be kept nowhere; {OWN_CACHE}"
    if isinstance(error, RuntimeError) and str(error).startswith(
        "Symlink loop from"
    ):  # of pathlib until Python 3.12
        return f"{cut_middle(str(error), 200)}: {SURROUNDINGS[errno.ELOOP]}"
    if not isinstance(error, OSError):
        return None
    full = disk_full_sentence(error)
    if full is not None:
        return full
    path = error.filename if isinstance(error.filename, str) else None
    sentence = SURROUNDINGS.get(error.errno or 0)
    if path is not None and _is_in_cache(path) and error.errno in SURROUNDINGS.keys() | NAMED.keys():
        sentence = f"the cache cannot be used ({error.strerror}); {OWN_CACHE}"
    elif sentence is None and path is not None and _is_given(path, given):
        sentence = NAMED.get(error.errno or 0)
    if sentence is None:
        return None
    return f"{cut_middle(_name_path(path), 200)}: {sentence}" if path else sentence


def disk_full_sentence(error: BaseException) -> str | None:
    """The sentence for a disk, quota or file size limit that is used up; None for any other error."""
    if isinstance(error, OSError) and error.errno in FULL:
        start = f"{_name_path(str(error.filename))}: " if error.filename else ""
        return start + FULL[error.errno]
    return None


def _name_path(path: str) -> str:
    """The path, or the dataset's folder in place of what lies in its staging folder, of which no user has heard."""
    from flows.store.layout import STAGING

    inner = Path(path)
    return next((str(above.parent) for above in (inner, *inner.parents) if above.name == STAGING), path)


def keep_traceback(error: BaseException, given: Sequence[str]) -> Path | None:
    """Write a traceback to a new file that only the user can read; None where no folder takes it.

    The folder is ``failures`` in the user's cache, else the system's for temporary files; the latest are kept.

    Parameters
    ----------
    error : what was raised
    given : the command line's words
    """
    at = datetime.now(UTC)
    head = f"{at.isoformat(timespec='seconds')} python {sys.version.split()[0]} musync {given!r}\n\n"
    lines = "".join(traceback.format_exception(error))
    content = (head + cut_middle(lines, MOST_BYTES // 4)).encode("utf-8", "backslashreplace")
    for folder in _failure_folders():
        path = folder / f"musync-failure-{at:%Y%m%dT%H%M%S}-{os.getpid()}-{time.monotonic_ns()}.txt"
        try:
            folder.mkdir(parents=True, exist_ok=True, mode=0o700)
            descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW, 0o600)
            with open(descriptor, "wb") as stream:
                stream.write(content)
            _forget_old(folder)
        except (OSError, ValueError):
            continue
        return path
    return None


def cut_middle(text: str, longest: int) -> str:
    """The text, with its middle left out where it is too long."""
    return text if len(text) <= longest else f"{text[: longest // 2]} ... {text[-longest // 2 :]}"


def _failure_folders() -> list[Path]:
    folders = [Path(tempfile.gettempdir())]
    with suppress(InputError):  # where there is no home
        folders.insert(0, cache_root() / "failures")
    return folders


def _forget_old(folder: Path) -> None:
    """Remove all but the latest of one's own tracebacks."""
    facts = [(path.lstat(), path) for path in folder.glob("musync-failure-*.txt")]
    mine = [(f.st_mtime_ns, path) for f, path in facts if stat.S_ISREG(f.st_mode) and f.st_uid == os.getuid()]
    for _, path in sorted(mine)[:-KEPT]:
        path.unlink(missing_ok=True)


def _is_in_cache(path: str) -> bool:
    try:
        return Path(path).absolute().is_relative_to(cache_root().absolute())
    except InputError:
        return False


def _is_given(path: str, given: Sequence[str]) -> bool:
    """Whether a path is one of the command line's, lies in one or has one below it."""
    absolute = Path(path).absolute()
    words = [word.partition("=")[2] if word.startswith("--") and "=" in word else word for word in given]
    paths = [Path(word).absolute() for word in words if word and not word.startswith("-")]
    return any(absolute.is_relative_to(path) or path.is_relative_to(absolute) for path in paths)
