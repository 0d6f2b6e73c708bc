"""A stage for each attack: a copy of the toy dataset as a stranger sends it, beside somebody's own files."""

import shutil
from functools import lru_cache
from pathlib import Path

import pytest
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey
from cryptography.hazmat.primitives.serialization import Encoding, NoEncryption, PrivateFormat

from flows.making import generate
from flows.store.layout import Layout
from tests.flows.reseal import reseal
from tests.hostile.stage import Stage
from tests.toy_street import write_toy_grid


@pytest.fixture(scope="session")
def sent_dataset(tmp_path_factory) -> Layout:
    """The toy dataset with the fewest frames that every command can read: most commands run on it a hundred times.

    Four fifths of its manifest would be the list of installed libraries, which no attack is about; three are left.
    """
    folder = tmp_path_factory.mktemp("sent")
    grid = write_toy_grid(folder, frames=5)
    layout = generate.generate_dataset(grid, str(folder / "data"), runner="threads", workers=1).layout
    reseal(
        layout,
        lambda manifest: manifest["environment"].update(components=manifest["environment"]["components"][:3]),
    )
    return layout


@pytest.fixture(scope="module", autouse=True)
def plan_made_once():
    """The user's own grid, which `generate` plans anew before it looks at a dataset, is the same for every attack."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(generate, "make_plan", lru_cache(generate.make_plan))
        yield


@pytest.fixture
def stage(sent_dataset, tmp_path) -> Stage:
    world = tmp_path / "world"
    shutil.copytree(sent_dataset.root, world / "inbox" / "data")
    fill_with_files(world / "victim")
    key = Ed25519PrivateKey.from_private_bytes(bytes(32))
    (world / "key.pem").write_bytes(key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption()))
    return Stage(world=world, original=sent_dataset, grid=sent_dataset.root.parent / "grid.yaml")


def fill_with_files(victim: Path) -> None:
    """Files that nobody wants to lose, some with names that muSync uses."""
    for name in ("id_rsa", "photos/wedding.jpg", "lock", "clips.parquet", "0123456789abcdef.json", "a.1.partial",
                 "scratch-x/.staging/lock", "rgb/zarr.json", "vehicle.yaml"):  # fmt: skip
        (victim / name).parent.mkdir(parents=True, exist_ok=True)
        (victim / name).write_text(f"precious {name}\n")
