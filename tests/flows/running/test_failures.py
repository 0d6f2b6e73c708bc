"""How commands end: the codes of docs/reference/commands.md, sentences and no traceback on the terminal."""

import errno
import os
import stat
import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import pytest

from flows.running import failures
from flows.running.failures import ClipsFailed, explain_end, keep_traceback
from manifests.provenance import SOURCE_ROOT
from tasks.errors import InputError
from tasks.kernel_cache import cache_root
from tests.flows.shell import run_command


@pytest.fixture
def cache(tmp_path, monkeypatch) -> Path:
    monkeypatch.setenv("MUSYNC_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


def end_of(monkeypatch, capsys, error: BaseException) -> tuple[int, str]:
    """Exit code and standard error of a command whose function raises."""

    def describe(dataset: str) -> dict[str, str]:
        raise error

    monkeypatch.setattr("flows.reading.describe.describe_dataset", describe)
    code = run_command(monkeypatch, "lab", "describe", "data")
    printed = capsys.readouterr()
    assert "Traceback" not in printed.err and printed.out == ""
    return code, printed.err


def oserror(number: int, path: str | None = "data/x.json") -> OSError:
    return OSError(number, os.strerror(number), path)


def caused(error: BaseException, cause: BaseException) -> BaseException:
    error.__cause__ = cause
    return error


@pytest.mark.parametrize(
    ("error", "sentence"),
    [
        (InputError(["a: is wrong", "b: is wrong"]), "musync: a: is wrong\nmusync: b: is wrong\n"),
        (InputError("first line\nmusync: forged"), "musync: first line\n  musync: forged\n"),
        (oserror(errno.EACCES), "data/x.json: there is no permission"),
        (oserror(errno.EACCES, "data/.staging/lock"), "musync: data: there is no permission"),
        (oserror(errno.EROFS), "read-only"),
        (oserror(errno.ENOSPC), "the disk is full; what is committed is kept: free space"),
        (oserror(errno.EDQUOT, None), "musync: the disk quota is used up"),
        (oserror(errno.ENAMETOOLONG, "x" * 5000), "too long"),
        (oserror(errno.ENOTDIR), "is a file where a folder is needed"),
        (oserror(errno.ELOOP), "lead in a circle"),
        (RuntimeError("Symlink loop from 'data/x'"), "Symlink loop from 'data/x': is a link where none may be, or"),
        (oserror(errno.EMFILE, None), "too many files are open"),
        (oserror(errno.ENOENT), "data/x.json: there is no such file"),
        (oserror(errno.EEXIST), "something else lies there"),
        (ValueError("embedded null byte"), "zero byte"),
        (MemoryError(), "memory ran out; what is committed is kept: raise the limit (ulimit -v)"),
        (ImportError("libarrow.so.2600: failed to map segment from shared object"), "memory ran out"),
        (RuntimeError("can't start new thread"), "memory ran out"),
        (caused(ClipsFailed("1 of 2 clips failed"), MemoryError()), "memory ran out"),
        (RuntimeError("cannot cache function 'f': no locator available for file 'g'"), "set MUSYNC_CACHE"),
    ],
)  # fmt: skip
def test_what_the_user_gave_ends_in_a_sentence_and_code_2(monkeypatch, capsys, cache, error, sentence):
    code, told = end_of(monkeypatch, capsys, error)
    assert code == 2
    assert sentence in told
    assert len(told) < 1000
    assert not cache.exists()


@pytest.mark.parametrize(
    ("error", "sentence"),
    [
        (KeyError("clips"), "a defect of muSync, not of your input, ended the command (KeyError: 'clips')"),
        (oserror(errno.ENOENT, "/elsewhere/x"), "FileNotFoundError"),
        (BrokenPipeError(errno.EPIPE, "a worker has gone"), "BrokenPipeError"),
        (ClipsFailed("data: 1 of 2 clips failed (a); the first said: KeyError"), "1 of 2 clips failed"),
        (ValueError("x\n\x1b[31mred" * 9999), r"\x1b[31mred"),
    ],
)
def test_a_defect_ends_in_one_sentence_code_3_and_a_file_with_the_traceback(
    monkeypatch, capsys, cache, error, sentence
):
    code, told = end_of(monkeypatch, capsys, error)
    assert code == 3
    assert sentence in told
    assert told.count("\n") == 1 and len(told) < 3000
    (file,) = (cache / "failures").iterdir()
    assert f"lies in {file}" in told
    assert "Traceback (most recent call last)" in file.read_text()
    assert "['lab', 'describe', 'data']" in file.read_text()
    assert stat.S_IMODE(file.stat().st_mode) == 0o600


def test_a_place_in_the_cache_is_the_user_s_whatever_the_command_line_says(monkeypatch, capsys, cache):
    code, told = end_of(monkeypatch, capsys, oserror(errno.ENOENT, str(cache / "kernels" / "x")))
    assert code == 2
    assert "set MUSYNC_CACHE to a folder that can be written" in told


def test_ctrl_c_ends_in_a_sentence_and_code_130(monkeypatch, capsys):
    assert end_of(monkeypatch, capsys, KeyboardInterrupt()) == (
        130,
        "musync: interrupted; what is committed is kept\n",
    )


def test_the_worker_s_own_traceback_is_in_the_file(cache):
    with ProcessPoolExecutor(1) as executor:
        cause = executor.submit(int, "no number").exception()
    try:
        raise ClipsFailed("a clip failed") from cause
    except ClipsFailed as error:
        file = keep_traceback(error, [])
    assert "_RemoteTraceback" in file.read_text() and "ClipsFailed: a clip failed" in file.read_text()


def test_a_bounded_number_of_tracebacks_is_kept_and_nothing_else_is_touched(cache, monkeypatch):
    monkeypatch.setattr(failures, "KEPT", 3)
    folder = cache / "failures"
    folder.mkdir(parents=True)
    (folder / "notes.txt").write_text("mine")
    (folder / "musync-failure-0.txt").symlink_to(folder / "notes.txt")
    files = [keep_traceback(KeyError(k), []) for k in range(5)]
    left = {path for path in folder.iterdir() if not path.is_symlink()}
    assert left == {*files[2:], folder / "notes.txt"}
    assert (folder / "notes.txt").read_text() == "mine"


@pytest.mark.parametrize("broken", ["a file", "a link"])
def test_an_unusable_cache_sends_the_traceback_to_the_temporary_folder(tmp_path, monkeypatch, cache, broken):
    (tmp_path / "temporary").mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "temporary"))
    if broken == "a file":
        cache.write_text("in the way")
    else:
        cache.mkdir()
        (cache / "failures").symlink_to(tmp_path / "nowhere" / "at all")
    file = keep_traceback(KeyError("x"), [])
    assert file is not None and file.parent == tmp_path / "temporary"


def test_without_a_home_the_cache_has_to_be_named_and_the_command_says_so(tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))

    def no_home() -> Path:
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.setattr(Path, "home", no_home)
    for name in ("MUSYNC_CACHE", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)
    with pytest.raises(InputError, match="set MUSYNC_CACHE"):
        cache_root()
    assert keep_traceback(KeyError("x"), []).parent == tmp_path
    assert explain_end(oserror(errno.EACCES), [])[0] == 2


def test_a_wrong_option_is_code_2(monkeypatch, capsys):
    assert run_command(monkeypatch, "lab", "describe", "--no-such-option") == 2


def piped(*words: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    """A command whose reader leaves before it prints; its exit code is the last line."""
    command = f'{{ "{sys.executable}" -m flows.cli {" ".join(words)}; echo $? >&2; }} | true'
    environment = {k: v for k, v in os.environ.items() if k != "PREFECT_API_URL"}
    return subprocess.run(
        ["bash", "-c", command], capture_output=True, text=True, cwd=cwd, timeout=60,
        env=environment | {"PYTHONPATH": str(SOURCE_ROOT)},
    )  # fmt: skip


def test_in_a_process_of_its_own_what_is_wrong_is_told_by_us_alone_a_sentence_each(tmp_path):
    (tmp_path / "no.mp4").write_bytes(b"\0\0\0\x18ftypmp42")
    words = ["lab", "judge", "no.mp4", "--claim", "no.parquet", "--camera", "no.yaml"]
    done = subprocess.run(
        [sys.executable, "-m", "flows.cli", *words], capture_output=True, text=True, cwd=tmp_path,
        env=dict(os.environ) | {"PYTHONPATH": str(SOURCE_ROOT)}, timeout=60,
    )  # fmt: skip
    assert done.returncode == 2
    assert [line.partition(": ")[0] for line in done.stderr.splitlines()] == ["musync"] * 3


def test_a_reader_that_leaves_is_no_failure(tmp_path):
    assert piped("lab", "schema", cwd=tmp_path).stderr == "0\n"
