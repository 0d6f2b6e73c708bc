"""Keys of two people who sign datasets."""

from pathlib import Path

from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey

from tests.manifests.test_signing import private_pem, public_pem


def write_keys(folder: Path) -> dict[str, str]:
    """Paths of the files of two key pairs: owner, owner.pub, other, other.pub."""
    paths = {}
    for name in ("owner", "other"):
        key = Ed25519PrivateKey.generate()
        for suffix, content in (("", private_pem(key)), (".pub", public_pem(key))):
            (folder / (name + suffix)).write_bytes(content)
            paths[name + suffix] = str(folder / (name + suffix))
    return paths
