"""A small finished dataset that tests of its readers share; who changes files takes a copy."""

import pytest

from catalogs.scenes import write_scene
from flows.making.generate import generate
from flows.store.layout import Layout
from tests.flows.test_pipeline import GRID
from tests.toy_street import TOY_CAMERA, toy_street


@pytest.fixture(scope="session")
def toy_dataset(tmp_path_factory) -> Layout:
    folder = tmp_path_factory.mktemp("toy")
    write_scene(toy_street(), folder / "scene", {})
    (folder / "camera.yaml").write_text(TOY_CAMERA)
    grid = folder / "grid.yaml"
    grid.write_text(GRID.format(scene=folder / "scene", camera=folder / "camera.yaml", frames=11))
    return generate(str(grid), str(folder / "data"), runner="threads", workers=1).layout
