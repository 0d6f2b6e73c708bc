"""Signatures over a manifest: Ed25519 in a DSSE envelope, around an in-toto statement of the manifest's hash.

The manifest's own seal is a hash that anybody can compute again; a signature needs the private key.
"""

import json
from collections.abc import Mapping
from typing import Any

from cryptography.exceptions import UnsupportedAlgorithm
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey, Ed25519PublicKey
from cryptography.hazmat.primitives.serialization import load_pem_private_key, load_pem_public_key
from securesystemslib.dsse import Envelope
from securesystemslib.exceptions import FormatError, VerificationError
from securesystemslib.signer import CryptoSigner, SSlibKey

from catalogs.documents import parse_json
from manifests.canonical import canonical_bytes, sha256_of
from tasks.errors import InputError

ENVELOPE = "manifest.dsse.json"
"""Name of the file beside the manifest that holds its signatures."""
SUBJECT = "manifest.json"
PAYLOAD_TYPE = "application/vnd.in-toto+json"
STATEMENT_TYPE = "https://in-toto.io/Statement/v1"
PREDICATE_TYPE = "urn:musync:dataset:v1"
LARGEST_ENVELOPE = 2**20
"""Bytes of an envelope [1]: a signature takes 200."""


def load_signer(pem: bytes, origin: object) -> CryptoSigner:
    """The signer of a private key.

    Parameters
    ----------
    pem : PKCS#8 in PEM, as ``openssl genpkey -algorithm ed25519`` writes it
    origin : where it comes from, for the sentence

    Raises
    ------
    InputError
        If it is no Ed25519 private key, or needs a passphrase.
    """
    if b"PUBLIC KEY-----" in pem:
        raise InputError(f"{origin}: signing needs the private key; this is a public key")
    try:
        key = load_pem_private_key(pem, password=None)
    except TypeError:
        raise InputError(f"{origin}: the private key must have no passphrase; it has one") from None
    except (ValueError, UnsupportedAlgorithm):
        raise InputError(
            f"{origin}: must be an Ed25519 private key in PEM; it cannot be read as one"
        ) from None
    if not isinstance(key, Ed25519PrivateKey):
        raise InputError(f"{origin}: must be an Ed25519 private key; it is of another algorithm")
    return CryptoSigner(key)


def load_verifier(pem: bytes, origin: object) -> SSlibKey:
    """The public key that signatures are checked with.

    Parameters
    ----------
    pem : SubjectPublicKeyInfo in PEM, as ``openssl pkey -pubout`` writes it
    origin : where it comes from, for the sentence

    Raises
    ------
    InputError
        If it is no Ed25519 public key.
    """
    if b"PRIVATE KEY-----" in pem:
        raise InputError(
            f"{origin}: verifying needs the public key; this is a private key, which stays with its owner"
        )
    try:
        key = load_pem_public_key(pem)
    except (ValueError, UnsupportedAlgorithm):
        raise InputError(
            f"{origin}: must be an Ed25519 public key in PEM; it cannot be read as one"
        ) from None
    if not isinstance(key, Ed25519PublicKey):
        raise InputError(f"{origin}: must be an Ed25519 public key; it is of another algorithm")
    return SSlibKey.from_crypto(key)


def state_manifest(content: bytes) -> bytes:
    """The in-toto statement about a manifest; the same manifest gives the same bytes.

    Parameters
    ----------
    content : the manifest's bytes, which are a sound manifest
    """
    manifest = json.loads(content)
    return canonical_bytes(
        {
            "_type": STATEMENT_TYPE,
            "subject": [{"name": SUBJECT, "digest": {"sha256": sha256_of([content])}}],
            "predicateType": PREDICATE_TYPE,
            "predicate": {
                "run_id": manifest["run_id"],
                "format": manifest["format"],
                "clips": len(manifest["clips"]),
                "git": manifest["git"],
            },
        }
    )


def add_signature(manifest: bytes, envelope: bytes | None, signer: CryptoSigner) -> bytes:
    """The envelope with one signature more; a key that has signed already leaves it as it is.

    Parameters
    ----------
    manifest : the manifest's bytes, which are a sound manifest
    envelope : the present envelope's bytes; None where there is none
    signer : the private key

    Raises
    ------
    InputError
        If the present envelope is none, or holds another statement than this manifest's.
    """
    statement = state_manifest(manifest)
    if envelope is None:
        held = Envelope(statement, PAYLOAD_TYPE, {})
    else:
        held = read_envelope(envelope)
        if (held.payload_type, held.payload) != (PAYLOAD_TYPE, statement):
            raise InputError(
                f"{ENVELOPE}: must hold the statement about this manifest.json to take another signature;"
                " it holds another: move the file away if its signatures are of no use"
            )
    before = dict(held.signatures)
    held.sign(signer)
    if envelope is not None and held.signatures == before:
        return envelope
    return canonical_bytes(held.to_dict())


def find_signature_problems(manifest: bytes, envelope: bytes | None, key: SSlibKey) -> list[str]:
    """Why a key does not vouch for a manifest; empty when its signature over these very bytes is valid.

    What a statement says is looked at only after its signature holds.

    Parameters
    ----------
    manifest : the manifest's bytes
    envelope : the envelope's bytes; None where there is none
    key : whose signature is asked for
    """
    if envelope is None:
        return [f"there must be a signature; the dataset has no {ENVELOPE}"]
    try:
        held = read_envelope(envelope)
    except InputError as error:
        return list(error.problems)
    if held.payload_type != PAYLOAD_TYPE:
        return [f"{ENVELOPE}: the payload must be of type {PAYLOAD_TYPE}; it is {held.payload_type[:80]!r}"]
    if key.keyid not in held.signatures:
        others = len(held.signatures)
        return [
            f"{ENVELOPE}: must be signed by key {key.keyid[:16]}; it has {others} signatures of other keys"
        ]
    try:
        held.verify([key], threshold=1)
    except VerificationError:
        return [
            f"{ENVELOPE}: the signature of key {key.keyid[:16]} does not match: it, or what it signed, was changed"
        ]
    try:
        statement = parse_json(held.payload, ENVELOPE, "signed statement")
    except InputError as error:
        return list(error.problems)
    return [
        f"{ENVELOPE}: {problem}" for problem in _find_statement_problems(statement, sha256_of([manifest]))
    ]


def read_envelope(content: bytes) -> Envelope:
    """A DSSE envelope from its bytes.

    Raises
    ------
    InputError
        If they are none.
    """
    if len(content) > LARGEST_ENVELOPE:
        raise InputError(f"{ENVELOPE}: must have at most {LARGEST_ENVELOPE} bytes; it has more")
    fields = parse_json(content, ENVELOPE, "signature envelope")
    try:
        held = Envelope.from_dict(fields)
        sound = isinstance(held.payload_type, str) and all(
            isinstance(keyid, str) for keyid in held.signatures
        )
    except (KeyError, TypeError, ValueError, AttributeError, FormatError):
        sound = False
    if not sound:
        raise InputError(
            f"{ENVELOPE}: must be a DSSE envelope with payload, payloadType and signatures of distinct keys; it is not"
        )
    return held


def _find_statement_problems(statement: Any, digest: str) -> list[str]:
    """List the reasons why a signed statement is not about the manifest with this hash."""
    if not isinstance(statement, Mapping) or statement.get("_type") != STATEMENT_TYPE:
        return [f"the signed statement must be of type {STATEMENT_TYPE}; it is not"]
    problems = []
    if statement.get("predicateType") != PREDICATE_TYPE:
        problems.append(
            f"the signed statement's predicate must be of type {PREDICATE_TYPE}; it is of another"
        )
    match statement.get("subject"):
        case [{"name": name, "digest": {"sha256": signed}}]:
            if name != SUBJECT:
                problems.append(
                    f"the signed statement must be about {SUBJECT}; it is about {str(name)[:80]!r}"
                )
            if signed != digest:
                problems.append("the signature is of another manifest.json: this one was changed or replaced")
        case _:
            problems.append("the signed statement must have one subject with a name and a sha256; it has not")
    return problems
