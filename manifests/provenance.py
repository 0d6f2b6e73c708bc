"""Code, libraries and processor that make the data, recorded so that a difference can be named."""

import importlib.metadata
import os
import platform
import subprocess
from functools import lru_cache
from pathlib import Path
from typing import Any

from manifests.canonical import sha256_of, sha256_of_file

SOURCE_ROOT = Path(__file__).resolve().parents[1]
SOURCE_PACKAGES = ("flows", "manifests", "catalogs", "tasks")
RECORDED_LIBRARIES = (
    "numpy", "scipy", "numba", "llvmlite", "torch", "pyarrow", "pandas", "zarr", "numcodecs",
    "opencv-python-headless", "dask", "distributed", "prefect",
)  # fmt: skip
GIT_WAIT_S = 10
"""Longest that git may take [s]; it takes hundredths of a second."""


@lru_cache
def source_hashes() -> dict[str, str]:
    """SHA-256 of every Python source file and catalogue entry of the project, by relative path."""
    return {
        path.relative_to(SOURCE_ROOT).as_posix(): sha256_of_file(path)
        for package in SOURCE_PACKAGES
        for path in sorted((SOURCE_ROOT / package).rglob("*"))
        if path.suffix in {".py", ".yaml", ".tir"} and "__pycache__" not in path.parts
    }


@lru_cache
def source_hash() -> str:
    """One SHA-256 over `source_hashes` of the code; catalogue entries are hashed where they are used."""
    code = {path: digest for path, digest in source_hashes().items() if path.endswith(".py")}
    return sha256_of(f"{path} {digest}\n".encode() for path, digest in code.items())


def code_version() -> dict[str, str]:
    """The project's version and the hash of its source."""
    return {"version": installed_version("musync-gs"), "source_sha256": source_hash()}


@lru_cache
def installed_version(library: str) -> str:
    """Version of an installed library; asked once, since Python reads all that the library says of itself.

    Parameters
    ----------
    library : name on the index
    """
    return importlib.metadata.version(library)


@lru_cache
def git_commit(root: Path = SOURCE_ROOT) -> dict[str, Any] | None:
    """The commit that the source is a checkout of, and whether its packages have changed since.

    Asked of git without its hooks, monitors and locks, and not of a repository further up, to which an installed copy
    of the source would be just another file.

    Parameters
    ----------
    root : top folder of the checkout

    Returns
    -------
    ``commit`` and ``changed``; None if there is no checkout, no commit or no git.
    """
    if not (root / ".git").exists():
        return None
    command = ["git", "-c", "core.fsmonitor=false", "-c", "core.hooksPath=/dev/null", "--no-optional-locks",
               "status", "--porcelain=v2", "--branch", "--", *SOURCE_PACKAGES]  # fmt: skip
    variables = {name: value for name, value in os.environ.items() if not name.startswith("GIT_")}
    try:
        description = subprocess.run(
            command, cwd=root, env=variables, stdin=subprocess.DEVNULL, capture_output=True, text=True,
            timeout=GIT_WAIT_S, check=True,
        ).stdout  # fmt: skip
    except (OSError, subprocess.SubprocessError):
        return None
    lines = description.splitlines()
    commit = next((line.split()[-1] for line in lines if line.startswith("# branch.oid ")), "(initial)")
    changed = any(not line.startswith("#") for line in lines)
    return None if commit == "(initial)" else {"commit": commit, "changed": changed}


def library_versions() -> dict[str, str]:
    """Installed versions of the libraries whose arithmetic or encoding reaches the data."""
    return {"python": platform.python_version()} | {
        name: installed_version(name) for name in RECORDED_LIBRARIES
    }


def describe_processor(backend: str = "cpu") -> dict[str, str]:
    """Return the architecture and, where the kernel reports them, the model and vector extensions of the processor.

    Parameters
    ----------
    backend : rasteriser; frames of gsplat are those of one kind of GPU, whose name is given where the machine has it
    """
    facts = {"architecture": platform.machine()}
    if backend == "gsplat":
        import torch  # slow to load

        if torch.cuda.is_available():
            facts["gpu"] = torch.cuda.get_device_name()
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.exists():
        for line in cpuinfo.read_text().splitlines():
            key, _, value = line.partition(":")
            if key.strip() == "model name":
                facts["model"] = value.strip()
            elif key.strip() == "flags":
                known = {"avx", "avx2", "fma", "avx512f", "avx512dq", "avx512vl"}
                facts["vector_extensions"] = " ".join(sorted(known.intersection(value.split())))
                break
    return facts
