"""The same dataset in every library: one value, whichever way it is read; and the SQL views."""

import copy
import json
import re
import shutil
import subprocess
import sys
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pyarrow.parquet as pq
import pytest
from torch.utils.data import DataLoader

import musync
from flows.reading.pictures import open_labelled_frames
from flows.reading.query import VIEWS, list_columns, query_dataset
from flows.store.frames import read_clip
from manifests.provenance import SOURCE_ROOT
from tasks.conventions import CHANNELS_BY_NAME, TICK_CHANNELS
from tasks.errors import InputError


@pytest.fixture(scope="module")
def data(toy_dataset):
    opened = musync.open(toy_dataset.root)
    yield opened
    opened.connection.close()


def test_views_have_the_columns_that_the_schema_lists(data):
    for view, channels in VIEWS.items():
        names = set(data.sql(f"SELECT * FROM {view} LIMIT 1").columns) - {"family"}
        assert names == {channel.name for channel in channels}, view


def test_the_schema_is_that_of_the_parquet_files(data, toy_dataset):
    assert list_columns()["ticks"][3] == {
        "name": "t_ns", "unit": "ns", "symbol": "t", "standard_name": "time",
        "description": "time since the start of the clip",
    }  # fmt: skip
    for table in ("clips", "pairs", "ticks", "frames"):
        for field in data.telemetry(table).schema:
            if field.name == "family":
                continue
            channel = CHANNELS_BY_NAME[field.name]
            assert field.metadata[b"description"].decode() == channel.description
            assert field.metadata.get(b"units", b"").decode() == channel.unit


@pytest.mark.parametrize("channel", ["speed", "pitch", "axle_load_f"])
def test_every_library_reads_the_same_numbers(data, toy_dataset, channel):
    clip = data.manifest["clips"][1]["clip_id"]
    path = toy_dataset.telemetry / "ticks" / "family=dry" / "part-0000.parquet"
    plain = pq.read_table(path, filters=[("clip_id", "==", clip)])[channel].to_numpy()
    lazy = data.telemetry("ticks").to_table(columns=["clip_id", channel])
    frame = data.pandas("ticks", ["clip_id", channel])
    relation = data.sql(f"SELECT {channel} FROM ticks WHERE clip_id = '{clip}' ORDER BY t_ns")
    assert len(plain) == 1001
    np.testing.assert_array_equal(lazy.to_pandas().query("clip_id == @clip")[channel], plain)
    np.testing.assert_array_equal(frame[frame.clip_id == clip][channel], plain)
    np.testing.assert_array_equal(relation.fetchnumpy()[channel], plain)


def test_polars_reads_the_same_table(data):
    pytest.importorskip("polars", reason="polars is optional")
    assert data.polars("clips")["tyre_peak"].to_list() == data.pandas("clips")["tyre_peak"].to_list()


def test_xarray_reads_frames_lazily_with_named_dimensions(data, toy_dataset):
    pytest.importorskip("xarray", reason="xarray is optional")
    picture = data.xarray()["rgb"].isel(clip=1, frame=3)
    assert picture.dims == ("y", "x", "channel")
    np.testing.assert_array_equal(picture.values, read_clip(toy_dataset.frames, 1, "rgb")[3])
    same = data.xarray()["rgb"].sel(clip="dry/hump").isel(frame=3)
    np.testing.assert_array_equal(same.values, picture.values)
    assert str(same.clip_id.values) == data.manifest["clips"][1]["clip_id"]
    assert (float(same.t), same.t.attrs["units"]) == (0.3, "s")
    assert data.xarray()["depth"].attrs["units"] == "m"


def test_the_time_of_a_frame_in_xarray_is_that_of_its_tick(toy_dataset, monkeypatch):
    pytest.importorskip("xarray", reason="xarray is optional")
    manifest = json.loads(toy_dataset.manifest.read_text())
    monkeypatch.setitem(manifest["grid"], "frame_rate_hz", 30)
    seconds = open_labelled_frames(toy_dataset, manifest)["t"].values
    assert seconds[:4].tolist() == [0.0, 0.033, 0.067, 0.1]


def test_xarray_by_itself_opens_the_frames_without_a_warning(toy_dataset, recwarn):
    """It looks for copies of the arrays' metadata in the group's first."""
    xarray = pytest.importorskip("xarray", reason="xarray is optional")
    assert xarray.open_zarr(toy_dataset.frames, chunks=None, decode_cf=False)["rgb"].shape == (
        4,
        11,
        64,
        96,
        3,
    )
    assert not [str(warning.message) for warning in recwarn if "consolidated" in str(warning.message)]


def test_the_schema_of_the_arrays_is_that_of_the_zarr_store(data):
    listed = {row["name"]: row for row in list_columns()["arrays"]}
    for name, array in data.frames.arrays():
        assert array.attrs["units"] == listed[name]["unit"]
        assert array.attrs["description"] == listed[name]["description"]
        assert list(array.metadata.dimension_names) == listed[name]["dimensions"]
        assert array.dtype == listed[name]["dtype"]


def test_the_python_of_the_analysts_page_runs_as_it_stands(data, toy_dataset, tmp_path):
    """But for the dataset's name, and for windows that fit the toy's 11 frames, all of them in quarantine."""
    pytest.importorskip("polars", reason="polars is optional")
    pytest.importorskip("xarray", reason="xarray is optional")
    page = (SOURCE_ROOT / "docs" / "how-to" / "query-a-dataset.md").read_text()
    blocks = re.findall(r"```python\n(.*?)```", page, flags=re.S)
    code = "\n".join(blocks).replace("datasets/demo", str(toy_dataset.root))
    code = code.replace("window=16, stride=8", "window=4, stride=4, quarantined=True")
    code = code.replace("picture(40)", "picture(5)").replace("clip.html", str(tmp_path / "clip.html"))
    code = code.replace("[3, 40]", "[3, 5]").replace("rain-50/flat-braking", "snow-3/flat")
    assert len(blocks) == 6
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=SOURCE_ROOT)
    assert done.returncode == 0, done.stderr


def test_what_is_not_represented_is_null_and_left_out_of_an_average(data, toy_dataset):
    """Two of the four clips never brake."""
    stored = pq.read_table(toy_dataset.telemetry / "clips.parquet")["brake_onset_s"]
    query = (
        "SELECT count(brake_onset_s) n, avg(brake_onset_s) mean, count(*) FILTER (brake_onset_s > 0.1) late"
        " FROM clips"
    )
    assert sorted(stored.to_pylist(), key=str) == [0.2, 0.2, None, None]
    assert query_dataset(str(toy_dataset.root), query)["rows"] == [{"n": 2, "mean": 0.2, "late": 2}]


def test_pairs_are_those_of_the_grid_and_join_with_clips(data):
    rows = data.sql(
        "SELECT p.control, p.tyre_peak_change - (b.tyre_peak - a.tyre_peak) AS off FROM pairs p"
        " JOIN clips a ON a.clip_id = p.clip_id_a JOIN clips b ON b.clip_id = p.clip_id_b"
    ).fetchall()
    assert sorted(control for control, _ in rows) == ["weather", "weather"]
    assert all(off == 0 for _, off in rows)


def test_a_query_that_is_no_sql_is_one_sentence_with_the_views(toy_dataset):
    with pytest.raises(InputError, match="views are clips, ticks, frames, verdicts, pairs"):
        query_dataset(str(toy_dataset.root), "SELECT nothing FROM nowhere")


@pytest.mark.parametrize(
    ("query", "told"),
    [
        ("SELECT stoping_distance FROM clips", r"clips: column 'stoping_distance': .* near it: stopping_distance, "),
        ("SELECT c.lable FROM clips c JOIN ticks USING (clip_id)", r"clips and ticks: column .* near it: label"),
        ("SELECT * EXCLUDE (wether) FROM frames", r"frames: column 'wether': .* near it: weather"),
        ("WITH t AS (SELECT 1 AS apple) SELECT appel FROM t", r"column 'appel': .* near it: apple"),
        ("SELECT speed FROM clips", r"column 'speed': .*; ticks and frames have this column"),
    ],
)  # fmt: skip
def test_a_wrong_column_in_sql_gets_the_names_that_come_near(data, toy_dataset, query, told):
    for ask in (data.sql, lambda query: query_dataset(str(toy_dataset.root), query)):
        with pytest.raises(InputError, match=told):
            ask(query)


def test_of_two_statements_none_is_answered_alone(data):
    with pytest.raises(InputError, match="must be one SQL statement; it holds 2"):
        data.sql("SELECT 1; SELECT 2")


def test_a_column_that_is_asked_for_twice_is_told(data):
    with pytest.raises(InputError, match="name each column once; speed stand"):
        data.torch(window=4, columns=["speed", "pitch", "speed"], arrays=[], quarantined=True)


def test_a_missing_table_is_told_with_what_to_do(toy_dataset, tmp_path):
    shutil.copytree(toy_dataset.root, tmp_path / "copy")
    (tmp_path / "copy" / "telemetry" / "pairs.parquet").unlink()
    with pytest.raises(InputError, match="files of pairs are missing: musync lab repair"):
        query_dataset(str(tmp_path / "copy"), "SELECT 1")


def test_a_question_needs_no_library_that_it_does_not_use_and_no_progress_bar_stands_among_its_answers(
    toy_dataset,
):
    """Of a program without a file, which may show such a bar."""
    seldom = {
        "torch",
        "numba",
        "zarr",
        "scipy",
        "flows.making.clip",
        "prefect",
        "dask",
        "plotly",
        "cv2",
        "matplotlib",
    }
    code = (
        f"import sys, musync; print(({seldom!r} | {{'pandas', 'jinja2'}}) & sys.modules.keys());"
        "asked = \"SELECT count(*), current_setting('enable_progress_bar') FROM ticks\";"
        "print(musync.open(sys.argv[1]).sql(asked).fetchall());"
        f"print({seldom!r} & sys.modules.keys())"
    )
    answer = subprocess.run(
        [sys.executable, "-c", code, toy_dataset.root], capture_output=True, text=True, check=True
    )
    assert answer.stdout.splitlines() == ["set()", "[(4004, False)]", "set()"]


def test_an_unknown_table_names_those_that_exist(data):
    with pytest.raises(InputError, match="there are clips, ticks, frames"):
        data.telemetry("rides")


def test_answers_are_json(toy_dataset):
    query = "SELECT *, [1.5, 'nan'::DOUBLE] AS l, DATE '2025-01-01' AS d FROM clips"
    row = json.loads(json.dumps(query_dataset(str(toy_dataset.root), query), allow_nan=False))["rows"][0]
    assert (row["d"], row["l"]) == ("2025-01-01", [1.5, None])


def test_windows_hold_consecutive_frames_and_their_telemetry(data, toy_dataset):
    windows = data.torch(
        window=4, stride=3, columns=["speed", "pitch"], arrays=["rgb", "depth"], quarantined=True
    )
    assert len(windows) == 4 * 3
    sample = windows[3 + 1]
    assert (sample["clip"], sample["start"]) == (1, 3)
    np.testing.assert_array_equal(sample["rgb"], read_clip(toy_dataset.frames, 1, "rgb")[3:7])
    rows = data.sql("SELECT f.speed, f.pitch FROM frames f JOIN clips c USING (clip_id)"
                    " WHERE c.index = 1 AND frame BETWEEN 3 AND 6 ORDER BY frame").fetchall()  # fmt: skip
    np.testing.assert_array_equal(sample["telemetry"], np.array(rows, np.float32))


def test_workers_give_the_same_batches_in_the_seeds_order(data):
    windows = data.torch(window=5, columns=["speed"], quarantined=True)

    def batches(workers: int, seed: int, epoch: int = 0) -> list:
        order = musync.SeededOrder(len(windows), seed)
        order.set_epoch(epoch)
        loader = DataLoader(windows, batch_size=2, sampler=order, num_workers=workers)
        return [(b["clip"].tolist(), b["start"].tolist(), int(b["rgb"].sum())) for b in loader]

    alone = batches(0, seed=7)
    assert batches(2, seed=7) == alone
    assert batches(0, seed=8) != alone and batches(0, seed=7, epoch=1) != alone
    assert sorted(c for clips, _, _ in alone for c in clips) == [0, 0, 1, 1, 2, 2, 3, 3]
    assert not all(a <= b for a, b in pairwise(c for clips, _, _ in alone for c in clips))


def test_clips_in_quarantine_are_left_out_and_named_unless_asked_for(data):
    data = with_verdicts(data, [False, True, False, False])
    clips = data.manifest["clips"]
    failed = tuple(clip["label"] for clip in clips if not clip["verdict"]["passed"])
    assert len(failed) == 3
    with pytest.warns(UserWarning, match="3 of 4 clips are in quarantine") as told:
        windows = data.torch(window=5, columns=["speed"])
    assert windows.clips == (1,) and windows.left_out == failed
    assert all(label in str(told[0].message) for label in failed)
    assert data.torch(window=5, columns=["speed"], quarantined=True).clips == (0, 1, 2, 3)
    assert data.torch(window=5, columns=["speed"], clips=failed[:1]).clips == (0,)
    alone = data.torch(
        window=5, columns="speed", arrays="rgb", clips=failed[0]
    )  # a name by itself is one name
    assert (alone.clips, alone.columns, alone.arrays) == ((0,), ("speed",), ("rgb",))
    with pytest.raises(InputError) as caught:
        data.torch(window=5, stride=0, clips=[])
    assert [problem.partition(" must")[0] for problem in caught.value.problems] == ["stride", "clips:"]


def with_verdicts(data, verdicts):
    """The dataset as if the pose check of each clip had said so; one second of a toy street is too little for it."""
    clips = copy.deepcopy(data.manifest["clips"])
    for clip, passed in zip(clips, verdicts, strict=True):
        clip["verdict"]["passed"] = passed
    data, manifest = replace(data), data.manifest | {"clips": clips}
    vars(data)["manifest"] = manifest
    return data


def test_a_dataset_all_in_quarantine_is_no_training_set(data):
    data = with_verdicts(data, [False] * 4)
    with pytest.raises(InputError, match="every clip is in quarantine"):
        data.torch(window=5, columns=["speed"])


def test_wrong_arguments_of_windows_are_listed_all_at_once(data):
    with pytest.raises(InputError) as caught:
        data.torch(window=99, stride=-1, columns=["colour", "label"], arrays=["sound"], clips=["moon"])
    assert len(caught.value.problems) == 6


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ({"window": 2.5}, "window must be a whole number in 1 to the 11 frames of a clip; it is 2.5"),
        ({"window": "4"}, "window must be a whole number in 1 to the 11 frames of a clip; it is '4'"),
        ({"window": True}, "window must be a whole number in 1 to the 11 frames of a clip; it is True"),
        ({"window": 4, "stride": 1.5}, "stride must be a whole number of 1 or more; it is 1.5"),
        ({"window": 4, "columns": None}, "columns must be a name or a list of names; it is None"),
        ({"window": 4, "clips": 3}, "clips must be a name or a list of names; it is 3"),
        ({"window": 4, "clips": [["dry/flat"]]}, r"clips must be a name or a list of names; it is \[\['dry/flat"),
    ],
)  # fmt: skip
def test_windows_of_half_a_frame_and_names_that_are_none_are_one_sentence(data, arguments, told):
    with pytest.raises(InputError, match=told):
        data.torch(**{"columns": ["speed"], "quarantined": True} | arguments)


def test_an_order_and_a_picture_need_whole_numbers(data):
    for length, seed, told in ((10.5, 1, "length"), (10, 1.5, "seed"), (10, -1, "seed"), (-1, 1, "length")):
        with pytest.raises(InputError, match=f"{told} must be a whole number of 0 or more; it is"):
            musync.SeededOrder(length, seed=seed)
    with pytest.raises(InputError, match=r"frame 1\.5: must be one of the 11 frames"):
        data["dry/flat"].picture(1.5)


def test_every_tick_channel_is_a_column(data):
    assert {c.name for c in TICK_CHANNELS} <= set(data.telemetry("ticks").schema.names)
