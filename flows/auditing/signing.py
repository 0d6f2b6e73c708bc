"""Signing a finished dataset, and what its signatures say."""

from pathlib import Path
from typing import Any

from cryptography.hazmat.primitives.serialization import Encoding, PublicFormat, load_pem_public_key
from securesystemslib.signer import CryptoSigner

from catalogs.documents import LARGEST_JSON, read_content
from flows.store.address import open_for_writing, send_files
from flows.store.layout import Layout, write_atomically
from flows.store.lock import sole_writer
from flows.store.sealed import read_manifest
from flows.store.staging import left_overs, remove_staged, remove_staging
from manifests.canonical import sha256_of
from manifests.manifest import manifest_damage
from manifests.signing import (
    ENVELOPE,
    LARGEST_ENVELOPE,
    add_signature,
    find_signature_problems,
    load_signer,
    load_verifier,
    read_envelope,
)
from tasks.errors import InputError

LARGEST_KEY = 2**16
"""Bytes of a key file [1]: an Ed25519 key takes 120."""
SEAL_ALONE = "the seal shows damage, not forgery: a stranger who changes files can compute it again"


def sign_dataset(dataset: str, *, key: str) -> dict[str, Any]:
    """Sign a finished dataset's manifest, and with it every file that the manifest records.

    The signature goes into ``manifest.dsse.json`` beside the manifest. Another key adds another signature; the same
    key changes nothing. The files themselves are not looked at: `verify` does that, before and after.

    Parameters
    ----------
    dataset : a sealed dataset
    key : file with the Ed25519 private key: PEM, PKCS#8, without passphrase

    Returns
    -------
    ``key_id`` of the key; ``manifest_sha256``, what it vouches for; ``signatures`` in the envelope; ``written``, False
    where the key had signed already.

    Raises
    ------
    InputError
        If the key is no Ed25519 private key, the manifest is damaged, or the present envelope holds another statement.
    """
    signer = load_signer(read_content(Path(key), "private key", LARGEST_KEY), key)
    with open_for_writing(dataset, _signed_record) as layout:
        read_manifest(layout, sealed=False)
        with sole_writer(layout):
            try:
                remove_staged(left_overs(layout))
                return _sign_manifest(layout, signer)
            finally:
                remove_staging(layout)


def _sign_manifest(layout: Layout, signer: CryptoSigner) -> dict[str, Any]:
    content = layout.manifest.read_bytes()
    if fault := manifest_damage(content):
        raise InputError(f"{layout}/manifest.json: only a sound manifest can be signed; it is {fault}")
    before = _load_envelope(layout)
    envelope = add_signature(content, before, signer)
    if envelope != before:
        write_atomically(layout.root / ENVELOPE, envelope)
        send_files(layout, [layout.root / ENVELOPE])
    return {
        "key_id": signer.public_key.keyid,
        "manifest_sha256": sha256_of([content]),
        "signatures": len(read_envelope(envelope).signatures),
        "written": envelope != before,
    }


def signature_findings(layout: Layout, key: str | None) -> dict[str, Any]:
    """Check the signatures of a dataset.

    Parameters
    ----------
    layout : a sealed dataset
    key : file with an Ed25519 public key in PEM; None checks no signature

    Returns
    -------
    ``signed``: True if the key's signature over this very manifest is valid, False if not, None if no key is given;
    ``signature``: the same in a sentence; ``signers``: ids of the keys that the envelope names, which anybody can
    write there; ``key_id`` of the key that was asked about, and ``key_sha256``, the hash of its DER form; None if no
    key is given.

    Raises
    ------
    InputError
        If the key is no Ed25519 public key.
    """
    if key is None:
        signers, sentence = _describe_unchecked(layout)
        return {"signed": None, "signature": sentence, "signers": signers, "key_id": None, "key_sha256": None}
    pem = read_content(Path(key), "public key", LARGEST_KEY)
    verifier = load_verifier(pem, key)
    signers = []
    try:
        content, envelope = read_content(layout.manifest, "manifest", LARGEST_JSON), _load_envelope(layout)
        problems = find_signature_problems(content, envelope, verifier)
        signers = _list_signers(envelope)
    except InputError as error:
        problems = list(error.problems)
    held = {"signers": signers, "key_id": verifier.keyid, "key_sha256": hash_public_key(pem)}
    if problems:
        return {"signed": False, "signature": "; ".join(problems), **held}
    return {
        "signed": True,
        "signature": f"valid: key {verifier.keyid[:16]} has signed this manifest.json",
        **held,
    }


def hash_public_key(pem: bytes) -> str:
    """SHA-256 of a public key in DER form, as ``openssl pkey -pubin -outform DER | sha256sum`` gives it.

    Parameters
    ----------
    pem : the key as `manifests.signing.load_verifier` takes it
    """
    return sha256_of([load_pem_public_key(pem).public_bytes(Encoding.DER, PublicFormat.SubjectPublicKeyInfo)])


def _describe_unchecked(layout: Layout) -> tuple[list[str], str]:
    try:
        envelope = _load_envelope(layout)
        if envelope is None:
            return [], f"there is none, and {SEAL_ALONE}"
        signers = _list_signers(envelope)
    except InputError as error:
        return [], f"not checked, and not readable: {'; '.join(error.problems)}; {SEAL_ALONE}"
    return (
        signers,
        f"{len(signers)} not checked: give the signer's public key with --key; {SEAL_ALONE}",
    )


def _list_signers(envelope: bytes | None) -> list[str]:
    return [] if envelope is None else sorted(read_envelope(envelope).signatures)


def _load_envelope(layout: Layout) -> bytes | None:
    path = layout.root / ENVELOPE
    if not path.is_symlink() and not path.exists():
        return None
    return read_content(path, "signature envelope", LARGEST_ENVELOPE)


def _signed_record(name: str) -> bool:
    """Whether signing reads a file of the dataset."""
    return name in {"plan.json", "manifest.json", ENVELOPE}
