"""Values that are not represented: NaN inside the science, NULL in every table that is written.

Statistics in the footers of Parquet files leave NaN out, and readers believe them: a count or a filter over NaN comes
out wrong. So a table is written with NULL, and says so; in one that does not say so NaN becomes NULL when it is read.
"""

from typing import Any, TypeVar

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

_NULLS_WRITTEN = {b"missing": b"null"}
"""Metadata of a schema whose columns hold no NaN."""

Rows = TypeVar("Rows", pa.Table, pa.RecordBatch)


def has_nulls(schema: pa.Schema) -> bool:
    """Whether a table was written with NULL where a value is not represented; those of older datasets hold NaN."""
    return _NULLS_WRITTEN.items() <= (schema.metadata or {}).items()


def null_missing(rows: Rows) -> Rows:
    """Return a table or batch with NULL in place of NaN, whose schema says so.

    Parameters
    ----------
    rows : columns of floats and fixed-size lists of them are looked through, all others stay as they are
    """
    schema = rows.schema.with_metadata((rows.schema.metadata or {}) | _NULLS_WRITTEN)
    return type(rows).from_arrays([_null_column(column) for column in rows.columns], schema=schema)


def _null_column(column: pa.Array | pa.ChunkedArray) -> pa.Array | pa.ChunkedArray:
    if isinstance(column, pa.ChunkedArray):
        return pa.chunked_array([_null_column(chunk) for chunk in column.chunks], column.type)
    if pa.types.is_floating(column.type):
        is_nan = pc.is_nan(column)
        return pc.if_else(is_nan, pa.scalar(None, column.type), column) if pc.any(is_nan).as_py() else column
    if pa.types.is_fixed_size_list(column.type) and pa.types.is_floating(column.type.value_type):
        values = _null_column(_list_values(column))
        if values.null_count:  # a row without any value is NULL as a whole
            absent = _as_rows(values.is_null(), column).all(axis=1)
            return pa.FixedSizeListArray.from_arrays(values, type=column.type, mask=pa.array(absent))
    return column


def read_values(column: pa.Array) -> NDArray[Any]:
    """Return a column as NumPy has it: NULL among numbers is NaN, and a fixed-size list column is 2-D.

    Parameters
    ----------
    column : of one chunk
    """
    if pa.types.is_fixed_size_list(column.type):
        rows = _as_rows(_list_values(column), column)
        return np.where(np.asarray(column.is_null())[:, None], np.nan, rows) if column.null_count else rows
    if pa.types.is_boolean(column.type) and column.null_count:
        column = column.cast(pa.float64())
    values: NDArray[Any] = column.to_numpy(zero_copy_only=False)
    return values


def _list_values(column: pa.FixedSizeListArray) -> pa.Array:
    """The values of all rows, one row after the other; a row that is NULL has its place among them."""
    size = column.type.list_size
    return column.values.slice(column.offset * size, len(column) * size)


def _as_rows(values: pa.Array, column: pa.FixedSizeListArray) -> NDArray[Any]:
    return values.to_numpy(zero_copy_only=False).reshape(len(column), column.type.list_size)
