"""Facts by which the report of an audit stands alone: which dataset, made by what, audited when and where."""

import os
import platform
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from typing import Any

from flows.store.layout import Layout
from manifests.canonical import sha256_of_file
from manifests.explain import find_tool_differences, tools_here
from manifests.manifest import recorded_files
from manifests.provenance import git_commit
from manifests.records import Manifest

FORMAT = "musync-audit/1"
WRITERS = ("pyarrow", "zarr", "numcodecs", "opencv-python-headless")
"""Libraries that encode the files of a dataset; the same values can have other bytes with another version."""
RECORDS_OF_TOOLS = ("processor", "git", "environment")
"""Records from which no byte follows, so that nothing can contradict them."""


def collect_facts(layout: Layout, manifest: Manifest) -> dict[str, Any]:
    """Return what an audit says of the dataset, the tools that made it, and the tools and machine at hand.

    Parameters
    ----------
    layout, manifest : of the audited dataset

    Returns
    -------
    ``format``; ``dataset``, its address; ``grid``, ``run_id``, ``seal``, ``manifest_sha256``, ``clips``;
    ``tools_recorded`` and ``tools_here``, each with ``code``, ``libraries``, ``processor`` and ``git``; ``machine``.
    """
    here = tools_here()
    return {
        "format": FORMAT,
        "dataset": str(layout),
        "grid": manifest["grid"]["name"],
        "run_id": manifest["run_id"],
        "seal": manifest["seal"],
        "manifest_sha256": sha256_of_file(layout.manifest),
        "clips": len(manifest["clips"]),
        "tools_recorded": {
            **manifest["made_with"],
            "processor": manifest["processor"],
            "git": manifest["git"],
        },
        "tools_here": {**here["made_with"], "processor": here["processor"], "git": git_commit()},
        "machine": {
            "name": platform.node(),
            "system": f"{platform.system()} {platform.release()}",
            "processors": os.cpu_count(),
        },
    }


def name_other_writers(manifest: Manifest) -> list[str]:
    """Return what encodes files here and is another than in the run that wrote them: code, and `WRITERS`.

    Parameters
    ----------
    manifest : of the dataset
    """
    rows = find_tool_differences(manifest, tools_here())
    found = ["muSync" if row["input"] == "code" else row["path"] for row in rows]
    return [name for name in dict.fromkeys(found) if name in ("muSync", *WRITERS)]


def list_unchecked(
    manifest: Manifest,
    remade: int,
    compared: Mapping[str, Any],
    others: Sequence[str],
) -> list[dict[str, Any]]:
    """Return what an audit did not check, one row a kind.

    Parameters
    ----------
    manifest : of the dataset
    remade : clips that were made again [1]
    compared : of `flows.auditing.verify.compare_files`
    others : paths of files whose bytes another writer made

    Returns
    -------
    Rows with ``what``, ``count`` and ``of`` (both [1]), ``unit`` and ``why``.
    """
    if any(row["path"] == "manifest.json" for row in compared["damaged"]):
        files = len(recorded_files(manifest)) + 1
        return [_count_unchecked("content", files, files, "files", "manifest.json itself is changed")]
    clips, pictures = len(manifest["clips"]), manifest["grid"].get("pictures", True)
    recipes = clips if pictures == "later" else 0
    lost, files = len(compared["damaged"]), compared["files"] + len(compared["unrecorded"])
    writers = " and ".join(name_other_writers(manifest))
    strange = [
        path for path in compared["unrecorded"] if path not in {row["path"] for row in compared["damaged"]}
    ]
    rows = [
        _count_unchecked("motion, pictures and pose check" if pictures is True else "motion", clips - remade, clips,
            "clips", "not made again"),
        _count_unchecked("pictures and pose check", recipes, clips, "clips",
            "made when they are read"),
        _count_unchecked("content", lost, files, "files", "damaged, or nobody recorded them"),
        _count_unchecked("content", len(strange), files, "files", f"nobody recorded them: {', '.join(strange)}"),
        _count_unchecked("bytes", len(others), files, "files", f"written by another {writers}; values are checked"),
        _count_unchecked(f"records of {', '.join(RECORDS_OF_TOOLS[:-1])} and {RECORDS_OF_TOOLS[-1]}",
            len(RECORDS_OF_TOOLS), len(RECORDS_OF_TOOLS), "records", "no byte follows from them"),
    ]  # fmt: skip
    return [row for row in rows if row["count"]]


def _count_unchecked(what: str, count: int, of: int, unit: str, why: str) -> dict[str, Any]:
    return {"what": what, "count": count, "of": of, "unit": unit, "why": why}


def format_present_time() -> str:
    """Return the date and time in UTC, to the second (ISO 8601)."""
    return datetime.now(UTC).isoformat(timespec="seconds").replace("+00:00", "Z")
