"""A dataset is signed where it lies, and what its signatures say is found again by whoever has the public key."""

import shutil

import pytest
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey

from flows.auditing.signing import sign, signature_findings
from flows.making.generate import generate
from flows.store.address import everything, working
from flows.store.layout import Layout
from flows.store.lock import sole_writer
from flows.store.objects import Objects
from manifests.signing import ENVELOPE
from tasks.errors import InputError
from tests.flows.objects_server import environment, s3_server
from tests.manifests.test_signing import private_pem, public_pem


@pytest.fixture
def copy(toy_dataset, tmp_path) -> Layout:
    shutil.copytree(toy_dataset.root, tmp_path / "copy")
    return Layout(tmp_path / "copy")


@pytest.fixture
def keys(tmp_path) -> dict[str, str]:
    """Files of two key pairs: owner, owner.pub, other, other.pub."""
    paths = {}
    for name in ("owner", "other"):
        key = Ed25519PrivateKey.generate()
        for suffix, content in (("", private_pem(key)), (".pub", public_pem(key))):
            (tmp_path / (name + suffix)).write_bytes(content)
            paths[name + suffix] = str(tmp_path / (name + suffix))
    return paths


def names(layout: Layout) -> set[str]:
    return {layout.relative(path) for path in layout.root.rglob("*")}


def test_a_signed_dataset_has_one_file_more_and_its_owners_key_holds(copy, keys):
    before = names(copy)
    first = sign(str(copy.root), key=keys["owner"])
    assert first["written"] and first["signatures"] == 1
    assert names(copy) - before == {ENVELOPE} and before <= names(copy)
    assert signature_findings(copy, keys["owner.pub"])["signed"] is True
    assert signature_findings(copy, keys["other.pub"])["signed"] is False


def test_a_second_key_adds_a_signature_and_the_same_key_writes_nothing(copy, keys):
    sign(str(copy.root), key=keys["owner"])
    assert sign(str(copy.root), key=keys["other"])["signatures"] == 2
    written = (copy.root / ENVELOPE).stat().st_mtime_ns
    assert sign(str(copy.root), key=keys["owner"])["written"] is False
    assert (copy.root / ENVELOPE).stat().st_mtime_ns == written
    assert all(signature_findings(copy, keys[name])["signed"] for name in ("owner.pub", "other.pub"))


def test_without_a_key_it_is_said_that_the_seal_shows_damage_and_not_forgery(copy, keys):
    unsigned = signature_findings(copy, None)
    assert unsigned["signed"] is None and unsigned["signature"].startswith("there is none")
    sign(str(copy.root), key=keys["owner"])
    assert signature_findings(copy, None)["signature"].startswith("1 not checked: give")
    (copy.root / ENVELOPE).write_text("{")
    assert signature_findings(copy, None)["signature"].startswith("not checked, and not readable")
    assert "damage, not forgery" in unsigned["signature"]


def test_no_envelope_and_none_that_can_be_read_are_no_signature(copy, keys):
    assert "has no manifest.dsse.json" in signature_findings(copy, keys["owner.pub"])["signature"]
    (copy.root / ENVELOPE).mkdir()
    found = signature_findings(copy, keys["owner.pub"])
    assert found["signed"] is False and "a signature envelope must be" in found["signature"]


def test_a_damaged_manifest_is_not_signed(copy, keys):
    copy.manifest.write_bytes(copy.manifest.read_bytes().replace(b'"clips":[', b'"clips": [', 1))
    with pytest.raises(InputError, match="only a sound manifest can be signed"):
        sign(str(copy.root), key=keys["owner"])
    assert not (copy.root / ENVELOPE).exists() and not copy.staging.exists()


@pytest.mark.parametrize("wrong", ["missing", "owner.pub"])
def test_a_wrong_key_file_is_a_wrong_input_and_nothing_is_written(copy, keys, wrong, tmp_path):
    with pytest.raises(InputError, match=f"{wrong}: "):
        sign(str(copy.root), key=str(tmp_path / wrong))
    with pytest.raises(InputError, match="needs the public key"):
        signature_findings(copy, keys["owner"])
    assert not (copy.root / ENVELOPE).exists()


def test_a_link_in_the_envelopes_place_is_not_written_through(copy, keys, tmp_path):
    victim = tmp_path / "victim"
    (copy.root / ENVELOPE).symlink_to(victim)
    with pytest.raises(InputError):
        sign(str(copy.root), key=keys["owner"])
    assert not victim.exists()


def test_a_dataset_that_is_being_written_is_not_signed(copy, keys):
    with sole_writer(copy), pytest.raises(InputError, match="another run is writing"):
        sign(str(copy.root), key=keys["owner"])


def test_a_dataset_in_an_object_store_is_signed_there(keys, toy_dataset, tmp_path, monkeypatch):
    with s3_server(tmp_path) as server:
        for name, value in environment(server, tmp_path / "cache").items():
            monkeypatch.setenv(name, value)
        objects = Objects("s3://data/signed")
        objects.send(
            {
                name: toy_dataset.root / name
                for name in names(toy_dataset)
                if (toy_dataset.root / name).is_file()
            }
        )
        assert sign("s3://data/signed", key=keys["owner"])["written"]
        assert sign("s3://data/signed", key=keys["other"])["signatures"] == 2
        assert objects.sizes().keys() - names(toy_dataset) == {ENVELOPE}
        with working("s3://data/signed", everything) as layout:
            assert signature_findings(layout, keys["owner.pub"])["signed"] is True
        grid = str(toy_dataset.root.parent / "grid.yaml")
        assert generate(grid, "s3://data/signed").made == 0 and ENVELOPE in objects.sizes()
