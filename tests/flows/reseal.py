"""A forger's last step after changing files: the recorded hashes and the seal made again, as anyone can."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from flows.store.layout import Layout
from manifests.canonical import canonical_bytes, sha256_of_file
from manifests.manifest import seal_of


def reseal(layout: Layout, change: Callable[[dict[str, Any]], object] = lambda manifest: None) -> None:
    """Record the hashes of the files as they are now, change the manifest, and seal it."""
    manifest = json.loads(layout.manifest.read_text())
    for record in (manifest, *manifest["clips"]):
        record["artifacts"] = {
            name: _hash(layout.root / name, digest) for name, digest in record["artifacts"].items()
        }
    inputs = layout.root / "inputs"
    manifest["inputs"] = {name: _hash(inputs / name, digest) for name, digest in manifest["inputs"].items()}
    change(manifest)
    layout.manifest.write_bytes(canonical_bytes(manifest | {"seal": seal_of(manifest)}))


def _hash(path: Path, recorded: str) -> str:
    return sha256_of_file(path) if path.is_file() else recorded
