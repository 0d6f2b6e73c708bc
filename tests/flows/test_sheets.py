"""Sheets of stills: one row a drive with all its weathers, one row a road feature before, at and after contact."""

import cv2
import pytest

from flows.sheets import sheets
from tasks.errors import InputError
from tasks.render.contact_sheet import CAPTION, MARGIN, TILE_WIDTH


def test_sheets_have_a_row_a_drive_and_a_row_a_feature(toy_dataset, tmp_path):
    written = sheets(str(toy_dataset.root), str(tmp_path))
    weather, hazards = (cv2.imread(written[name]) for name in ("weather", "hazards"))
    tile = round(TILE_WIDTH * 2 / 3)
    row, column = tile + MARGIN + CAPTION, TILE_WIDTH + MARGIN
    # two drives in two weathers; two clips with a hump, three moments each
    assert weather.shape[:2] == (2 * row + MARGIN, 2 * column + MARGIN)
    assert hazards.shape[:2] == (2 * row + MARGIN, 3 * column + MARGIN)


def test_a_folder_that_is_no_dataset_is_named(tmp_path):
    with pytest.raises(InputError, match="must be a finished dataset"):
        sheets(str(tmp_path), str(tmp_path))
