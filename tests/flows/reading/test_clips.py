"""A dataset as an object of Python: its clips by label, how a notebook shows them, plots, and names that are wrong."""

import base64
import copy
import re
from dataclasses import replace

import cv2
import numpy as np
import pytest

import musync
from flows.reading.query import VIEWS
from flows.store.frames import read_clip
from tasks.conventions import CHANNELS_BY_NAME
from tasks.errors import InputError


@pytest.fixture(scope="module")
def data(toy_dataset):
    opened = musync.open(toy_dataset.root)
    yield opened
    opened.connection.close()


def with_clip(data: musync.Dataset, index: int, **fields: object) -> musync.Dataset:
    """The dataset with one clip's record changed."""
    clips = copy.deepcopy(data.manifest["clips"])
    clips[index].update(fields)
    return with_manifest(data, clips=clips)


def with_manifest(data: musync.Dataset, **fields: object) -> musync.Dataset:
    """The dataset with other fields in its manifest."""
    other = replace(data)
    vars(other)["manifest"] = data.manifest | fields
    return other


def test_a_dataset_is_a_mapping_of_labels_to_clips(data):
    assert len(data) == 4 and list(data) == ["dry/flat", "dry/hump", "snow-3/flat", "snow-3/hump"]
    clip = data["snow-3/flat"]
    assert (clip.label, clip.record["index"]) == ("snow-3/flat", 2)
    assert data[clip.clip_id] == clip
    assert "snow-3/flat" in data and clip.clip_id in data and "snow-3" not in data


def test_a_wrong_label_is_one_sentence_with_the_labels_that_come_near(data):
    with pytest.raises(InputError, match=r"clip 'snow-3/flta': .* near it: snow-3/flat") as caught:
        data["snow-3/flta"]
    assert len(caught.value.problems) == 1
    with pytest.raises(InputError, match=r"clip 7: .*the first: dry/flat.* list\(data\) has all 4"):
        data[7]


@pytest.mark.parametrize("view", VIEWS)
def test_every_wrong_column_is_told_at_once_with_those_that_come_near(data, view):
    right = VIEWS[view][0].name
    with pytest.raises(InputError) as caught:
        data.pandas(view, [right, f"{right}x", "an'odd\"one"])
    assert len(caught.value.problems) == 2
    assert f"{view}: column '{right}x'" in caught.value.problems[0] and right in caught.value.problems[0]


def test_one_column_needs_no_list_and_none_is_no_question(data):
    assert list(data.pandas("clips", "label").columns) == ["label"]
    with pytest.raises(InputError, match="must name one or more"):
        data.pandas("clips", [])


def test_a_clips_rows_are_its_own_in_the_order_of_time(data):
    ticks = data["dry/hump"].pandas(columns=["clip_id", "t_ns"])
    assert set(ticks.clip_id) == {data["dry/hump"].clip_id}
    np.testing.assert_array_equal(ticks.t_ns, np.arange(1001) * 1_000_000)
    with pytest.raises(InputError, match="two clips a row"):
        data["dry/hump"].pandas("pairs")


@pytest.mark.parametrize("view", VIEWS)
def test_a_frame_of_pandas_carries_unit_and_meaning_of_every_column(data, view):
    frame = data.pandas(view)
    assert set(frame.attrs["long_name"]) == set(frame.columns) - {"family"}
    units = {name: CHANNELS_BY_NAME[name].unit for name in frame.columns if name != "family"}
    assert frame.attrs["units"] == {name: unit for name, unit in units.items() if unit}


def test_one_picture_is_the_stored_one(data, toy_dataset):
    stored = read_clip(toy_dataset.frames, 1, "rgb")
    np.testing.assert_array_equal(data["dry/hump"].picture(3), stored[3])
    np.testing.assert_array_equal(data["dry/hump"].picture(), stored[5])
    for wrong in (-1, 11):
        with pytest.raises(InputError, match="must be one of the 11 frames"):
            data["dry/hump"].picture(wrong)


def test_the_plot_shows_the_telemetry_in_the_units_of_its_titles(data):
    figure = data["dry/flat"].plot()
    ticks = data["dry/flat"].pandas()
    titles = [axis.title.text for axis in figure.select_yaxes()]
    assert titles == ["speed [km/h]", "braking slip", "wheel load [kN]", "pitch [deg]"]
    shown = [
        ticks.speed * 3.6, ticks.braking_slip_f, ticks.braking_slip_r,
        ticks.axle_load_f / 2000, ticks.axle_load_r / 2000, np.degrees(ticks.pitch),
    ]  # fmt: skip
    assert len(figure.data) == 6
    for line, values in zip(figure.data, shown, strict=True):
        np.testing.assert_allclose(line.x, ticks.t_ns * 1e-9, rtol=1e-12)
        np.testing.assert_allclose(line.y, values, rtol=1e-12)
    # shaded from the brake's onset by the grid; the first pressure is one tick later
    assert len(figure.layout.shapes) == 4
    assert all(shape.x0 == pytest.approx(0.2, abs=0.002) for shape in figure.layout.shapes)
    assert not data["dry/hump"].plot().layout.shapes


def test_a_card_has_the_counts_the_weathers_the_range_of_stops_and_a_picture_of_each_weather(data):
    stopped = with_clip(data, 0, figures=data["dry/flat"].figures | {"stopping_distance": 8.25})
    stopped = with_clip(stopped, 2, figures=data["snow-3/flat"].figures | {"stopping_distance": 31.75})
    stopped = with_clip(stopped, 1, verdict=data["dry/hump"].record["verdict"] | {"passed": False})
    card = stopped._repr_html_()
    for text in ("4, of 11 frames at 10 Hz", ">44<", "dry (2), snow (2)", "8.2 to 31.8 m (2 of 4 clips stop)",
                 "1 clips, whose pose check failed", data.manifest["run_id"]):  # fmt: skip
        assert text in card
    assert "no clip stops" in data._repr_html_()
    sources = re.findall(r'src="data:image/jpeg;base64,([^"]+)"', card)
    assert len(sources) == 2
    seen = cv2.imdecode(np.frombuffer(base64.b64decode(sources[1]), np.uint8), cv2.IMREAD_COLOR_RGB)
    wanted = cv2.resize(data["snow-3/flat"].picture(), (160, 107), interpolation=cv2.INTER_AREA)
    assert seen.shape == wanted.shape
    assert np.abs(seen.astype(int) - wanted).mean() < 6
    assert np.abs(seen.astype(int) - wanted[:, :, ::-1]).mean() > np.abs(seen.astype(int) - wanted).mean()


def test_a_card_of_a_clip_has_its_figures(data):
    card = data["dry/flat"]._repr_html_()
    assert (
        ">0.820<" in card
        and ">40 km/h<" in card
        and "no stop in the clip" in card
        and card.count("<img") == 1
    )


def test_what_a_dataset_says_of_itself_is_text_in_cards_and_plots(data):
    evil = '"><script>alert(1)</script>{{ 7 * 7 }}'
    odd = with_clip(data, 0, label=evil, scenario=data["dry/flat"].record["scenario"] | {"weather": evil})
    odd = with_manifest(odd, grid=odd.manifest["grid"] | {"name": evil, "scene": evil})
    for card in (odd._repr_html_(), odd[evil]._repr_html_()):
        assert "<script" not in card and "&lt;script&gt;" in card
        assert "{{ 7 * 7 }}" in card and 'alt="&#34;&gt;' in card
    assert "<script" not in odd[evil].plot().layout.title.text


def test_a_dataset_without_readable_pictures_still_shows_its_figures(data):
    bare = with_manifest(data, grid=data.manifest["grid"] | {"pictures": False})
    for card in (bare._repr_html_(), bare["dry/flat"]._repr_html_()):
        assert "<img" not in card and "was made without frames" in card and ">dry" in card
