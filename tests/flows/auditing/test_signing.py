"""A dataset is signed where it lies, and what its signatures say is found again by whoever has the public key."""

import json
import shutil

import pytest
from typer.testing import CliRunner

from flows.auditing.repair import repair_dataset
from flows.auditing.signing import sign_dataset, signature_findings
from flows.auditing.verify import verify_dataset
from flows.cli import app
from flows.store.layout import PARTIAL, Layout
from flows.store.lock import sole_writer
from manifests.canonical import canonical_bytes
from manifests.manifest import seal_of
from manifests.signing import ENVELOPE
from tasks.errors import InputError
from tests.flows.keys import write_keys


@pytest.fixture
def copy(toy_dataset, tmp_path) -> Layout:
    shutil.copytree(toy_dataset.root, tmp_path / "copy")
    return Layout(tmp_path / "copy")


@pytest.fixture
def keys(tmp_path) -> dict[str, str]:
    return write_keys(tmp_path)


def names(layout: Layout) -> set[str]:
    return {layout.relative(path) for path in layout.root.rglob("*")}


def test_a_signed_dataset_has_one_file_more_and_its_owners_key_holds(copy, keys):
    before = names(copy)
    first = sign_dataset(str(copy.root), key=keys["owner"])
    assert first["written"] and first["signatures"] == 1
    assert names(copy) - before == {ENVELOPE} and before <= names(copy)
    assert signature_findings(copy, keys["owner.pub"])["signed"] is True
    assert signature_findings(copy, keys["other.pub"])["signed"] is False


def test_half_an_envelope_of_a_call_that_was_killed_goes_with_the_next(copy, keys):
    (copy.root / f"{ENVELOPE}.77-78{PARTIAL}").write_bytes(b"half")
    before = names(copy)
    sign_dataset(str(copy.root), key=keys["owner"])
    assert names(copy) == before - {f"{ENVELOPE}.77-78{PARTIAL}"} | {ENVELOPE}


def test_without_a_key_it_is_said_that_the_seal_shows_damage_and_not_forgery(copy, keys):
    unsigned = signature_findings(copy, None)
    assert unsigned["signed"] is None and unsigned["signature"].startswith("there is none")
    sign_dataset(str(copy.root), key=keys["owner"])
    assert signature_findings(copy, None)["signature"].startswith("1 not checked: give")
    (copy.root / ENVELOPE).write_text("{")
    assert signature_findings(copy, None)["signature"].startswith("not checked, and not readable")
    assert "damage, not forgery" in unsigned["signature"]


def test_verify_with_a_key_asks_for_sound_files_and_the_signature(copy, keys):
    assert verify_dataset(str(copy.root))["verified"] is True
    assert verify_dataset(str(copy.root), key=keys["owner.pub"])["verified"] is False
    sign_dataset(str(copy.root), key=keys["owner"])
    sound = verify_dataset(str(copy.root), key=keys["owner.pub"])
    assert sound["verified"] and sound["signed"] and sound["unrecorded"] == [] and sound["damaged"] == []
    assert verify_dataset(str(copy.root), key=keys["other.pub"])["verified"] is False
    (copy.telemetry / "pairs.parquet").write_bytes(b"")
    broken = verify_dataset(str(copy.root), key=keys["owner.pub"])
    assert broken["signed"] is True and broken["verified"] is False
    assert repair_dataset(str(copy.root), runner="threads", workers=1)["repaired"]
    assert verify_dataset(str(copy.root), key=keys["owner.pub"])["verified"] is True


def test_a_manifest_that_a_stranger_seals_again_is_told_from_the_signed_one(copy, keys):
    sign_dataset(str(copy.root), key=keys["owner"])
    forged = json.loads(copy.manifest.read_bytes())
    forged["clips"][0]["label"] = "mine"
    copy.manifest.write_bytes(canonical_bytes(forged | {"seal": seal_of(forged)}))
    assert verify_dataset(str(copy.root))["verified"] is True
    found = verify_dataset(str(copy.root), key=keys["owner.pub"])
    assert found["verified"] is False and "another manifest.json" in found["signature"]


def test_the_commands_exit_codes_tell_a_failed_check_from_a_wrong_input(copy, keys, tmp_path):
    def code(*words: str) -> int:
        return CliRunner().invoke(app, [*words]).exit_code

    data = str(copy.root)
    assert (
        code("lab", "sign", data, "--key", keys["owner"])
        == code("verify", data, "--key", keys["owner.pub"])
        == 0
    )
    assert code("verify", data, "--key", keys["other.pub"]) == 1


def test_a_damaged_manifest_is_not_signed(copy, keys):
    copy.manifest.write_bytes(copy.manifest.read_bytes().replace(b'"clips":[', b'"clips": [', 1))
    with pytest.raises(InputError, match="only a sound manifest can be signed"):
        sign_dataset(str(copy.root), key=keys["owner"])
    assert not (copy.root / ENVELOPE).exists() and not copy.staging.exists()


def test_a_dataset_that_is_being_written_is_not_signed(copy, keys):
    with sole_writer(copy), pytest.raises(InputError, match="another run is writing"):
        sign_dataset(str(copy.root), key=keys["owner"])
