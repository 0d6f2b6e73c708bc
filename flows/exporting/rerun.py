"""Rerun: one ``.rrd`` a clip, on the timeline ``t``, the time since the start of the clip in nanoseconds.

``/telemetry/COLUMN`` has every tick (1 kHz) at which it is represented, as a scalar in float64, with our names, units
and signs: pitch positive nose-down. ``/world`` is ours (ISO 8855, z up), ``/world/rig`` the rig's pose at every frame,
``/world/rig/camera`` its mount and pinhole (x right, y down, z forward; pixel centres at +0.5), and below it ``rgb``
(PNG, as stored), ``depth`` [m] and ``class``. Poses are in float32, which Rerun's archetypes hold.

Format: https://rerun.io/docs/concepts/logging-and-ingestion, written by rerun-sdk itself
"""

from pathlib import Path
from typing import Any

import numpy as np

from flows.exporting.dataset import (
    TICK_COLUMNS,
    ExportedClip,
    ExportedDataset,
    describe_columns,
    require_pinhole,
)
from flows.exporting.poses import compute_quaternions
from tasks.conventions import SemanticClass
from tasks.render.contact_sheet import encode_png

TIMELINE = "t"
CAMERA = "world/rig/camera"


def write_rerun(dataset: ExportedDataset, folder: Path) -> None:
    """Write ``NAME.rrd`` for each clip.

    Parameters
    ----------
    dataset : with frames of a pinhole, or without frames
    folder : empty

    Raises
    ------
    InputError
        If the camera's lens distorts.
    """
    import rerun

    if dataset.arrays:
        require_pinhole(dataset, "rerun")
    for clip in dataset:
        recording = rerun.RecordingStream("musync", recording_id=clip.clip_id)
        rerun.set_log_time_enabled(False, recording=recording)  # when it was exported is no fact of the clip
        recording.save(folder / f"{clip.name}.rrd")
        recording.send_recording_name(clip.label)
        _send_telemetry(rerun, recording, clip)
        _send_frames(rerun, recording, clip)
        recording.flush()
        recording.disconnect()


def _send_telemetry(rerun: Any, recording: Any, clip: ExportedClip) -> None:
    times = np.asarray(clip.ticks["t_ns"]).astype("timedelta64[ns]")
    words = describe_columns(TICK_COLUMNS)
    for name in TICK_COLUMNS:
        values = np.asarray(clip.ticks[name], np.float64)
        known = ~np.isnan(values)
        if name != "t_ns" and known.any():
            entity = f"telemetry/{name}"
            caption = f"{words[name]['description']} [{words[name]['unit'] or '1'}]"
            recording.log(entity, rerun.SeriesLines(names=caption), static=True)
            recording.send_columns(
                entity,
                indexes=[rerun.TimeColumn(TIMELINE, duration=times[known])],
                columns=rerun.Scalars.columns(scalars=values[known]),
            )


def _send_frames(rerun: Any, recording: Any, clip: ExportedClip) -> None:
    poses, camera = clip.T_world_rig, clip.camera
    turns = compute_quaternions(poses, scalar_first=False)
    turn = compute_quaternions(camera.T_rig_camera[None], scalar_first=False)[0]
    recording.log("world", rerun.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    mount = rerun.Transform3D(translation=camera.T_rig_camera[:3, 3], quaternion=rerun.Quaternion(xyzw=turn))
    recording.log(CAMERA, mount, static=True)
    if clip.pictures:
        pinhole = rerun.Pinhole(
            image_from_camera=camera.K,
            resolution=[camera.width, camera.height],
            camera_xyz=rerun.ViewCoordinates.RDF,
        )
        recording.log(CAMERA, pinhole, static=True)
        names = [(int(kind), kind.name.lower()) for kind in SemanticClass]
        recording.log(f"{CAMERA}/class", rerun.AnnotationContext(names), static=True)
    arrays = {name: clip.read_array(name) for name in ("rgb", "depth", "class")} if clip.pictures else {}
    for frame, t_ns in enumerate(clip.frames["t_ns"].tolist()):
        recording.set_time(TIMELINE, duration=np.timedelta64(t_ns, "ns"))
        pose = rerun.Transform3D(
            translation=poses[frame, :3, 3], quaternion=rerun.Quaternion(xyzw=turns[frame])
        )
        recording.log("world/rig", pose)
        if arrays:
            picture = rerun.EncodedImage(contents=encode_png(arrays["rgb"][frame]), media_type="image/png")
            recording.log(f"{CAMERA}/rgb", picture)
            recording.log(f"{CAMERA}/depth", rerun.DepthImage(arrays["depth"][frame], meter=1.0))
            recording.log(f"{CAMERA}/class", rerun.SegmentationImage(arrays["class"][frame]))
