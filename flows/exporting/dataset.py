"""A finished dataset as the writers of other formats take it: clip by clip, each read when it is its turn."""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from catalogs.scenario import Scenario
from flows.making.catalogue import Catalogue
from flows.making.gathering import table_parts
from flows.making.plan import Plan, read_plan
from flows.reading.frames import Frames, open_frames
from flows.store.arrays import arrays_of
from flows.store.layout import Layout
from flows.store.object_tables import read_objects
from flows.store.telemetry import read_columns
from manifests.records import Manifest
from tasks.conventions import CHANNELS_BY_NAME, FRAME_CHANNELS, TICK_CHANNELS
from tasks.errors import InputError
from tasks.render.camera import Camera
from tasks.vehicle.parameters import Vehicle

Columns = dict[str, NDArray[Any]]
TICK_COLUMNS = tuple(channel.name for channel in TICK_CHANNELS)


@dataclass(frozen=True, kw_only=True)
class ExportedClip:
    """A clip with what writers ask of it.

    Parameters
    ----------
    source : of its frames, in its dataset
    record : what the manifest says of it
    ticks_file, frames_file : Parquet files with its rows
    camera : that saw it
    plan : that it was made by
    """

    source: Frames
    record: Mapping[str, Any]
    ticks_file: str
    frames_file: str
    camera: Camera
    plan: Plan

    @property
    def label(self) -> str:
        """The clip's levels of the grid's axes."""
        return str(self.record["label"])

    @property
    def clip_id(self) -> str:
        """Content id."""
        return str(self.record["clip_id"])

    @property
    def pictures(self) -> bool:
        """Whether it has frames."""
        return bool(self.plan.settings.pictures)

    @property
    def name(self) -> str:
        """Number in the dataset and label, with letters, digits and ``+=-_`` alone: of files, topics and keys."""
        return f"{self.record['index']:05d}_{re.sub(r'[^A-Za-z0-9+=_-]', '_', self.label)[:100]}"

    @property
    def scenario(self) -> Scenario:
        """Weather, controls and road."""
        return Scenario.of(self.record["scenario"])

    @cached_property
    def ticks(self) -> Columns:
        """The telemetry of each tick, by column [its unit]; NaN where an older dataset lacks a column."""
        return self._read(self.ticks_file, TICK_COLUMNS, self.plan.ticks_per_clip)

    @cached_property
    def frames(self) -> Columns:
        """Columns of the frame table: the telemetry of each frame's tick, and ``T_world_rig`` [F, 16]."""
        names = (*(channel.name for channel in FRAME_CHANNELS), *TICK_COLUMNS)
        return self._read(self.frames_file, names, self.plan.settings.frames)

    @cached_property
    def objects(self) -> Columns:
        """Columns of the table of road users; none where the dataset has no such table."""
        if not self.plan.settings.has_objects:
            return {}
        index = self.record["index"]
        return read_objects(self.source.find(index), index, self.plan.settings.frames)

    @property
    def T_world_rig(self) -> NDArray[np.float64]:
        """Rig-to-world poses [F, 4, 4] [m]."""
        return np.asarray(self.frames["T_world_rig"], np.float64).reshape(-1, 4, 4)

    @property
    def T_world_camera(self) -> NDArray[np.float64]:
        """Camera-to-world poses [F, 4, 4], camera axes x right, y down, z forward [m]."""
        return self.T_world_rig @ self.camera.T_rig_camera

    def read_array(self, name: str) -> NDArray[Any]:
        """Return one array of the clip's frames [F, H, W, ...]."""
        return self.source.read(self.record["index"], name)

    def read_frame_telemetry(self, frame: int) -> dict[str, Any]:
        """Return the telemetry at a frame, by column, as JSON has it.

        Parameters
        ----------
        frame : number in the clip
        """
        return {name: to_json_value(self.frames[name][frame]) for name in ("frame", "tick", *TICK_COLUMNS)}

    def _read(self, file: str, names: Sequence[str], rows: int) -> Columns:
        stored = read_columns(self.source.layout.root / file, self.clip_id, names, most=rows)
        return {name: stored[name] for name in names}


@dataclass(frozen=True, kw_only=True)
class ExportedDataset:
    """A dataset that a writer iterates over once.

    Parameters
    ----------
    layout : where it lies
    manifest : its record
    rows : records of the clips to export
    finish : called with the label of each clip after its turn
    """

    layout: Layout
    manifest: Manifest
    rows: Sequence[Mapping[str, Any]]
    finish: Callable[[str], None]

    @property
    def name(self) -> str:
        """The grid's name."""
        return self.plan.settings.name

    @cached_property
    def plan(self) -> Plan:
        """The plan that the dataset was made by."""
        return read_plan(self.layout.root)

    @cached_property
    def catalogue(self) -> Catalogue:
        """The dataset's kept entries."""
        return Catalogue(self.layout.inputs)

    @property
    def camera(self) -> Camera:
        """The dataset's camera by the values of its file; each clip has its own where that varies."""
        return self.catalogue.camera

    def camera_of(self, row: Mapping[str, Any]) -> Camera:
        """Return the camera of a clip by its record."""
        return self.catalogue.camera_of(int(row["seed"]))

    @property
    def vehicle(self) -> Vehicle:
        """The dataset's one vehicle."""
        return self.catalogue.vehicle

    @property
    def frame_rate_hz(self) -> float:
        """Of the frames [Hz]."""
        return self.plan.settings.frame_rate_hz

    @property
    def arrays(self) -> tuple[str, ...]:
        """Names of the arrays of its frames; empty without frames."""
        settings = self.plan.settings
        return tuple(arrays_of(settings.labels, settings.has_objects)) if settings.pictures else ()

    def __len__(self) -> int:
        return len(self.rows)

    @cached_property
    def known_columns(self) -> tuple[str, ...]:
        """Columns of the tick table that have a number at every frame: reference traces and older tables lack some."""
        known = set(TICK_COLUMNS)
        for clip in self._open_clips():
            known -= {name for name in known if not np.isfinite(clip.frames[name]).all()}
        return tuple(name for name in TICK_COLUMNS if name in known)

    def __iter__(self) -> Iterator[ExportedClip]:
        """Yield each clip; what was read of one is forgotten with it."""
        for clip in self._open_clips():
            yield clip
            self.finish(clip.label)

    def _open_clips(self) -> Iterator[ExportedClip]:
        files = {
            table: {clip_id: path for path, ids in table_parts(self.plan, table).items() for clip_id in ids}
            for table in ("ticks", "frames")
        }
        source = open_frames(self.layout, self.manifest)
        for row in self.rows:
            yield ExportedClip(
                source=source,
                record=row,
                ticks_file=files["ticks"][row["clip_id"]],
                frames_file=files["frames"][row["clip_id"]],
                camera=self.camera_of(row),
                plan=self.plan,
            )


def require_one_camera(dataset: ExportedDataset, to: str) -> None:
    """Refuse clips with cameras of their own, where the format has one for all.

    Raises
    ------
    InputError
        If focal length or mount differ from clip to clip.
    """
    if dataset.camera.varies:
        raise InputError(
            f"{dataset.layout}: --to {to} has one camera for all clips; here each clip draws its own: export to another"
            " format, or make the dataset with a camera without bounds"
        )


def require_pinhole(dataset: ExportedDataset, to: str) -> None:
    """Refuse a camera whose pictures the format cannot describe.

    Raises
    ------
    InputError
        If the camera has a lens with distortion.
    """
    if dataset.camera.distortion is not None:
        raise InputError(
            f"{dataset.layout}: --to {to} describes a pinhole; the camera {dataset.camera.name} has a distorting lens:"
            " make the dataset with a plain camera"
        )


def describe_columns(names: Sequence[str]) -> dict[str, dict[str, str]]:
    """Return unit and meaning of telemetry columns by name."""
    return {
        name: {"unit": CHANNELS_BY_NAME[name].unit, "description": CHANNELS_BY_NAME[name].description}
        for name in names
    }


def to_json_value(value: Any) -> Any:
    """Return a number as JSON has it: NaN, which means "not represented", becomes None."""
    plain = value.item() if isinstance(value, np.generic) else value
    return None if isinstance(plain, float) and not np.isfinite(plain) else plain
