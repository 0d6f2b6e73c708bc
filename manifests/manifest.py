"""The frozen manifest of a dataset: the request, the tools that made it, and every hash."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from rfc8785 import CanonicalizationError

from catalogs.documents import parse_json
from manifests.canonical import canonical_bytes, sha256_of, sha256_of_file
from manifests.records import Manifest
from tasks.errors import InputError

MANIFEST_FORMAT = "musync-manifest/3"


def freeze_manifest(
    plan: Mapping[str, Any],
    clips: Sequence[Mapping[str, Any]],
    artifacts: Mapping[str, str],
    made_on: Mapping[str, Any],
) -> bytes:
    """The manifest's one byte string (RFC 8785).

    Parameters
    ----------
    plan : the run's plan as JSON; its clips are replaced by ``clips``
    clips : one record a clip: id, scenario, seed, artifacts, content hashes, figures, verdict
    artifacts : relative path to SHA-256 of the files that several clips share
    made_on : processor, git and environment: they decide nothing, and explain a difference
    """
    manifest = {
        **plan,
        "format": MANIFEST_FORMAT,
        "clips": list(clips),
        "artifacts": dict(artifacts),
        **made_on,
    }
    return canonical_bytes(manifest | {"seal": seal_of(manifest)})


def is_quarantined(clip: Mapping[str, Any]) -> bool:
    """Whether a clip's record says that its pose check failed; without pictures there was none to fail."""
    return clip["verdict"]["passed"] is False


def seal_of(manifest: Mapping[str, Any]) -> str:
    """Return the SHA-256 of the canonical form without the seal, by which a changed manifest is recognised."""
    return sha256_of([canonical_bytes({key: value for key, value in manifest.items() if key != "seal"})])


def manifest_damage(content: bytes) -> str | None:
    """Return a sentence on what is wrong with a manifest's bytes; None when they are those that were frozen.

    Parameters
    ----------
    content : the file's bytes
    """
    try:
        manifest = parse_json(content, "manifest.json", "manifest")
    except InputError:
        return "changed: it is no longer JSON"
    if not isinstance(manifest, dict) or "seal" not in manifest:
        return "changed: it carries no seal"
    try:
        sealed = seal_of(manifest) == manifest["seal"] and canonical_bytes(manifest) == content
    except CanonicalizationError:
        sealed = False
    return None if sealed else "changed: its seal does not match its content"


def recorded_files(manifest: Manifest) -> dict[str, tuple[str, str | None]]:
    """Every recorded file: relative path to (SHA-256, clip id or None where several clips share it)."""
    files: dict[str, tuple[str, str | None]] = {
        path: (digest, None) for path, digest in manifest["artifacts"].items()
    }
    for clip in manifest["clips"]:
        files |= {path: (digest, clip["clip_id"]) for path, digest in clip["artifacts"].items()}
    return files


def damaged_files(root: Path, manifest: Manifest) -> list[dict[str, str | None]]:
    """Files that are missing, lie behind a link, or whose bytes are not those recorded; empty when all is well."""
    damage: list[dict[str, str | None]] = []
    for path, (digest, clip_id) in sorted(recorded_files(manifest).items()):
        file = root / path
        if file.exists() and file.resolve() != root.resolve() / path:
            damage.append({"path": path, "clip_id": clip_id, "damage": "behind a link"})
        elif not file.is_file():
            damage.append({"path": path, "clip_id": clip_id, "damage": "missing"})
        elif sha256_of_file(file) != digest:
            damage.append({"path": path, "clip_id": clip_id, "damage": "changed"})
    return damage
