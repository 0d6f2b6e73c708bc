"""LeRobot v3: its reader, where it is installed, and the published layout read by pyarrow give back every value."""

import json

import av
import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest

from flows.exporting import dataset
from flows.exporting.export import export_dataset
from flows.exporting.lerobot import CAMERA, NO_STATE, describe_splits, sort_by_split
from flows.exporting.running_statistics import RunningStatistics
from tasks.conventions import TICK_CHANNELS
from tasks.errors import InputError
from tests.flows.exporting.conftest import BRAKING, HUMP

STATE_COLUMNS = [channel.name for channel in TICK_CHANNELS if channel.name not in NO_STATE]


def test_the_layout_of_version_3_holds_every_value(export, stored):
    folder = export("lerobot")
    info = json.loads((folder / "meta/info.json").read_text())
    assert (info["codebase_version"], info["fps"], info["total_episodes"], info["total_frames"]) == (
        "v3.0",
        10,
        2,
        22,
    )
    episodes = pd.read_parquet(folder / "meta/episodes/chunk-000/file-000.parquet")
    tasks = pd.read_parquet(folder / "meta/tasks.parquet")
    assert tasks.index.tolist() == [BRAKING, HUMP]
    for number, label in enumerate((BRAKING, HUMP)):
        episode, clip = episodes.iloc[number], stored[label]
        place = {"chunk_index": episode["data/chunk_index"], "file_index": episode["data/file_index"]}
        rows = pq.read_table(folder / info["data_path"].format(**place)).to_pandas()
        assert rows["index"].tolist() == list(
            range(episode["dataset_from_index"], episode["dataset_to_index"])
        )
        state = np.stack(rows["observation.state"])
        for k, name in enumerate(STATE_COLUMNS):
            np.testing.assert_array_equal(state[:, k], clip.frames[name].astype(np.float32), name)
        np.testing.assert_array_equal(np.stack(rows["observation.pose"]).reshape(-1, 4, 4), clip.T_world_rig)
        np.testing.assert_array_equal(rows["action"], clip.frames["brake_pressure_mpa"].astype(np.float32))
        np.testing.assert_array_equal(rows["timestamp"], (clip.frames["t_ns"] / 1e9).astype(np.float32))
        with av.open(str(folder / info["video_path"].format(video_key=CAMERA, **place))) as film:
            shown = np.stack([frame.to_ndarray(format="rgb24") for frame in film.decode(video=0)])
        assert shown.shape == clip.pixels["rgb"].shape
        assert np.abs(shown.astype(int) - clip.pixels["rgb"]).mean() < 4  # H.264 loses a little
    pitch = STATE_COLUMNS.index("pitch")
    assert info["features"]["observation.state"]["names"][pitch] == "pitch"
    assert (
        np.stack(pq.read_table(folder / "data/chunk-000/file-000.parquet")["observation.state"].to_pylist())[
            -1
        ][pitch]
        > 0.001
    )


def test_episodes_stand_in_the_order_of_splits_and_each_split_has_its_range():
    rows = [
        {"label": label, "split": split}
        for label, split in zip("abcde", ("val", "train", "val", "test", "train"), strict=True)
    ]
    ordered = sort_by_split(rows)
    assert [row["label"] for row in ordered] == ["a", "c", "b", "e", "d"]
    assert describe_splits(ordered) == {"val": "0:2", "train": "2:4", "test": "4:5"}


@pytest.fixture
def traced(monkeypatch) -> set[str]:
    """Names of columns that every clip is made not to know, as those of a reference trace."""
    unknown: set[str] = set()
    read = dataset.ExportedClip._read

    def read_less(clip, *asked):
        columns = read(clip, *asked)
        return columns | {name: np.full(len(columns[name]), np.nan) for name in unknown}

    monkeypatch.setattr(dataset.ExportedClip, "_read", read_less)
    return unknown


def test_a_column_that_a_trace_does_not_hold_is_no_part_of_the_state(traced, toy_dataset, tmp_path):
    traced |= {"wheel_speed_f", "road_height_r"}
    export_dataset(str(toy_dataset.root), "lerobot", out=str(tmp_path / "out"), clips=[BRAKING])
    feature = json.loads((tmp_path / "out/meta/info.json").read_text())["features"]["observation.state"]
    known = [name for name in STATE_COLUMNS if name not in traced]
    assert (feature["names"], feature["shape"]) == (known, [len(known)])
    state = pq.read_table(tmp_path / "out/data/chunk-000/file-000.parquet")["observation.state"].to_pylist()
    assert np.isfinite(state).all() and np.shape(state) == (11, len(known))


def test_a_trace_without_brake_pressure_has_no_action_and_is_refused(traced, toy_dataset, tmp_path):
    traced.add("brake_pressure_mpa")
    with pytest.raises(InputError, match="the brake pressure as the action"):
        export_dataset(str(toy_dataset.root), "lerobot", out=str(tmp_path / "out"), clips=[BRAKING])


def test_statistics_that_are_added_in_blocks_are_those_of_all_values():
    draw = np.random.default_rng(1)
    values = draw.normal(3, 2, (100, 2))
    blocks = RunningStatistics()
    for part in (values[:1], values[1:60], values[60:]):
        blocks.add("a", part)
    told = blocks.summarise()["a"]
    np.testing.assert_allclose(told["mean"], np.mean(values, axis=0))
    np.testing.assert_allclose(told["std"], np.std(values, axis=0))
    np.testing.assert_array_equal(told["min"], np.min(values, axis=0))
    np.testing.assert_array_equal(told["max"], np.max(values, axis=0))
    assert told["count"] == [100]


def test_lerobot_s_own_reader_opens_it(export, stored, monkeypatch):
    monkeypatch.setenv("HF_HUB_OFFLINE", "1")
    module = pytest.importorskip("lerobot.datasets.lerobot_dataset", reason="pip install lerobot")
    read = module.LeRobotDataset("musync/toy", root=export("lerobot"), video_backend="pyav")
    assert (len(read), read.fps, read.num_episodes) == (22, 10, 2)
    rows = read.hf_dataset[:]
    for k, name in enumerate(STATE_COLUMNS):
        there = [float(row[k]) for row in rows["observation.state"]]
        both = pd.concat([stored[label].frames[name] for label in (BRAKING, HUMP)]).astype(np.float32)
        np.testing.assert_array_equal(there, both, name)
    assert read.meta.tasks.index.tolist() == [BRAKING, HUMP]
    assert read.meta.stats[CAMERA]["mean"].shape == (3, 1, 1)
    assert read.meta.get_video_file_path(1, CAMERA).name == "file-001.mp4"
