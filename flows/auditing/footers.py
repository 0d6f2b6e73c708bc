"""What a Parquet file says of itself beside its values: labels, statistics of its footer, and how it was written."""

from collections.abc import Iterator, Mapping
from typing import Any

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from manifests.explain import ABSENT, find_value_differences, format_value

FREE_TEXT = {"description", "long_name", "axes", "frame_time"}
"""Labels in words, which another version may word otherwise."""
_OWN_KEYS = {b"ARROW:schema"}


def find_label_lies(file: pq.ParquetFile, wanted: pa.Schema, is_same_writer: bool) -> Iterator[str]:
    """Yield where names, types or labels of the columns are not those of the table of channels.

    Parameters
    ----------
    file : a table
    wanted : schema that our writer gives it
    is_same_writer : whether our writer made it; else types, absent labels and labels in words may be others
    """
    found = file.schema_arrow
    if is_same_writer and found.names != wanted.names:
        yield f"its columns must be {format_value(wanted.names)}; they are {format_value(found.names)}"
        return
    for name in [name for name in wanted.names if name in found.names]:
        ours, theirs = wanted.field(name), found.field(name)
        rows = find_value_differences(_read_labels(ours), _read_labels(theirs))
        for key, a, b in rows:
            if is_same_writer or not (key in FREE_TEXT or ABSENT in (a, b)):
                yield f"{key} of column {name} must be {format_value(a)}; it is {format_value(b)}"
        if is_same_writer and ours.type != theirs.type:
            yield f"column {name} must be of type {ours.type}; it is of {theirs.type}"
    ours, theirs = (
        {key: text for key, text in (carried or {}).items() if key not in _OWN_KEYS}
        for carried in (wanted.metadata, file.metadata.metadata)
    )
    if is_same_writer and ours != theirs:
        yield f"must carry the metadata {format_value(str(ours))}; it carries {format_value(str(theirs))}"


def _read_labels(field: pa.Field) -> dict[str, str]:
    labels = {
        key.decode(errors="replace"): text.decode(errors="replace")
        for key, text in (field.metadata or {}).items()
    }
    return {key: text for key, text in labels.items() if not key.startswith("PARQUET:")}


def find_footer_lies(file: pq.ParquetFile) -> Iterator[str]:
    """Yield the statistics of a footer that its rows contradict: who filters by them finds other rows or none.

    Parameters
    ----------
    file : a table
    """
    for group in range(file.num_row_groups):
        rows = file.read_row_group(group)
        footer = file.metadata.row_group(group)
        for name, column in _list_leaves(rows):
            index = next(i for i in range(footer.num_columns) if footer.column(i).path_in_schema == name)
            statistics = footer.column(index).statistics
            if statistics is None:
                continue
            for what, value in _measure_column(column).items():
                stated = getattr(statistics, what) if what == "null_count" or statistics.has_min_max else None
                if stated is not None and stated != value:
                    yield (
                        f"{what} of column {name.split('.')[0]} in row group {group} must be {format_value(value)}, as"
                        f" its rows say; its footer says {format_value(stated)}"
                    )


def _list_leaves(rows: pa.Table) -> Iterator[tuple[str, pa.ChunkedArray]]:
    for name in rows.column_names:
        column = rows[name]
        if pa.types.is_fixed_size_list(column.type):
            yield f"{name}.list.element", pc.list_flatten(column)
        elif pa.types.is_dictionary(column.type):
            yield name, column.cast(column.type.value_type)
        else:
            yield name, column


def _measure_column(column: pa.ChunkedArray) -> dict[str, Any]:
    known = column.drop_null()
    if pa.types.is_floating(column.type):
        known = known.filter(pc.invert(pc.is_nan(known)))  # NaN has no place in the order of a footer
    return {**pc.min_max(known).as_py(), "null_count": column.null_count}


def find_writer_differences(file: pq.ParquetFile, wanted: bytes) -> list[str]:
    """Return how a file whose values and labels are right was written otherwise than by our writer.

    Parameters
    ----------
    file : a table
    wanted : bytes that our writer makes of it
    """
    ours, theirs = (
        _describe_writing(metadata) for metadata in (pq.read_metadata(pa.BufferReader(wanted)), file.metadata)
    )
    rows = find_value_differences(ours, theirs)
    return [
        f"{field} must be {format_value(a)}, as muSync writes it; it is {format_value(b)}"
        for field, a, b in rows
    ] or ["must have the bytes that muSync writes of its values; it has others"]


def _describe_writing(metadata: pq.FileMetaData) -> Mapping[str, Any]:
    groups = [metadata.row_group(i) for i in range(metadata.num_row_groups)]
    chunks = [group.column(i) for group in groups for i in range(group.num_columns)]
    return {
        "its writer": metadata.created_by,
        "rows of its row groups": str([group.num_rows for group in groups]),
        "its compression": ", ".join(sorted({chunk.compression for chunk in chunks})),
        "its encodings": ", ".join(sorted({name for chunk in chunks for name in chunk.encodings})),
        "presence of an index of pages": any(
            chunk.has_column_index or chunk.has_offset_index for chunk in chunks
        ),
        "presence of filters": any(chunk.to_dict().get("bloom_filter_offset") for chunk in chunks),
        "its statistics": [_list_statistics(chunk) for chunk in chunks],
    }


def _list_statistics(chunk: pq.ColumnChunkMetaData) -> str:
    return str(chunk.statistics.to_dict() if chunk.is_stats_set else None)
