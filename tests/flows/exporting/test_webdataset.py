"""WebDataset's own reader gives back every value."""

import numpy as np
import pytest

from tasks.conventions import TICK_CHANNELS
from tests.flows.exporting.conftest import BRAKING, HUMP

wds = pytest.importorskip("webdataset", reason="pip install webdataset")


def test_the_reader_gives_back_pictures_labels_telemetry_and_poses(export, stored):
    shards = sorted(map(str, export("webdataset").glob("*.tar")))
    samples = list(wds.WebDataset(shards, shardshuffle=False, empty_check=False).decode("rgb8"))
    assert len(samples) == 22
    for number, sample in enumerate(samples):
        clip, frame = stored[(BRAKING, HUMP)[number // 11]], number % 11
        assert sample["__key__"] == f"{clip.clip_id}_{frame:06d}"
        assert (sample["json"]["label"], sample["json"]["clip_id"]) == (clip.label, clip.clip_id)
        assert sample["json"]["split"] == ""  # as the clips table: the toy grid names none
        np.testing.assert_array_equal(sample["rgb.png"], clip.pixels["rgb"][frame])
        for name in ("depth", "class"):
            np.testing.assert_array_equal(sample["arrays.npz"][name], clip.pixels[name][frame])
        row = clip.frames.iloc[frame]
        told = sample["json"]["telemetry"]
        assert told == {c.name: row[c.name] for c in TICK_CHANNELS} | {"frame": frame, "tick": row["tick"]}
        assert sample["json"]["T_world_rig"] == clip.T_world_rig[frame].tolist()
    braked = samples[10]["json"]
    assert braked["telemetry"]["pitch"] > 0.001  # nose down
    assert braked["T_world_rig"][2][0] < 0  # and the rig's forward axis points below the horizon
    assert braked["telemetry"]["t_ns"] == 1_000_000_000


def test_equal_datasets_give_equal_bytes(export, toy_dataset, tmp_path):
    from flows.exporting.export import export_dataset

    export_dataset(str(toy_dataset.root), "webdataset", out=str(tmp_path / "again"), clips=[BRAKING])
    shard = "clip-00000.tar"
    assert (tmp_path / "again" / shard).read_bytes() == (export("webdataset") / shard).read_bytes()
