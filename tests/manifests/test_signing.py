"""A signature holds for one key and one manifest, and whatever is changed on the way is named in a sentence."""

import base64
import json
import shutil
import subprocess

import pytest
from cryptography.hazmat.primitives.asymmetric.ec import SECP256R1, generate_private_key
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey
from cryptography.hazmat.primitives.serialization import (
    BestAvailableEncryption,
    Encoding,
    NoEncryption,
    PrivateFormat,
    PublicFormat,
)
from google.protobuf.json_format import Parse
from in_toto_attestation.v1.statement import Statement
from in_toto_attestation.v1.statement_pb2 import Statement as StatementMessage

from manifests.canonical import canonical_bytes, sha256_of
from manifests.signing import (
    LARGEST_ENVELOPE,
    PAYLOAD_TYPE,
    add_signature,
    find_signature_problems,
    load_signer,
    load_verifier,
    state_manifest,
)
from tasks.errors import InputError

COMMIT = "3e5506f61801fa9d848aae7d8dd46d2ffef5de21"
MANIFEST = canonical_bytes(
    {
        "format": "musync-manifest/2",
        "run_id": "0123456789abcdef",
        "clips": [{}, {}],
        "git": {"commit": COMMIT, "changed": False},
    }
)
OWNER, OTHER = (
    Ed25519PrivateKey.from_private_bytes(b"o" * 32),
    Ed25519PrivateKey.from_private_bytes(b"x" * 32),
)


def private_pem(key, encryption=None) -> bytes:
    return key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, encryption or NoEncryption())


def public_pem(key) -> bytes:
    return key.public_key().public_bytes(Encoding.PEM, PublicFormat.SubjectPublicKeyInfo)


def signed_by(key, manifest=MANIFEST, envelope=None) -> bytes:
    return add_signature(manifest, envelope, load_signer(private_pem(key), "key"))


def problems(envelope, key=OWNER, manifest=MANIFEST) -> str:
    return "; ".join(find_signature_problems(manifest, envelope, load_verifier(public_pem(key), "key")))


def pre_authentication_encoding(envelope: bytes) -> tuple[bytes, bytes]:
    """The bytes that are signed by the DSSE specification, and the one signature."""
    fields = json.loads(envelope)
    kind, body = fields["payloadType"].encode(), base64.b64decode(fields["payload"])
    encoded = b"DSSEv1 " + b" ".join([b"%d" % len(kind), kind, b"%d" % len(body), body])
    return encoded, base64.b64decode(fields["signatures"][0]["sig"])


def resigned(payload: bytes, kind: str = PAYLOAD_TYPE) -> bytes:
    """An envelope that the owner's key really signed, around anything."""
    fields = json.loads(signed_by(OWNER)) | {
        "payloadType": kind,
        "payload": base64.b64encode(payload).decode(),
    }
    encoded, _ = pre_authentication_encoding(json.dumps(fields).encode())
    fields["signatures"][0]["sig"] = base64.b64encode(OWNER.sign(encoded)).decode()
    return json.dumps(fields).encode()


def test_the_owners_signature_holds():
    assert problems(signed_by(OWNER)) == ""


def test_plain_ed25519_over_the_bytes_of_the_specification_agrees():
    encoded, signature = pre_authentication_encoding(signed_by(OWNER))
    OWNER.public_key().verify(signature, encoded)
    assert signature == OWNER.sign(encoded)


@pytest.mark.skipif(shutil.which("openssl") is None, reason="openssl is not installed")
def test_openssl_makes_the_keys_and_agrees_with_the_signature(tmp_path):
    private, public = tmp_path / "key.pem", tmp_path / "public.pem"
    subprocess.run(["openssl", "genpkey", "-algorithm", "ed25519", "-out", private], check=True)
    subprocess.run(["openssl", "pkey", "-in", private, "-pubout", "-out", public], check=True)
    envelope = add_signature(MANIFEST, None, load_signer(private.read_bytes(), private))
    assert find_signature_problems(MANIFEST, envelope, load_verifier(public.read_bytes(), public)) == []
    encoded, signature = pre_authentication_encoding(envelope)
    (tmp_path / "encoded").write_bytes(encoded)
    (tmp_path / "signature").write_bytes(signature)
    asked = ["openssl", "pkeyutl", "-verify", "-pubin", "-inkey", public, "-rawin", "-in", tmp_path / "encoded",
             "-sigfile", tmp_path / "signature"]  # fmt: skip
    assert "Verified Successfully" in subprocess.run(asked, check=True, capture_output=True, text=True).stdout


def test_the_statement_is_one_of_in_toto_and_says_which_run():
    statement = Statement.copy_from_pb(Parse(state_manifest(MANIFEST), StatementMessage()))
    statement.validate()
    assert [(s.name, dict(s.digest)) for s in statement.pb.subject] == [
        ("manifest.json", {"sha256": sha256_of([MANIFEST])})
    ]
    assert json.loads(state_manifest(MANIFEST))["predicate"] == {
        "run_id": "0123456789abcdef", "format": "musync-manifest/2", "clips": 2,
        "git": {"commit": COMMIT, "changed": False},
    }  # fmt: skip


def test_another_key_adds_a_signature_and_the_same_key_changes_nothing():
    both = signed_by(OTHER, envelope=signed_by(OWNER))
    assert problems(both, OWNER) == problems(both, OTHER) == ""
    assert signed_by(OWNER, envelope=both) == both


def test_a_false_signature_under_the_owners_name_is_replaced_by_the_owner():
    forged = json.loads(signed_by(OTHER))
    forged["signatures"][0]["keyid"] = load_signer(private_pem(OWNER), "key").public_key.keyid
    forged = json.dumps(forged).encode()
    assert "does not match" in problems(forged)
    assert problems(signed_by(OWNER, envelope=forged)) == ""


def test_every_byte_of_the_manifest_is_signed():
    for place in range(len(MANIFEST)):
        changed = MANIFEST[:place] + bytes([MANIFEST[place] ^ 1]) + MANIFEST[place + 1 :]
        assert "another manifest.json" in problems(signed_by(OWNER), manifest=changed)


@pytest.mark.parametrize("part", ["payload", "sig"])
def test_every_byte_of_the_statement_and_of_the_signature_counts(part):
    fields = json.loads(signed_by(OWNER))
    holder = fields if part == "payload" else fields["signatures"][0]
    sound = base64.b64decode(holder[part])
    for place in range(len(sound)):
        changed = sound[:place] + bytes([sound[place] ^ 1]) + sound[place + 1 :]
        holder[part] = base64.b64encode(changed).decode()
        assert "does not match" in problems(json.dumps(fields).encode())


STATEMENT = json.loads(state_manifest(MANIFEST))
SUBJECT = STATEMENT["subject"][0]


@pytest.mark.parametrize(
    ("envelope", "sentence"),
    [
        (None, "has no manifest.dsse.json"),
        (b"", "valid JSON"),
        (b"[" * 100_000, "inside each other"),
        (b" " * (LARGEST_ENVELOPE + 1), "at most"),
        (b"[]", "must be a DSSE envelope"),
        (b'{"payload": "e30=", "payloadType": "x", "signatures": [{"sig": "AA=="}]}', "must be a DSSE envelope"),
        (b'{"payload": "e30=", "payloadType": 3, "signatures": []}', "must be a DSSE envelope"),
        (b'{"payload": "e30=", "payloadType": "x", "signatures": [{"keyid": 3, "sig": ""}]}', "must be a DSSE"),
        (b'{"payload": "e30=", "payloadType": "x", "signatures": {"a": 1}}', "must be a DSSE envelope"),
        (json.dumps(json.loads(signed_by(OWNER)) | {"signatures": []}).encode(), "0 signatures of other keys"),
        (signed_by(OTHER), "1 signatures of other keys"),
        (resigned(state_manifest(MANIFEST), "application/json"), "payload must be of type"),
        (resigned(b"no JSON"), "valid JSON"),
        (resigned(b"[]"), "statement must be of type"),
        (resigned(json.dumps(STATEMENT | {"_type": "https://in-toto.io/Statement/v0.1"}).encode()), "Statement/v1"),
        (resigned(json.dumps(STATEMENT | {"predicateType": "urn:other"}).encode()), "predicate must be of type"),
        (resigned(json.dumps(STATEMENT | {"subject": []}).encode()), "must have one subject"),
        (resigned(json.dumps(STATEMENT | {"subject": [SUBJECT, SUBJECT]}).encode()), "must have one subject"),
        (resigned(json.dumps(STATEMENT | {"subject": [SUBJECT | {"name": "plan.json"}]}).encode()), "'plan.json'"),
        (resigned(json.dumps(STATEMENT | {"subject": [SUBJECT | {"digest": {"md5": "0"}}]}).encode()), "sha256"),
        (
            resigned(json.dumps(STATEMENT | {"subject": [SUBJECT | {"digest": {"sha256": "0" * 64}}]}).encode()),
            "another manifest.json",
        ),
    ],
)  # fmt: skip
def test_what_is_wrong_with_an_envelope_is_told(envelope, sentence):
    assert sentence in problems(envelope)


@pytest.mark.parametrize(
    "envelope", [b"{}", signed_by(OWNER, canonical_bytes(json.loads(MANIFEST) | {"clips": []}))]
)
def test_an_envelope_of_something_else_is_not_written_over(envelope):
    with pytest.raises(InputError, match=r"manifest.dsse.json: must"):
        signed_by(OWNER, envelope=envelope)


ELLIPTIC = generate_private_key(SECP256R1())


@pytest.mark.parametrize(
    ("pem", "sentence"),
    [
        (b"", "must be an Ed25519 private key in PEM"),
        (b"\xff" * 99, "must be an Ed25519 private key in PEM"),
        (private_pem(OWNER)[:60], "must be an Ed25519 private key in PEM"),
        (private_pem(ELLIPTIC), "another algorithm"),
        (public_pem(OWNER), "needs the private key"),
        (private_pem(OWNER, BestAvailableEncryption(b"secret")), "must have no passphrase"),
    ],
)
def test_what_is_no_private_key_is_told(pem, sentence):
    with pytest.raises(InputError, match=f"mine.pem: .*{sentence}"):
        load_signer(pem, "mine.pem")


@pytest.mark.parametrize(
    ("pem", "sentence"),
    [
        (b"", "must be an Ed25519 public key in PEM"),
        (public_pem(OWNER)[:60], "must be an Ed25519 public key in PEM"),
        (public_pem(ELLIPTIC), "another algorithm"),
        (private_pem(OWNER), "needs the public key"),
    ],
)
def test_what_is_no_public_key_is_told(pem, sentence):
    with pytest.raises(InputError, match=f"theirs.pem: .*{sentence}"):
        load_verifier(pem, "theirs.pem")
