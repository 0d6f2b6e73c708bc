"""Sheets of stills: one row a drive with all its weathers, one row a road feature before, at and after contact."""

import cv2
import pytest

from catalogs.scenes import write_scene
from flows.generate import generate
from flows.sheets import sheets
from flows.store.layout import Layout
from tasks.errors import InputError
from tasks.render.contact_sheet import CAPTION, MARGIN, TILE_WIDTH
from tests.flows.test_pipeline import GRID
from tests.toy_street import TOY_CAMERA, toy_street


@pytest.fixture(scope="module")
def dataset(tmp_path_factory) -> Layout:
    folder = tmp_path_factory.mktemp("sheets")
    write_scene(toy_street(), folder / "scene", {})
    (folder / "camera.yaml").write_text(TOY_CAMERA)
    grid = folder / "grid.yaml"
    grid.write_text(GRID.format(scene=folder / "scene", camera=folder / "camera.yaml", frames=4))
    return generate(str(grid), str(folder / "data"), runner="threads", workers=2).layout


def test_sheets_have_a_row_a_drive_and_a_row_a_feature(dataset, tmp_path):
    written = sheets(str(dataset.root), str(tmp_path))
    weather, hazards = (cv2.imread(written[name]) for name in ("weather", "hazards"))
    tile = round(TILE_WIDTH * 2 / 3)
    row, column = tile + MARGIN + CAPTION, TILE_WIDTH + MARGIN
    # two drives in two weathers; two clips with a hump, three moments each
    assert weather.shape[:2] == (2 * row + MARGIN, 2 * column + MARGIN)
    assert hazards.shape[:2] == (2 * row + MARGIN, 3 * column + MARGIN)


def test_a_folder_that_is_no_dataset_is_named(tmp_path):
    with pytest.raises(InputError, match="must be a finished dataset"):
        sheets(str(tmp_path), str(tmp_path))
