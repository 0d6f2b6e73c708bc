"""The verdict on any video or trajectory against the telemetry claimed for it, without a renderer's data."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from catalogs.campaign_files import find_unit_problems, open_parquet, parse_columns
from catalogs.documents import read_content
from catalogs.entries import load
from catalogs.sentences import shorten
from flows.store.outputs import Outputs
from studies.evaluation.metrics.foreign_video import VideoClaim, judge_motion, sample_claim
from studies.foreign_video.sources import read_camera, read_footage
from tasks.errors import InputError

NEEDS_DEPTH = (
    "pose by photometric alignment",
    "pose by points with depth",
    "progress in metres",
    "heave in metres",
)
LARGEST_CLAIM = 2**28
"""Bytes of a claim [1]."""
CLAIMED = {"t_ns": "ns", "time": "s", "pitch": "rad", "station": "m", "speed": "m/s"}
"""Columns of a claim that are read, and their units."""
NEEDED = {
    "a column t_ns or time": {"t_ns", "time"},
    "the column pitch [rad]": {"pitch"},
    "a column station [m] or speed [m/s]": {"station", "speed"},
}
"""Columns of which a claim needs one each."""
LARGEST_MOTION = 1e8
"""Farthest station [m], and greatest speed [m/s], that a claim may hold."""


def judge_video(
    video: str, *, claim: str, camera: str, out: str | None = None, metric: bool = False
) -> dict[str, Any]:
    """Compare a video's ego motion, by the essential chain, or a trajectory with the telemetry claimed for it.

    Parameters
    ----------
    video : any file that FFmpeg reads, or a trajectory in the TUM format (.txt, .tum)
    claim : Parquet with pitch [rad] and station [m] (or speed [m/s]) over t_ns or time [s]
    camera : YAML with focal_length, width and height, or with fx, fy, cx, cy, width and height [px]; where it has
        k1, k2, p1, p2 or k3 [1], lens distortion as OpenCV writes it, the frames are undistorted first
    out : folder for judgement.json
    metric : whether a trajectory's lengths are metres

    Raises
    ------
    InputError
        Every file that cannot be read, in one sentence each.
    """
    results = Outputs(out, "lab judge", "judgement.json")
    footage, claimed, lens = read_all((read_footage, video), (read_claim, claim), (read_camera, camera))
    at = sample_claim(claimed, footage.times)
    recovered = footage.motion(lens, at.rows, metric=metric)
    verdict = judge_motion(recovered, at, load("foreign gate file"))
    times, is_video = footage.times, footage.frames is not None
    result = {
        "video": footage.name,
        "frames": len(times),
        "judged_frames": len(at.rows),
        "frame_rate_hz": float((len(times) - 1) / (times[-1] - times[0])),
        "width": footage.width,
        "height": footage.height,
        "judged_width": None if footage.frames is None else footage.frames.shape[2],
        "judged_height": None if footage.frames is None else footage.frames.shape[1],
        "undistorted": is_video and lens.distortion is not None,
        "method": recovered.method,
        **verdict,
        "not_run": [f"{name}: needs depth" for name in NEEDS_DEPTH] if is_video else [],
    }
    results.write_json("judgement.json", result)
    return result


def read_all(*sources: tuple[Callable[[Path], Any], str]) -> list[Any]:
    """Return the value that each reader makes of its file; all faulty files are reported at once."""
    parts: list[Any] = []
    problems: list[str] = []
    for read, path in sources:
        try:
            parts.append(read(Path(path)))
        except InputError as error:
            problems += error.problems
    if problems:
        raise InputError(problems)
    return parts


def read_claim(path: Path) -> VideoClaim:
    """Claimed pitch and station over time.

    Raises
    ------
    InputError
        If the file cannot be read, or lacks or repeats what is needed.
    """
    content = read_content(path, "claim", LARGEST_CLAIM)
    columns, units = parse_columns(content, f"{path}: the claim", CLAIMED)
    problems = find_unit_problems(units, CLAIMED, str(path))
    lacks = [name for name, wanted in NEEDED.items() if not columns.keys() & wanted]
    if lacks:
        with open_parquet(content, f"{path}: the claim") as file:
            there = ", ".join(file.schema_arrow.names)
        problems.append(
            f"{path}: the claim lacks {', '.join(lacks)}; its columns are {shorten(there) or 'none'}."
        )
    if (clips := _clip_count(path, content)) > 1:
        problems.append(f"{path}: the claim holds {clips} clips; give one clip's rows.")
    if problems:
        raise InputError(problems)
    time = columns["t_ns"] * 1e-9 if "t_ns" in columns else columns["time"]
    if len(time) < 2 or not np.isfinite(time).all() or not (np.diff(time) > 0).all():
        raise InputError(f"{path}: the claim's time must rise from row to row, over two rows at least.")
    motion = columns["station" if "station" in columns else "speed"]
    if not (np.abs(columns["pitch"]) <= np.pi).all() or not (np.abs(motion) <= LARGEST_MOTION).all():
        raise InputError(
            f"{path}: the claim's pitch must be within {np.pi:.3f} rad, and its station [m] or speed [m/s] a finite"
            f" number of at most {LARGEST_MOTION:g}, throughout."
        )
    if "station" not in columns:
        motion = np.concatenate([[0.0], np.cumsum(0.5 * (motion[1:] + motion[:-1]) * np.diff(time))])
    return VideoClaim(time=time - time[0], pitch=columns["pitch"], station=motion)


def _clip_count(path: Path, content: bytes) -> int:
    """How many clips a claim's rows name; 0 where they name none."""
    with open_parquet(content, f"{path}: the claim") as file:
        if "clip_id" not in file.schema_arrow.names:
            return 0
    # as a dictionary a long name that every row repeats takes its place once
    with open_parquet(content, f"{path}: the claim", read_dictionary=["clip_id"]) as file:
        return len(file.read(columns=["clip_id"], use_threads=False)["clip_id"].unique())
