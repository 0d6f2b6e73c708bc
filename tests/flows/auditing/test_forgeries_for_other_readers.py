"""What a reader other than ours would be told by a forged file is found without making a clip again, and named."""

import shutil

import numpy as np
import pyarrow as pa
import pytest

from flows.auditing.audit import audit_dataset
from flows.auditing.verify import verify_dataset
from flows.store.layout import Layout
from tests.flows.auditing.forging import (
    CLIPS,
    FRAMES,
    OURS,
    PAIRS,
    SHEET,
    TICKS,
    Forge,
    add_file,
    and_record,
    append,
    change_attributes,
    change_clip,
    change_json,
    change_labels,
    change_table,
    change_values,
    exchange,
    forge_footer,
    name_rows,
    swap_shards,
    two_rows_exchanged,
    write_otherwise,
)
from tests.flows.reseal import reseal

FORGERIES: dict[str, tuple[Forge, str, str]] = {
    "statistics of a footer": (
        forge_footer(TICKS, "speed", 1.0),
        TICKS,
        "max of column speed in row group 0 must be",
    ),
    "units of a column": (
        change_labels(TICKS, "speed", units="km h-1"),
        TICKS,
        "units of column speed must be m s-1",
    ),
    "fill value of an array": (
        change_json("frames.zarr/depth/zarr.json", lambda v: v.update(fill_value=0.0)),
        "frames.zarr/depth/zarr.json",
        "fill_value must be NaN",
    ),
    "codec of an array": (
        change_json(
            "frames.zarr/rgb/zarr.json",
            lambda v: v["codecs"][0]["configuration"]["codecs"][1]["configuration"].update(clevel=9),
        ),
        "frames.zarr/rgb/zarr.json",
        "clevel must be 1",
    ),
    "camera matrix": (
        change_attributes("frames.zarr/zarr.json", K=[[99.0, 0, 48], [0, 99.0, 32], [0, 0, 1]]),
        "frames.zarr/zarr.json",
        "attributes.K.0.0 must be 80.0",
    ),
    "grid": (
        change_json("inputs/grid.json", lambda v: v.update(vehicle_mode="coupled")),
        "inputs/grid.json",
        "vehicle_mode must be paper",
    ),
    "preview": (append(SHEET, b"more"), SHEET, "must have the bytes"),
    "figures of a receipt": (
        change_clip(lambda c: c["figures"].update(peak_pitch=0.5)),
        TICKS,
        "peak_pitch of clip dry/flat must be 0.5",
    ),
    "more rows": (
        change_table(TICKS, lambda t: pa.concat_tables([t, t.slice(len(t) - 1)]).combine_chunks()),
        TICKS,
        "must have at most 2,002 rows; it has 2,003",
    ),
    "one more column": (
        change_table(TICKS, lambda t: t.append_column("friction_true", t["speed"])),
        TICKS,
        "must have no column friction_true",
    ),
    "order of rows": (change_table(TICKS, two_rows_exchanged), TICKS, "t_ns of clip dry/flat must count"),
    "compression": (
        write_otherwise(TICKS, compression="snappy", use_dictionary=["clip_id", "label", "weather"]),
        TICKS,
        "its compression must be ZSTD",
    ),
    "one more file among the data": (
        add_file("telemetry/more.parquet", recorded=False),
        "telemetry/more.parquet",
        "not recorded",
    ),
    "clip_id of two clips exchanged": (change_table(TICKS, exchange("clip_id")), TICKS, "in order"),
    "boundary of a row group": (
        write_otherwise(TICKS, row_group_size=500, **OURS),
        TICKS,
        "rows of its row groups must be",
    ),
    "type of a column": (
        change_values(TICKS, "contact_f", lambda v: v.astype(np.int8)),
        TICKS,
        "hash that manifest.json records",
    ),
    "metadata of a file": (
        change_table(FRAMES, lambda t: t.replace_schema_metadata({"pandas": "{}"})),
        FRAMES,
        "it carries {b'pandas': b'{}'}",
    ),
    "order of columns": (
        change_table(CLIPS, lambda t: t.select(t.column_names[::-1])),
        CLIPS,
        "its columns must be",
    ),
    "label of rows": (name_rows(TICKS, "label", "dry/hump"), TICKS, "label in row 0 must be dry/flat"),
    "figure in a table": (
        change_values(FRAMES, "tyre_peak", lambda v: v / 2),
        FRAMES,
        "tyre_peak in row 0 must be",
    ),
    "speed of frames": (
        and_record(change_values(FRAMES, "speed", lambda v: v * 2)),
        TICKS,
        "speed of clip dry/flat must be, at the ticks",
    ),
    "clock": (
        and_record(change_values(TICKS, "t_ns", lambda v: v * 2)),
        TICKS,
        "t_ns of clip dry/flat must count",
    ),
    "index of pages": (
        write_otherwise(TICKS, write_page_index=True, **OURS),
        TICKS,
        "presence of an index of pages",
    ),
    "bytes of a table without other values": (
        write_otherwise(FRAMES, **{**OURS, "compression_level": 9}),
        FRAMES,
        "must ",
    ),
    "one more attribute": (
        change_attributes("frames.zarr/zarr.json", licence="none"),
        "frames.zarr/zarr.json",
        "attributes.licence must be absent",
    ),
    "names of dimensions": (
        change_json(
            "frames.zarr/rgb/zarr.json",
            lambda v: v.update(dimension_names=["clip", "frame", "x", "y", "channel"]),
        ),
        "frames.zarr/rgb/zarr.json",
        "dimension_names.2 must be y",
    ),
    "copies of metadata taken out": (
        change_json("frames.zarr/zarr.json", lambda v: v.pop("consolidated_metadata")),
        "frames.zarr/zarr.json",
        "consolidated_metadata",
    ),
    "plan in another form": (
        change_json("plan.json", lambda v: None, indent=None),
        "plan.json",
        "must have the bytes",
    ),
    "one more preview": (
        add_file("previews/more.png", recorded=True),
        "manifest.json",
        "previews/more.png is recorded",
    ),
    "label of a clip": (
        change_clip(lambda c: c.update(label="dry/level"), plan=True),
        "manifest.json",
        "clip 0 must have a label of its grid",
    ),
    "split of a clip": (
        change_clip(lambda c: c.update(split="test"), plan=True),
        "manifest.json",
        "split of clip dry/flat must be",
    ),
    "seed of a clip": (
        change_clip(lambda c: c.update(seed="7"), plan=True),
        "manifest.json",
        "seed of clip dry/flat must be",
    ),
    "verdict of a clip": (
        change_clip(lambda c: c["verdict"].update(passed=True)),
        "manifest.json",
        "verdict.passed of clip dry/flat",
    ),
    "shards of two clips exchanged": (
        lambda layout: reseal(layout, swap_shards),
        "manifest.json",
        "must be a file of clip",
    ),
    "content of more arrays": (
        lambda layout: reseal(layout, lambda m: m["clips"][0]["content"].update(normal="0" * 64)),
        "manifest.json",
        "normal is one more",
    ),
    "one more pair": (
        change_table(
            PAIRS, lambda t: pa.concat_tables([t, t.slice(0, 1)]).unify_dictionaries().combine_chunks()
        ),
        PAIRS,
        "must have at most 2 rows; it has 3",
    ),
}


@pytest.mark.parametrize("kind", FORGERIES)
def test_a_forgery_that_another_reader_would_believe_is_named_without_a_clip_made_again(
    kind, toy_dataset, tmp_path
):
    forge, path, told = FORGERIES[kind]
    layout = Layout(tmp_path / "copy")
    shutil.copytree(toy_dataset.root, layout.root)
    forge(layout)
    reseal(layout)
    result = audit_dataset(str(layout.root), share=0.0, out=str(tmp_path / "told"))
    found = [*result["contradictions"], *(f"{row['path']}: {row['damage']}" for row in result["damaged"])]
    assert not result["verified"]
    assert [sentence for sentence in found if sentence.startswith(f"{path}: ") and told in sentence], found
    text = (tmp_path / "told" / "audit.txt").read_text()
    assert path in text and "what to do: " in text
    if told != "not recorded":
        assert verify_dataset(str(layout.root))["verified"]
