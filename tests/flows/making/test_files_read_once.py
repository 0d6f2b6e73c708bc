"""A clip reads each catalogue file at most once: when its dataset is planned, and when it is made."""

import io
from collections import Counter

import pytest

from catalogs.entries import entry_folder
from flows.making.catalogue import Catalogue
from flows.making.plan import make_plan
from flows.store.layout import write_atomically
from manifests.provenance import code_version
from tests.toy_street import TOY_GRID, write_toy_grid


@pytest.fixture
def reads(monkeypatch):
    """How often each catalogue file is opened, beside once for the hash of all sources."""
    code_version()
    counts: Counter[str] = Counter()
    opened = io.open

    def count(file, mode="r", *args, **kwargs):
        if mode.startswith("r") and str(file).endswith((".yaml", ".tir")):
            counts[str(file)] += 1
        return opened(file, mode, *args, **kwargs)

    monkeypatch.setattr("io.open", count)
    monkeypatch.setattr("builtins.open", count)
    return counts


@pytest.mark.parametrize("setting", ["", "variant: fixed-mu\n", "variant: no-low-speed-rule\n"])
def test_a_clip_reads_each_catalogue_file_at_most_once(tmp_path, reads, setting):
    grid = write_toy_grid(tmp_path, TOY_GRID + "vehicle: {folder}/car.yaml\n" + setting, frames=11)
    car = tmp_path / "car.yaml"
    car.write_text("extends: bmw-m8\ntyre: pacejka-205-60r15\n")
    reads.clear()
    _, inputs = make_plan(grid, "cpu")
    assert reads[str(car)] == 1 and reads[str(entry_folder("vehicle") / "bmw-m8.yaml")] == 1
    for name, content in inputs.items():
        write_atomically(tmp_path / "inputs" / name, content)
    kept = Counter(reads)
    catalogue = Catalogue(tmp_path / "inputs", str(tmp_path / "scene"))
    for name in (name for name in vars(Catalogue) if not name.startswith("_")):
        getattr(catalogue, name)
    assert set(reads) - set(kept) >= {
        str(tmp_path / "inputs" / name) for name in ("vehicle.yaml", "weather/snow.yaml")
    }
    assert {file: count for file, count in reads.items() if count > 1} == {}
