"""ASAM MDF 4: one ``.mf4`` a clip, as measurement tools read it.

The group ``ticks`` has every tick (1 kHz) with our names, units and signs (pitch positive nose-down; ISO 8855); the
group ``frames`` has ``frame`` and the rig's pose ``T_world_rig_RC`` by row and column (translation [m]) at every frame.
The master channel is the time since the start of the clip [s], to the nanosecond in float64. A channel's comment is
its meaning. There are no pictures.

Format: https://www.asam.net/standards/detail/mdf, version 4.10, written by asammdf
"""

from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from flows.exporting.dataset import TICK_COLUMNS, ExportedClip, ExportedDataset, describe_columns

START = datetime(1970, 1, 1, tzinfo=UTC)
"""Start of each recording: a clip has no date."""


def write_mdf4(dataset: ExportedDataset, folder: Path) -> None:
    """Write ``NAME.mf4`` for each clip.

    Parameters
    ----------
    dataset : with frames or without
    folder : empty
    """
    for clip in dataset:
        _write_clip(clip, folder / f"{clip.name}.mf4")


def _write_clip(clip: ExportedClip, path: Path) -> None:
    from asammdf import MDF, Signal

    words = describe_columns((*TICK_COLUMNS, "frame"))
    seconds = clip.ticks["t_ns"] / 1e9
    ticks = [
        Signal(
            _as_number(clip.ticks[name]),
            seconds,
            name=name,
            unit=words[name]["unit"],
            comment=words[name]["description"],
        )
        for name in TICK_COLUMNS
    ]
    shown = clip.frames["t_ns"] / 1e9
    frames = [
        Signal(clip.frames["frame"], shown, name="frame", unit="1", comment=words["frame"]["description"])
    ]
    frames += [
        Signal(
            np.ascontiguousarray(clip.T_world_rig[:, k // 4, k % 4]),
            shown,
            name=f"T_world_rig_{k // 4}{k % 4}",
            unit="m" if k % 4 == 3 and k < 12 else "1",
            comment="rig-to-world pose",
        )
        for k in range(16)
    ]
    with MDF(version="4.10") as recording:
        recording.header.start_time = START
        recording.append(ticks, acq_name="ticks", common_timebase=True, comment=clip.label)
        recording.append(frames, acq_name="frames", common_timebase=True, comment=clip.label)
        recording.save(path, compression=2)


def _as_number(values: np.ndarray) -> np.ndarray:
    """MDF has no truth values: they become 0 and 1."""
    return values.astype(np.uint8) if values.dtype == bool else values
