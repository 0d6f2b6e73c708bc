"""A stage for each attack: a copy of the toy dataset as a stranger sends it, beside somebody's own files."""

import shutil
from pathlib import Path

import pytest
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey
from cryptography.hazmat.primitives.serialization import Encoding, NoEncryption, PrivateFormat

from tests.hostile.stage import Stage


@pytest.fixture
def stage(toy_dataset, tmp_path) -> Stage:
    world = tmp_path / "world"
    shutil.copytree(toy_dataset.root, world / "inbox" / "data")
    fill_with_files(world / "victim")
    key = Ed25519PrivateKey.from_private_bytes(bytes(32))
    (world / "key.pem").write_bytes(key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption()))
    return Stage(world=world, original=toy_dataset, grid=toy_dataset.root.parent / "grid.yaml")


def fill_with_files(victim: Path) -> None:
    """Files that nobody wants to lose, some with names that muSync uses."""
    for name in ("id_rsa", "photos/wedding.jpg", "lock", "clips.parquet", "0123456789abcdef.json", "a.1.partial",
                 "scratch-x/.staging/lock", "rgb/zarr.json", "vehicle.yaml"):  # fmt: skip
        (victim / name).parent.mkdir(parents=True, exist_ok=True)
        (victim / name).write_text(f"precious {name}\n")
