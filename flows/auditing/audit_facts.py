"""Facts by which the report of an audit stands alone: which dataset, made by what, audited when and where."""

import os
import platform
from datetime import UTC, datetime
from typing import Any

from flows.store.layout import Layout
from manifests.canonical import sha256_of_file
from manifests.explain import tools_here
from manifests.provenance import git_commit
from manifests.records import Manifest

FORMAT = "musync-audit/1"


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


def tell_time() -> str:
    """Return the date and time in UTC, to the second (ISO 8601)."""
    return datetime.now(UTC).isoformat(timespec="seconds").replace("+00:00", "Z")
