"""A finished dataset for people who analyse it: the same tables in the library of their choice."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import duckdb
import pyarrow as pa

from flows.reading.arguments import list_names
from flows.reading.clips import Clip, find_clip
from flows.reading.connection import connect_sealed, quote_identifier
from flows.reading.pictures import open_frames_store, open_labelled_frames
from flows.reading.query import list_columns, refuse_several, refused_query
from flows.reading.suggestions import suggest_names
from flows.reading.table_files import STORED, explain_unreadable, open_stored_table
from flows.reading.views import VIEWS
from flows.store.address import open_for_reading, want_telemetry
from flows.store.layout import OBJECTS, Layout
from flows.store.sealed import read_manifest, read_manifest_head, recorded_grid
from tasks.conventions import CHANNELS_BY_NAME
from tasks.errors import InputError

if TYPE_CHECKING:  # each takes its time to import, and few people need all of them
    import pandas as pd
    import pyarrow.dataset
    import zarr

    from flows.reading.frames import Frames
    from flows.reading.windows import ClipWindows

_Answer = TypeVar("_Answer")


@dataclass(frozen=True, kw_only=True)
class Dataset:
    """A sealed dataset, read lazily; nothing is copied before it is asked for.

    Parameters
    ----------
    root : its folder
    head : its frozen manifest without the clips
    origin : its address in an object store; ``root`` then holds what has been read of it
    allow_files : SQL may read and write files of this machine; else it reaches the dataset's tables alone
    """

    root: Path
    head: Mapping[str, Any]
    origin: str | None = None
    allow_files: bool = False

    def __repr__(self) -> str:
        return f"Dataset({self.place!r}, {len(self)} clips)"

    def _repr_html_(self) -> str:
        from flows.reading.notebook_cards import dataset_card

        return dataset_card(self)

    def __len__(self) -> int:
        return len(self.manifest["clips"])

    def __iter__(self) -> Iterator[str]:
        """The labels of the clips, in the order of their index."""
        return (clip["label"] for clip in self.manifest["clips"])

    def __contains__(self, name: object) -> bool:
        return any(name in (clip["label"], clip["clip_id"]) for clip in self.manifest["clips"])

    def __getitem__(self, name: str) -> Clip:
        """Return the clip of this label or id.

        Raises
        ------
        InputError
            If there is none, with the labels that come near.
        """
        return Clip(dataset=self, record=find_clip(self.manifest["clips"], name, self.place))

    @cached_property
    def manifest(self) -> Mapping[str, Any]:
        """Its frozen manifest, of which the clips are read when they are first asked for: 6 CPU-s for 100,000.

        Raises
        ------
        InputError
            If a clip's record breaks a rule, or the dataset was sealed anew since it was opened.
        """
        manifest = read_manifest(self._layout)
        if manifest["seal"] != self.head["seal"]:
            raise InputError(f"{self.place}: must stay as it was opened; it was sealed anew: open it again")
        return manifest

    @property
    def place(self) -> str:
        """Its folder, or its address in an object store."""
        return self.origin or str(self.root)

    def telemetry(self, table: str = "ticks") -> "pyarrow.dataset.Dataset":
        """Return a stored table as a pyarrow dataset: clips, ticks, frames or pairs; its schema has the units.

        Raises
        ------
        InputError
            If there is no such table.
        """
        _check_names(
            table, (*STORED, OBJECTS) if recorded_grid(self.head["grid"], self.place).has_objects else STORED
        )
        return open_stored_table(self._layout, self.head, table)

    @cached_property
    def connection(self) -> duckdb.DuckDBPyConnection:
        """A DuckDB connection with the views clips, ticks, frames, verdicts and pairs; it reaches nothing else."""
        return connect_sealed(self._layout, self.head, allow_files=self.allow_files)

    def sql(self, query: str) -> duckdb.DuckDBPyRelation:
        """A query over the views, as a relation that is evaluated when its rows are asked for.

        Raises
        ------
        InputError
            If it is no query that DuckDB takes, or asks for files and the dataset was not opened with ``allow_files``,
            without which it is one statement.
        """
        try:
            refuse_several(self.connection, query, allow_files=self.allow_files)
            return self.connection.sql(query)
        except duckdb.Error as error:
            raise refused_query(query, error, "musync.open(..., allow_files=True)") from None

    def pandas(
        self, table: str = "clips", columns: str | Sequence[str] | None = None, *, clip: str | None = None
    ) -> "pd.DataFrame":
        """Return a view as a pandas frame; values not represented are NaN.

        ``attrs["units"]`` and ``attrs["long_name"]`` of the frame map its columns to their unit and meaning.

        Parameters
        ----------
        table : clips, ticks, frames, verdicts or pairs
        columns : those to read; None takes all
        clip : label or id of the clip whose rows are read; None takes those of all

        Raises
        ------
        InputError
            If there is no such view, clip or column, with the names that come near.
        """
        frame = self._evaluated(table, columns, clip, lambda relation: relation.df())
        known = {name: CHANNELS_BY_NAME[name] for name in frame.columns if name in CHANNELS_BY_NAME}
        frame.attrs["units"] = {name: channel.unit for name, channel in known.items() if channel.unit}
        frame.attrs["long_name"] = {name: channel.description for name, channel in known.items()}
        return frame

    def polars(
        self, table: str = "clips", columns: str | Sequence[str] | None = None, *, clip: str | None = None
    ) -> Any:
        """A view as a Polars frame, as `pandas`; needs the package polars. Polars keeps no units.

        Raises
        ------
        InputError
            If Polars is not installed, or there is no such view, clip or column.
        """
        try:
            import polars as pl
        except ImportError:
            raise InputError("Polars is not installed: pip install 'musync-gs[analysts]'") from None
        return self._evaluated(
            table, columns, clip, lambda relation: pl.from_arrow(relation.to_arrow_table())
        )

    def _evaluated(
        self,
        table: str,
        columns: str | Sequence[str] | None,
        clip: str | None,
        evaluate: Callable[[duckdb.DuckDBPyRelation], _Answer],
    ) -> _Answer:
        _check_names(table, tuple(VIEWS))
        chosen = "*" if columns is None else ", ".join(self._quote_columns(table, columns))
        relation = self.sql(f"SELECT {chosen} FROM {table}{self._select_clip(table, clip)}")
        try:
            return evaluate(relation)
        except (duckdb.Error, pa.ArrowException, ValueError, OverflowError) as error:
            raise explain_unreadable(self._layout, error) from None

    def _quote_columns(self, table: str, columns: str | Sequence[str]) -> list[str]:
        """Columns of a view as SQL takes them; DuckDB does not mind the case of a name."""
        asked = list_names("columns", columns)
        if not asked:
            raise InputError(f"columns of {table}: must name one or more; None takes all")
        known = self.sql(f"SELECT * FROM {table}").columns
        folded = {name.casefold() for name in known}
        wrong = [name for name in asked if name.casefold() not in folded]
        if wrong:
            raise suggest_names(f"{table}: column", wrong, known, "data.schema()")
        return [quote_identifier(name) for name in asked]

    def _select_clip(self, table: str, clip: str | None) -> str:
        if clip is None:
            return ""
        if table == "pairs":
            raise InputError("table 'pairs': has two clips a row; ask for it without a clip and filter it")
        return (
            f" WHERE clip_id = '{self[clip].clip_id}'"  # an id is hexadecimal: the manifest's door saw to it
        )

    @property
    def _layout(self) -> Layout:
        return Layout(self.root, self.origin)

    @cached_property
    def source(self) -> "Frames":
        """Where whole clips and windows of the frames are read."""
        from flows.reading.frames import open_frames

        return open_frames(self._layout, self.manifest)

    @cached_property
    def frames(self) -> "zarr.Group":
        """The frames as lazy Zarr arrays ``[clip, frame, y, x(, channel)]``; ``index`` of a clip is its first axis.

        Raises
        ------
        InputError
            If the dataset was made without frames, or their metadata are not those that muSync writes.
        """
        store = open_frames_store(self._layout, self.manifest)
        import zarr

        return zarr.open_group(store, mode="r", zarr_format=3, use_consolidated=False)

    def xarray(self) -> Any:
        """The frames as a lazy xarray dataset, its clips by label and its frames with their time; needs xarray.

        Raises
        ------
        InputError
            If xarray is not installed, or as for `frames`.
        """
        return open_labelled_frames(self._layout, self.manifest)

    def torch(
        self,
        *,
        window: int = 16,
        stride: int | None = None,
        columns: str | Sequence[str] = ("speed", "longitudinal_acceleration", "pitch", "heave"),
        arrays: str | Sequence[str] = ("rgb",),
        clips: str | Sequence[str] | None = None,
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

        columns, arrays = list_names("columns", columns), list_names("arrays", arrays)
        folders = tuple(f"frames.zarr/{array}/" for array in arrays)
        # workers read the files of these arrays often: they have to be here, and no links
        open_for_reading(self.origin or self.root, lambda name: name.startswith(folders))
        chosen = None if clips is None else list_names("clips", clips)
        step = window if stride is None else stride
        return windows_of(self._layout, self.manifest, window, step, columns, arrays, chosen, quarantined)

    def schema(self) -> dict[str, Any]:
        """Columns of every view with unit, paper symbol, CF standard name and description."""
        return list_columns()


def open(dataset: str | Path, *, allow_files: bool = False) -> Dataset:
    """Open a finished dataset folder.

    Parameters
    ----------
    dataset : folder, or address in an object store
    allow_files : SQL may read and write files of this machine, and load extensions; else it reaches the dataset's
        tables alone, whatever a query or a column's name says

    Raises
    ------
    InputError
        If the folder is no sealed dataset.
    """
    layout = open_for_reading(dataset, want_telemetry)
    return Dataset(
        root=layout.root, head=read_manifest_head(layout), origin=layout.origin, allow_files=allow_files
    )


def _check_names(table: str, names: tuple[str, ...]) -> None:
    if table not in names:
        raise InputError(f"table {table!r}: no such table; there are {', '.join(names)}")
