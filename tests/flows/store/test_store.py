import os
from threading import get_native_id

import numpy as np
import pyarrow.parquet as pq
import pytest
import zarr

from flows.store.arrays import ARRAYS, EVERY_ARRAY
from flows.store.frames import buffer_hash, create_arrays, read_clip, write_clip
from flows.store.layout import PARTIAL, Layout, write_atomically, write_json
from flows.store.staging import partial_files
from flows.store.telemetry import columns_hash, labelled_table, read_columns, write_parquet
from tasks.conventions import CHANNELS_BY_NAME, TICK_CHANNELS, SemanticClass
from tasks.render.labels import MARK_BITS

SHAPE = (3, 16, 24)


@pytest.fixture
def layout(tmp_path):
    layout = Layout(tmp_path / "dataset")
    create_arrays(layout.frames, (4, *SHAPE), False, {"camera": "test"})
    return layout


def buffers(seed: int) -> dict[str, np.ndarray]:
    draw = np.random.default_rng(seed)
    return {
        "rgb": draw.integers(0, 256, (*SHAPE, 3), np.uint8),
        "depth": np.where(draw.random(SHAPE) < 0.1, np.nan, draw.random(SHAPE)).astype(np.float32),
        "class": draw.integers(0, 11, SHAPE, np.uint8),
    }


def test_a_clip_reads_back_bit_for_bit_from_one_file_an_array(layout):
    written = buffers(1)
    write_clip(layout.frames, 2, written)
    for name in ARRAYS:
        np.testing.assert_array_equal(read_clip(layout.frames, 2, name), written[name])
        assert layout.frame_shard(name, 2).is_file()
        assert sum(f.is_file() for f in (layout.frames / name / "c").rglob("*")) == 1


def test_the_same_pixels_give_the_same_bytes(layout, tmp_path):
    other = Layout(tmp_path / "other")
    create_arrays(other.frames, (4, *SHAPE), False, {"camera": "test"})
    for index in (0, 2):
        write_clip(layout.frames, index, buffers(1))
    for index in (2, 0):
        write_clip(other.frames, index, buffers(1))
    for name in ARRAYS:
        shards = {d.frame_shard(name, i).read_bytes() for d in (layout, other) for i in (0, 2)}
        assert len(shards) == 1


@pytest.mark.parametrize("name", ARRAYS)
def test_a_flipped_bit_in_a_shard_is_an_error_and_not_a_picture(layout, name):
    write_clip(layout.frames, 0, buffers(1))
    shard = layout.frame_shard(name, 0)
    content = bytearray(shard.read_bytes())
    content[len(content) // 3] ^= 4
    shard.write_bytes(content)
    with pytest.raises(Exception, match=r"(?i)checksum|crc"):
        read_clip(layout.frames, 0, name)


def test_arrays_say_their_dimensions_and_camera(layout):
    group = zarr.open_group(layout.frames, mode="r")
    assert group.attrs["camera"] == "test"
    assert group["rgb"].metadata.dimension_names == ("clip", "frame", "y", "x", "channel")
    assert group["rgb"].chunks == (1, 1, 16, 24, 3)


def test_arrays_carry_unit_and_meaning_and_the_names_of_their_codes(tmp_path):
    create_arrays(tmp_path / "frames", (1, *SHAPE), True, {}, objects=True)
    group = zarr.open_group(tmp_path / "frames", mode="r")
    assert {name: array.attrs["units"] for name, array in group.arrays()} == {
        "rgb": "1", "depth": "m", "class": "1", "instance": "1", "normal": "1", "road": "m", "flow": "px", "marks": "1",
    }  # fmt: skip
    for name, array in EVERY_ARRAY.items():
        assert group[name].attrs["long_name"] == group[name].attrs["description"] == array.channel.description
    codes = dict(
        zip(group["class"].attrs["flag_meanings"].split(), group["class"].attrs["flag_values"], strict=True)
    )
    assert codes["sky"] == SemanticClass.SKY and codes["terrain"] == SemanticClass.TERRAIN
    assert len(codes) == len(SemanticClass)
    marks = group["marks"].attrs
    assert dict(zip(marks["flag_meanings"].split(), marks["flag_masks"], strict=True)) == MARK_BITS


def test_hash_of_a_buffer_sees_values_type_and_shape():
    zeros = np.zeros((2, 3), np.uint8)
    assert (
        len(
            {
                buffer_hash(zeros),
                buffer_hash(zeros.T),
                buffer_hash(zeros.view(np.int8)),
                buffer_hash(zeros + 1),
            }
        )
        == 4
    )


def columns() -> dict[str, np.ndarray]:
    return {
        "t_ns": np.arange(5) * 1_000_000,
        "speed": np.linspace(16.7, 0.1, 5),
        "contact_f": np.ones(5, bool),
        "T_world_rig": np.arange(80.0).reshape(5, 16),
    }


def test_parquet_keeps_every_bit_and_selects_one_clip(tmp_path):
    import pyarrow as pa

    path = tmp_path / "ticks.parquet"
    shifted = columns() | {"speed": columns()["speed"] + 1}
    tables = [labelled_table(columns(), {"clip_id": "a"}), labelled_table(shifted, {"clip_id": "b"})]
    write_parquet(pa.concat_tables(tables).unify_dictionaries(), path)
    back = read_columns(path, "b", most=5)
    for name, values in shifted.items():
        np.testing.assert_array_equal(back[name], values)
    assert columns_hash(back, columns()) == columns_hash(shifted, columns())
    assert columns_hash(back, columns()) != columns_hash(columns(), columns())


def test_parquet_fields_carry_unit_symbol_and_description(tmp_path):
    write_parquet(labelled_table(columns()), tmp_path / "t.parquet")
    field = pq.read_schema(tmp_path / "t.parquet").field("speed")
    assert field.metadata[b"units"] == b"m s-1"
    assert field.metadata[b"symbol"] == b"v"
    assert field.metadata[b"standard_name"] == b"platform_speed_wrt_ground"


def test_channel_names_are_unique_and_described():
    assert len({c.name for c in TICK_CHANNELS}) == len(TICK_CHANNELS)
    assert all(c.description for c in CHANNELS_BY_NAME.values())
    texts = {
        "clip_id",
        "label",
        "seed",
        "weather",
        "split",
        "calibration",
        "calibration_extrapolated",
        "hold_speed",
        "quarantined",
        "check_method",
        "check_passed",
    }
    texts |= {
        "clip_id_a",
        "clip_id_b",
        "label_a",
        "label_b",
        "control",
        "differs",
        "variant",
        "scene",
        "kind",
        "collided",
        "sky",
        "falling",
    }
    assert {c.name for c in CHANNELS_BY_NAME.values() if not c.unit} == texts, "every number has a unit"


def test_a_failed_write_leaves_the_old_file_and_no_partial_one(tmp_path, monkeypatch):
    target = tmp_path / "receipt.json"
    write_json(target, {"a": 1})
    before = target.read_bytes()

    def full(_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    with pytest.raises(OSError, match="No space"):
        write_atomically(target, b"new")
    assert target.read_bytes() == before
    assert list(tmp_path.iterdir()) == [target]


def test_left_overs_of_a_killed_writer_are_known_by_their_name_and_nothing_else_is(layout):
    write_clip(layout.frames, 0, buffers(1))
    half = layout.root / f"manifest.json.77{PARTIAL}"
    half.touch()
    (layout.root / "thesis.partial.tex").touch()
    assert partial_files(layout) == [half]


def test_a_link_in_place_of_a_half_written_file_is_not_followed(tmp_path):
    """A stranger who knows the name of the next half-written file cannot have another file overwritten."""
    victim = tmp_path / "victim"
    victim.write_text("precious")
    (tmp_path / f"a.json.{os.getpid()}-{get_native_id()}{PARTIAL}").symlink_to(victim)
    write_json(tmp_path / "a.json", {})
    assert victim.read_text() == "precious" and not (tmp_path / "a.json").is_symlink()
