"""Seals made again after a mutation, so that it reaches the reading behind them."""

import hashlib
import json
from collections.abc import Callable

from catalogs.vehicles.frozen import SEAL
from manifests.canonical import canonical_bytes
from manifests.manifest import seal_of

Files = dict[str, bytes]
Resealing = Callable[[Files, str], Files]
"""From a document's files and the name of the one that was changed, to the files whose seals fit; a document of which
no seal can be made raises `ValueError`, `TypeError` or `RecursionError`."""


def sealed_json(files: Files, changed: str) -> Files:
    """A JSON document that carries the hash of itself."""
    content = json.loads(files[changed])
    return files | {changed: canonical_bytes(content | {"seal": seal_of(content)})}


def sealed_dataset(files: Files, changed: str) -> Files:
    """A dataset's manifest, with the hash of the changed file in it."""
    manifest = json.loads(files["manifest.json"])
    if changed != "manifest.json":
        for recorded in (manifest["artifacts"], *(clip["artifacts"] for clip in manifest["clips"])):
            if changed in recorded:
                recorded[changed] = hashlib.sha256(files[changed]).hexdigest()
        files = files | {"manifest.json": canonical_bytes(manifest)}
    return sealed_json(files, "manifest.json")


def sealed_vehicle(files: Files, changed: str) -> Files:
    """A frozen vehicle, whose last line is the hash of those before it."""
    body, found, _ = files[changed].decode().rpartition(f"\n{SEAL}")
    if not found:
        raise ValueError("no seal")
    body += "\n"
    return files | {changed: f"{body}{SEAL}{hashlib.sha256(body.encode()).hexdigest()}\n".encode()}


def sealed_scene(files: Files, changed: str) -> Files:
    """A scene folder, whose scene.json has the hash of every array."""
    if changed == "scene.json":
        return files
    facts = json.loads(files["scene.json"])
    facts["sha256"][changed] = hashlib.sha256(files[changed]).hexdigest()
    return files | {"scene.json": json.dumps(facts).encode()}
