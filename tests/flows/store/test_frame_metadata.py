"""The frames' Zarr metadata: what muSync writes is read, and anything else refused before Zarr sees it."""

import json
import shutil

import pytest
import zarr

import musync
from flows.store.frame_metadata import check_array, check_frames, read_local_metadata
from flows.store.layout import Layout
from tasks.errors import InputError


@pytest.fixture
def copy(toy_dataset, tmp_path) -> Layout:
    shutil.copytree(toy_dataset.root, tmp_path / "copy")
    return Layout(tmp_path / "copy")


def edit(layout: Layout, member: str, change) -> None:
    path = layout.frames / member / "zarr.json"
    metadata = json.loads(path.read_text())
    change(metadata)
    path.write_text(json.dumps(metadata))


def shard(metadata: dict) -> dict:
    return metadata["codecs"][0]["configuration"]


def test_what_is_written_is_accepted_and_its_shapes_are_told(toy_dataset):
    read = read_local_metadata(toy_dataset.frames)
    shapes = check_frames(read, ["rgb", "depth", "class"], toy_dataset.frames, 4, 11)
    assert shapes == {"rgb": (4, 11, 64, 96, 3), "depth": (4, 11, 64, 96), "class": (4, 11, 64, 96)}


ODD = {
    "codec of pickles": lambda m: shard(m)["codecs"].append({"name": "numcodecs.pickle"}),
    "pickle in place of blosc": lambda m: shard(m)["codecs"][1].update(name="pickle"),
    "codec without a shard": lambda m: m.update(codecs=[{"name": "bytes"}, {"name": "numcodecs.pickle"}]),
    "codec of the index": lambda m: shard(m)["index_codecs"].append({"name": "gzip"}),
    "no checksum": lambda m: shard(m)["codecs"].pop(),
    "other compressor": lambda m: shard(m)["codecs"][1]["configuration"].update(cname="lz4"),
    "setting of a codec": lambda m: shard(m)["codecs"][1]["configuration"].update(callback="os.system"),
    "codec that is text": lambda m: m.update(codecs="pickle"),
    "store transformer": lambda m: m.update(
        storage_transformers=[{"name": "reference", "url": "file:///etc"}]
    ),
    "further key": lambda m: m.update(reference="file:///etc/passwd"),
    "keys of chunks that climb": lambda m: m.update(chunk_key_encoding={"name": "../../default"}),
    "Python objects": lambda m: m.update(data_type="object"),
    "Zarr 2": lambda m: m.update(zarr_format=2),
    "group": lambda m: m.update(node_type="group"),
    "huge picture": lambda m: m["shape"].__setitem__(slice(2, 4), [10**6, 10**6]),
    "huge clip": lambda m: m["shape"].__setitem__(1, 10**9),
    "no pictures": lambda m: m["shape"].__setitem__(2, 0),
    "negative shape": lambda m: m["shape"].__setitem__(0, -4),
    "shape of text": lambda m: m.update(shape="4, 11"),
    "one clip too many": lambda m: m["shape"].__setitem__(0, 5),
    "chunks of another shape": lambda m: shard(m).update(chunk_shape=[1, 1, 1, 1, 3]),
}


@pytest.mark.parametrize("oddity", ODD)
def test_metadata_that_musync_does_not_write_are_refused(copy, oddity):
    edit(copy, "rgb", ODD[oddity])
    with pytest.raises(InputError, match="rgb"):
        check_frames(read_local_metadata(copy.frames), ["rgb"], copy.frames, 4, 11)
    with pytest.raises(InputError, match="rgb"):
        _ = musync.open(copy.root).frames
    with pytest.raises(InputError, match="rgb"):
        musync.open(copy.root).torch(window=4, quarantined=True)


def test_every_fault_of_an_array_is_told_at_once(copy):
    edit(copy, "rgb", lambda m: m.update(zarr_format=2, data_type="object", codecs=[]))
    with pytest.raises(InputError) as caught:
        check_array(read_local_metadata(copy.frames), "rgb", copy.frames)
    assert len(caught.value.problems) == 3


def test_a_group_copies_the_metadata_of_all_its_arrays_for_readers_that_look_there_first(toy_dataset):
    group = json.loads((toy_dataset.frames / "zarr.json").read_text())
    copies = group["consolidated_metadata"]["metadata"]
    assert copies.keys() == {"rgb", "depth", "class"}
    for name, metadata in copies.items():
        assert metadata == json.loads((toy_dataset.frames / name / "zarr.json").read_text())
    group = zarr.open_group(toy_dataset.frames, mode="r", use_consolidated=True)
    assert group["rgb"].shape == (4, 11, 64, 96, 3)


def test_a_dataset_of_an_earlier_version_has_no_copies_and_is_read(copy):
    edit(copy, "", lambda m: m.pop("consolidated_metadata"))
    assert musync.open(copy.root).frames["rgb"].shape == (4, 11, 64, 96, 3)


COPIED = {
    "a codec of pickles": lambda c: shard(c["metadata"]["rgb"])["codecs"].append(
        {"name": "numcodecs.pickle"}
    ),
    "another array": lambda c: c["metadata"].update(evil=c["metadata"]["rgb"]),
    "an array above": lambda c: c["metadata"].update({"../class": c["metadata"]["class"]}),
    "an array that is not there": lambda c: c["metadata"].update(flow=c["metadata"]["rgb"]),
    "one array less": lambda c: c["metadata"].pop("rgb"),
    "another kind": lambda c: c.update(kind="reference"),
    "one more key": lambda c: c.update(url="file:///etc/passwd"),
    "a list": lambda c: c.update(metadata=[]),
}


@pytest.mark.parametrize("oddity", COPIED)
def test_copies_that_differ_from_the_arrays_are_refused(copy, oddity):
    edit(copy, "", lambda m: COPIED[oddity](m["consolidated_metadata"]))
    with pytest.raises(InputError, match="copies of the arrays' metadata must be equal to these"):
        _ = musync.open(copy.root).frames


def test_a_group_holds_its_arrays_and_no_other_copies_of_their_metadata(copy):
    metadata = json.loads((copy.frames / "rgb" / "zarr.json").read_text())
    edit(
        copy, "", lambda m: m.update(consolidated_metadata={"kind": "inline", "metadata": {"rgb": metadata}})
    )
    shutil.copytree(copy.frames / "class", copy.frames / "evil")
    (copy.frames / "depth" / "zarr.json").unlink()
    with pytest.raises(InputError) as caught:
        _ = musync.open(copy.root).frames
    told = "\n".join(caught.value.problems)
    assert len(caught.value.problems) == 3
    assert (
        "must be equal to these and hold nothing else" in told
        and "evil" in told
        and "depth/zarr.json: missing" in told
    )


@pytest.mark.parametrize(
    "content", [b"", b"\xff\xfe", b"[" * 100_000, b"[]", b'{"shape": NaN}', b'{"a": 1, "a": 2}']
)
def test_metadata_that_are_no_json_table_are_one_sentence(copy, content):
    for member in ("", "rgb"):
        (copy.frames / member / "zarr.json").write_bytes(content)
    with pytest.raises(InputError) as caught:
        _ = musync.open(copy.root).frames
    assert len(caught.value.problems) == 2


def test_a_damaged_picture_is_told_with_what_to_do(copy):
    path = copy.frame_shard("rgb", 1)
    content = bytearray(path.read_bytes())
    content[100] ^= 1
    path.write_bytes(content)
    windows = musync.open(copy.root).torch(window=11, columns=[], quarantined=True)
    assert windows[0]["rgb"].shape == (11, 64, 96, 3)
    with pytest.raises(InputError, match=r"clip 1: cannot be read.*musync lab repair"):
        windows[1]
