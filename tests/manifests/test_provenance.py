"""The commit that the code is a checkout of is told where there is one, and asking for it runs nothing else."""

import shutil
import subprocess
from pathlib import Path

import pytest

from manifests.provenance import describe_processor, git_commit

pytestmark = pytest.mark.skipif(shutil.which("git") is None, reason="git is not installed")


def git(folder, *words: str) -> str:
    settings = [
        "-c",
        "user.name=a",
        "-c",
        "user.email=a@b",
        "-c",
        "commit.gpgsign=false",
        "-c",
        "core.hooksPath=/dev/null",
    ]
    return subprocess.run(
        ["git", *settings, *words], cwd=folder, check=True, capture_output=True, text=True
    ).stdout


@pytest.fixture
def checkout(tmp_path, monkeypatch):
    """A repository with the project's packages, asked anew each time."""
    for variable in ("GIT_DIR", "GIT_WORK_TREE", "GIT_INDEX_FILE"):
        monkeypatch.delenv(variable, raising=False)
    git_commit.cache_clear()
    root = tmp_path / "checkout"
    for package in ("flows", "manifests", "catalogs", "tasks"):
        (root / package).mkdir(parents=True)
        (root / package / "code.py").write_text("")
    git(root, "init", "-q")
    git(root, "add", ".")
    git(root, "commit", "-q", "-m", "first")
    yield root
    git_commit.cache_clear()


def test_the_commit_of_a_clean_checkout_is_told(checkout):
    assert git_commit(checkout) == {"commit": git(checkout, "rev-parse", "HEAD").strip(), "changed": False}


@pytest.mark.parametrize("file", ["flows/code.py", "tasks/new.py"])
def test_a_changed_and_a_new_file_of_the_packages_are_changes(checkout, file):
    (checkout / file).write_text("x = 1\n")
    assert git_commit(checkout)["changed"]


def test_a_file_beside_the_packages_is_no_change(checkout):
    (checkout / "notes.txt").write_text("mine")
    assert not git_commit(checkout)["changed"]


def test_code_that_lies_inside_somebody_elses_repository_has_no_commit(checkout):
    installed = checkout / "site-packages"
    installed.mkdir()
    assert git_commit(installed) is None


def test_without_a_commit_or_without_git_there_is_none(checkout, tmp_path, monkeypatch):
    empty = tmp_path / "empty"
    empty.mkdir()
    git(empty, "init", "-q")
    assert git_commit(empty) is None
    monkeypatch.setenv("PATH", str(tmp_path))
    assert git_commit(checkout) is None


def test_a_repository_named_by_the_environment_is_not_taken_for_the_codes_own(
    checkout, tmp_path, monkeypatch
):
    """As in a hook of another repository."""
    monkeypatch.setenv("GIT_DIR", str(tmp_path / "other"))
    assert git_commit(checkout)["changed"] is False


def test_asking_runs_no_monitor_of_the_repository_and_writes_nothing(checkout, tmp_path):
    monitor, trace = tmp_path / "monitor", tmp_path / "trace"
    monitor.write_text(f"#!/bin/sh\ntouch {trace}\n")
    monitor.chmod(0o755)
    git(checkout, "config", "core.fsmonitor", str(monitor))
    trace.unlink(missing_ok=True)
    before = (checkout / ".git" / "index").read_bytes()
    assert git_commit(checkout) is not None
    assert not trace.exists() and (checkout / ".git" / "index").read_bytes() == before


def test_the_processor_is_named_as_the_kernel_names_it() -> None:
    table = Path("/proc/cpuinfo")
    lines = table.read_text().splitlines() if table.is_file() else []
    said = {key.strip(): value.strip() for key, _, value in (line.partition(":") for line in lines)}
    if not {"model name", "flags"} <= said.keys():
        pytest.skip("this kernel names neither model nor vector extensions")
    facts = describe_processor()
    assert facts["model"] == said["model name"]
    known = {"avx", "avx2", "fma", "avx512f", "avx512dq", "avx512vl"}
    assert set(facts["vector_extensions"].split()) == known & set(said["flags"].split())


def test_the_gpu_that_drew_is_named(monkeypatch) -> None:
    torch = pytest.importorskip("torch")
    monkeypatch.setattr(torch.cuda, "is_available", lambda: True)
    monkeypatch.setattr(torch.cuda, "get_device_name", lambda: "a card")
    assert describe_processor("gsplat")["gpu"] == "a card"
    assert "gpu" not in describe_processor("cpu")
