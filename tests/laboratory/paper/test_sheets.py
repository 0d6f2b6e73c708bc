"""Sheets of stills: one row a drive with all its weathers, one row a road feature before, at and after contact."""

import cv2
import pytest

from flows.reading.frames import Frames
from flows.store.sealed import read_manifest
from flows.store.telemetry import read_columns
from studies.paper.sheets import _draw_still, draw_sheets, is_flat_twin
from tasks.errors import InputError
from tasks.render.contact_sheet import CAPTION, MARGIN, TILE_WIDTH


def test_sheets_have_a_row_a_drive_and_a_row_a_feature(toy_dataset, tmp_path):
    written = draw_sheets(str(toy_dataset.root), str(tmp_path))
    weather, hazards = (cv2.imread(written[name]) for name in ("weather", "hazards"))
    tile = round(TILE_WIDTH * 2 / 3)
    row, column = tile + MARGIN + CAPTION, TILE_WIDTH + MARGIN
    # two drives in two weathers; two clips with a hump, three moments each
    assert weather.shape[:2] == (2 * row + MARGIN, 2 * column + MARGIN)
    assert hazards.shape[:2] == (2 * row + MARGIN, 3 * column + MARGIN)


def test_further_datasets_add_a_row_of_their_weathers_each_and_must_be_finished(toy_dataset, tmp_path):
    made = str(toy_dataset.root)
    alone, four = (
        cv2.imread(draw_sheets(made, str(tmp_path / name), beside=beside)["weather"])
        for name, beside in (("alone", None), ("four", [made, made]))
    )
    row = round(TILE_WIDTH * 2 / 3) + MARGIN + CAPTION
    assert four.shape[0] == alone.shape[0] + 2 * row and four.shape[1] == alone.shape[1]
    first = alone[MARGIN : MARGIN + row]
    assert all((four[MARGIN + k * row :][:row] == first).all() for k in (2, 3)), (
        "all weathers of its first drive"
    )
    with pytest.raises(InputError, match=r"one: must be a finished dataset[^$]*two: must be"):
        draw_sheets(made, str(tmp_path / "x"), beside=[str(tmp_path / "one"), str(tmp_path / "two")])


def test_a_place_that_no_clip_comes_to_is_refused_and_a_car_that_stops_before_it_is_called_so(
    toy_dataset, tmp_path
):
    clips = read_manifest(toy_dataset)["clips"]
    ends = [
        read_columns(toy_dataset.telemetry / "frames", clip["clip_id"], most=11)["station"][-1]
        for clip in clips
    ]
    for station in (max(ends) + 0.1, -5.0, float("nan")):
        with pytest.raises(InputError, match=f"--station must lie in 0.0 to {max(ends):.1f} m, where a clip"):
            draw_sheets(str(toy_dataset.root), str(tmp_path), station=station)
    assert not any(tmp_path.iterdir())
    for station, told in ((ends[0] - 0.1, "at  "), (ends[0] + 0.1, "at, not reached  ")):
        assert _draw_still(Frames(layout=toy_dataset), clips[0], station, "at")[0].startswith(told)


def test_a_flat_twin_is_the_same_drive_weather_and_seed_without_the_feature():
    flat, hump = (
        {"seed": "7", "scenario": {"weather": "dry", "initial_speed_km_h": 40, "hazard_center_m": center,
                                   "hazard_height_m": height}}
        for center, height in ((0, 0.0), (4, 0.075))
    )  # fmt: skip
    assert is_flat_twin(flat, hump)
    assert not is_flat_twin(hump, hump)
    assert not is_flat_twin(flat | {"seed": "8"}, hump)
    for other in ({"weather": "rain"}, {"initial_speed_km_h": 60}):
        assert not is_flat_twin(flat | {"scenario": flat["scenario"] | other}, hump)


def test_a_folder_that_is_no_dataset_is_named(tmp_path):
    with pytest.raises(InputError, match="must be a finished dataset"):
        draw_sheets(str(tmp_path), str(tmp_path))
