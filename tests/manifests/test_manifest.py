import json
from pathlib import Path

import pytest

from manifests.canonical import canonical_bytes, sha256_of
from manifests.manifest import MANIFEST_FORMAT, damaged_files, freeze_manifest


@pytest.fixture
def sealed(tmp_path: Path) -> tuple[Path, dict]:
    for name in ("a.bin", "b.bin", "shared.bin"):
        (tmp_path / name).write_bytes(name.encode() * 100)
    digest = {name: sha256_of([name.encode() * 100]) for name in ("a.bin", "b.bin", "shared.bin")}
    clips = [{"clip_id": c, "artifacts": {f"{c}.bin": digest[f"{c}.bin"]}} for c in "ab"]
    manifest = json.loads(
        b"".join(freeze_manifest({"run_id": "r"}, clips, {"shared.bin": digest["shared.bin"]}, {}))
    )
    return tmp_path, manifest


def test_a_manifest_is_its_own_canonical_form(sealed):
    _, manifest = sealed
    frozen = b"".join(freeze_manifest(manifest, manifest["clips"], manifest["artifacts"], {}))
    assert frozen == canonical_bytes(manifest)
    assert manifest["format"] == MANIFEST_FORMAT


def test_an_untouched_dataset_has_no_damage(sealed):
    assert damaged_files(*sealed) == []


@pytest.mark.parametrize("position", [0, 137, 499])
def test_one_flipped_bit_is_found_and_named_with_its_clip(sealed, position):
    root, manifest = sealed
    content = bytearray((root / "b.bin").read_bytes())
    content[position] ^= 1 << (position % 8)
    (root / "b.bin").write_bytes(content)
    assert damaged_files(root, manifest) == [{"path": "b.bin", "clip_id": "b", "damage": "changed"}]


def test_a_missing_shared_file_is_named_without_a_clip(sealed):
    root, manifest = sealed
    (root / "shared.bin").unlink()
    assert damaged_files(root, manifest) == [{"path": "shared.bin", "clip_id": None, "damage": "missing"}]


def test_a_manifest_is_canonical_json_sealed_by_the_hash_of_all_else():
    plan = {"run_id": "r", "grid": {"name": "ü"}, "zone": 1.5, "clips": "left out"}
    made_on = {"processor": {"cpu": "x"}, "git": None}
    shared = {"b.bin": "2", "a.bin": "1"}
    for clips in ([], [{"clip_id": "a", "speed": 2.0}], [{"clip_id": "a"}, {"b": 0.1, "a": None}]):
        content = {**plan, "format": MANIFEST_FORMAT, "clips": clips, "artifacts": shared, **made_on}
        whole = canonical_bytes(content | {"seal": sha256_of([canonical_bytes(content)])})
        assert b"".join(freeze_manifest(plan, iter(clips), shared, made_on)) == whole
