"""A finished dataset for people who analyse it: the same tables in the library of their choice."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import duckdb
import pyarrow as pa
import pyarrow.dataset
import pyarrow.parquet as pq

from flows.reading.query import VIEWS, connect_sealed, schema
from flows.store.address import frames_store, reading, telemetry
from flows.store.layout import Layout
from flows.store.sealed import read_manifest
from tasks.conventions import CHANNELS_BY_NAME
from tasks.errors import InputError

if TYPE_CHECKING:  # each takes its time to import, and few people need all of them
    import pandas as pd
    import zarr

    from flows.reading.windows import ClipWindows

STORED = ("clips", "ticks", "frames", "pairs")


@dataclass(frozen=True, kw_only=True)
class Dataset:
    """A sealed dataset, read lazily; nothing is copied before it is asked for.

    Parameters
    ----------
    root : its folder
    manifest : its frozen manifest
    origin : its address in an object store; ``root`` then holds what has been read of it
    """

    root: Path
    manifest: dict[str, Any]
    origin: str | None = None

    def __repr__(self) -> str:
        return f"Dataset({self.origin or str(self.root)!r}, {len(self.manifest['clips'])} clips)"

    def telemetry(self, table: str = "ticks") -> pyarrow.dataset.Dataset:
        """A stored table as a pyarrow dataset: clips, ticks, frames or pairs; units stand in its schema.

        Raises
        ------
        InputError
            If there is no such table.
        """
        _known(table, STORED)
        folder = Layout(self.root).telemetry
        if table in {"clips", "pairs"}:
            return pyarrow.dataset.dataset(folder / f"{table}.parquet")
        partitioning = pyarrow.dataset.partitioning(pa.schema([("family", pa.string())]), flavor="hive")
        first = next((folder / table).glob("*/*.parquet"))
        labelled = pq.read_schema(first).append(pa.field("family", pa.string()))
        return pyarrow.dataset.dataset(folder / table, schema=labelled, partitioning=partitioning)

    @cached_property
    def connection(self) -> duckdb.DuckDBPyConnection:
        """A DuckDB connection with the views clips, ticks, frames, verdicts and pairs."""
        return connect_sealed(Layout(self.root))

    def sql(self, query: str) -> duckdb.DuckDBPyRelation:
        """A query over the views, as a relation that is evaluated when its rows are asked for."""
        return self.connection.sql(query)

    def pandas(self, table: str = "clips", columns: Sequence[str] | None = None) -> "pd.DataFrame":
        """A view as a pandas frame; what is not represented is NaN.

        Parameters
        ----------
        table : clips, ticks, frames, verdicts or pairs
        columns : those to read; None takes all
        """
        return self._relation(table, columns).df()

    def polars(self, table: str = "clips", columns: Sequence[str] | None = None) -> Any:
        """A view as a Polars frame; needs the package polars.

        Raises
        ------
        InputError
            If Polars is not installed, or there is no such view.
        """
        try:
            import polars as pl
        except ImportError:
            raise InputError("Polars is not installed: pip install 'musync[analysts]'") from None
        return pl.from_arrow(self._relation(table, columns).to_arrow_table())

    def _relation(self, table: str, columns: Sequence[str] | None) -> duckdb.DuckDBPyRelation:
        _known(table, tuple(VIEWS))
        chosen = "*" if columns is None else ", ".join(f'"{name}"' for name in columns)
        return self.sql(f"SELECT {chosen} FROM {table}")

    @property
    def frames(self) -> "zarr.Group":
        """The frames as lazy Zarr arrays ``[clip, frame, y, x(, channel)]``; ``index`` of a clip is its first axis.

        Raises
        ------
        InputError
            If the dataset was made without frames.
        """
        if not self.manifest["grid"].get("pictures", True):
            raise InputError(f"{self.origin or self.root}: the dataset was made without frames")
        import zarr

        return zarr.open_group(frames_store(Layout(self.root, self.origin)), mode="r")

    def xarray(self) -> Any:
        """The frames as a lazy xarray dataset, its clips by label and its frames with their time; needs xarray.

        Raises
        ------
        InputError
            If xarray is not installed.
        """
        try:
            import xarray
        except ImportError:
            raise InputError("xarray is not installed: pip install 'musync[analysts]'") from None
        pixels = xarray.open_zarr(
            frames_store(Layout(self.root, self.origin)), consolidated=False, chunks=None
        )
        clips, time = self.manifest["clips"], CHANNELS_BY_NAME["t_ns"]
        seconds = [frame / self.manifest["grid"]["frame_rate_hz"] for frame in range(pixels.sizes["frame"])]
        return pixels.assign_coords(
            clip=[clip["label"] for clip in clips],
            clip_id=("clip", [clip["clip_id"] for clip in clips]),
            t=(
                "frame",
                seconds,
                {"standard_name": time.standard_name, "long_name": time.description, "units": "s"},
            ),
        )

    def torch(
        self,
        *,
        window: int = 16,
        stride: int | None = None,
        columns: Sequence[str] = ("speed", "longitudinal_acceleration", "pitch", "heave"),
        arrays: Sequence[str] = ("rgb",),
        clips: Sequence[str] | None = None,
        quarantined: bool = False,
    ) -> "ClipWindows":
        """Windows of consecutive frames with their telemetry, for `torch.utils.data.DataLoader`.

        Parameters
        ----------
        window : frames in one sample [1]
        stride : frames from the start of one window to the next in a clip; None takes ``window`` [1]
        columns : numeric columns of the frame table
        arrays : of rgb, depth, class and the labels that the grid asked for; empty for telemetry alone
        clips : labels or ids; None takes all that are not in quarantine
        quarantined : take those too; else a warning names them and ``left_out`` holds their labels
        """
        from flows.reading.windows import windows_of

        if self.origin is not None:  # workers read the files of these arrays often
            reading(
                self.origin, lambda name: name.startswith(tuple(f"frames.zarr/{array}/" for array in arrays))
            )
        return windows_of(
            self.root, self.manifest, window, stride or window, columns, arrays, clips, quarantined
        )

    def schema(self) -> dict[str, Any]:
        """Columns of every view with unit, paper symbol, CF standard name and description."""
        return schema()


def open(dataset: str | Path) -> Dataset:
    """Open a finished dataset folder.

    Raises
    ------
    InputError
        If the folder is no sealed dataset.
    """
    layout = reading(dataset, telemetry)
    return Dataset(root=layout.root, manifest=read_manifest(layout), origin=layout.origin)


def _known(table: str, names: tuple[str, ...]) -> None:
    if table not in names:
        raise InputError(f"table {table!r}: no such table; there are {', '.join(names)}")
