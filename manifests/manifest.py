"""The frozen manifest of a dataset: the request, the tools that made it, and every hash."""

import hashlib
import re
from collections.abc import Iterable, Iterator, Mapping
from itertools import chain
from pathlib import Path
from typing import Any

from rfc8785 import CanonicalizationError

from catalogs.documents import parse_json
from manifests.canonical import canonical_bytes, sha256_of, sha256_of_file
from manifests.records import Manifest
from tasks.errors import InputError

MANIFEST_FORMAT = "musync-manifest/3"
TRACES = "traces"
"""Folder below ``inputs/`` of the traces that a dataset's clips show."""
_BEFORE_CLIPS = re.compile(rb',"clips":\[(?=\{)')
_AFTER_CLIPS = b'}],"environment":'
_SEAL = re.compile(rb',"seal":"([0-9a-f]{64})"\}')
_SEAL_LENGTH = len(',"seal":"') + 64 + len('"}')


def list_scenes(manifest: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """Return name and hash of each scene that the clips of a dataset drive in.

    Parameters
    ----------
    manifest : of the dataset, or its head
    """
    return manifest.get("scenes") or [manifest["scene"]]


def describe_scenes(manifest: Mapping[str, Any]) -> str:
    """Return the name of a dataset's scene, or how many it has.

    Parameters
    ----------
    manifest : of the dataset, or its head
    """
    scenes = list_scenes(manifest)
    return str(manifest["grid"]["scene"]) if "scenes" not in manifest else f"{len(scenes)} scenes"


def freeze_manifest(
    plan: Mapping[str, Any],
    clips: Iterable[Mapping[str, Any]],
    artifacts: Mapping[str, str],
    made_on: Mapping[str, Any],
) -> Iterator[bytes]:
    """Yield the one byte string of the manifest (RFC 8785) in pieces, its seal among them; one record at a time.

    Parameters
    ----------
    plan : the run's plan as JSON; its clips are replaced by ``clips``
    clips : one record a clip, read once and in order: id, scenario, seed, artifacts, content hashes, figures, verdict
    artifacts : relative path to SHA-256 of the files that several clips share
    made_on : processor, git and environment: they decide nothing, and explain a difference
    """
    head = {**plan, "format": MANIFEST_FORMAT, "artifacts": artifacts, **made_on}
    unsealed = hashlib.sha256()
    mark = b"{"
    # RFC 8785 sorts the keys, and the seal covers all but itself
    for name in sorted({*head, "clips", "seal"}):
        if name == "seal":
            # what follows it is hashed before it is written
            rest = [(key, head[key]) for key in sorted(head) if key > name]
            for key, value in rest:
                unsealed.update(b"," + canonical_bytes(key) + b":" + canonical_bytes(value))
            unsealed.update(b"}")
            yield mark + canonical_bytes(name) + b":" + canonical_bytes(unsealed.hexdigest())
            continue
        start = mark + canonical_bytes(name) + b":"
        for piece in chain(
            [start], _list_pieces(clips) if name == "clips" else [canonical_bytes(head[name])]
        ):
            if name < "seal":
                unsealed.update(piece)
            yield piece
        mark = b","
    yield b"}"


def _list_pieces(clips: Iterable[Mapping[str, Any]]) -> Iterator[bytes]:
    mark = b"["
    for clip in clips:
        yield mark + canonical_bytes(clip)
        mark = b","
    yield b"[]" if mark == b"[" else b"]"


def is_quarantined(clip: Mapping[str, Any]) -> bool:
    """Whether a clip's record says that its pose check failed; without pictures there was none to fail."""
    return clip["verdict"]["passed"] is False


def is_traced(inputs: Iterable[str]) -> bool:
    """Whether a dataset shows the motion of reference traces, which do not hold every column of the telemetry.

    Parameters
    ----------
    inputs : names of its frozen inputs
    """
    return any(name.startswith(f"{TRACES}/") for name in inputs)


def is_driven(inputs: Iterable[str]) -> bool:
    """Whether a policy braked the clips of a dataset, and not their scenarios.

    Parameters
    ----------
    inputs : names of its frozen inputs
    """
    return any(name.startswith("driven/") for name in inputs)


def seal_of(manifest: Mapping[str, Any]) -> str:
    """Return the SHA-256 of the canonical form without the seal, by which a changed manifest is recognised."""
    return sha256_of([canonical_bytes({key: value for key, value in manifest.items() if key != "seal"})])


def head_of_sealed(content: bytes) -> bytes | None:
    """Return a manifest's bytes without its clips, where its seal is that of all bytes; None where it is not.

    Reading a hundred thousand clips takes six CPU-seconds, hashing them a fifth of one. Canonical JSON sorts its keys,
    so ``clips`` stands between ``backend`` and ``environment``, and ``seal`` last. What stands in the clips is not
    looked at: the two cuts are beside keys and not inside a text, where quotation marks are escaped.

    Parameters
    ----------
    content : the file's bytes
    """
    before = _BEFORE_CLIPS.search(content)
    after = content.rfind(_AFTER_CLIPS)
    if before is None or after < before.end() or not is_sealed(content):
        return None
    return content[: before.start()] + content[after + len("}]") :]


def is_sealed(content: bytes) -> bool:
    """Whether a manifest's bytes are those that its seal was made of.

    Parameters
    ----------
    content : the file's bytes
    """
    seal = _SEAL.fullmatch(content, len(content) - _SEAL_LENGTH) if len(content) > _SEAL_LENGTH else None
    return seal is not None and sha256_of([memoryview(content)[: seal.start()], b"}"]) == seal[1].decode()


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
