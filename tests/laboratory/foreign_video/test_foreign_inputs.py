"""Inputs of a judged video: a camera or a claim that cannot be is refused."""

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from catalogs.entries import load
from studies.evaluation.metrics.foreign_video import VideoClaim, sample_claim
from studies.foreign_video.judge import read_claim
from studies.foreign_video.sources import ForeignCamera, read_camera, scale_intrinsics
from tasks.errors import InputError


def test_intrinsics_follow_the_size_and_refuse_another_shape(tmp_path: Path) -> None:
    K = np.array([[400.0, 0, 239.5], [0, 400, 159.5], [0, 0, 1]])
    camera = ForeignCamera(K=K, width=480, height=320, mount=np.eye(4), distortion=None)
    half = scale_intrinsics(camera, 240, 160)
    np.testing.assert_allclose(half, [[200, 0, 119.5], [0, 200, 79.5], [0, 0, 1]])
    with pytest.raises(InputError, match="not the same shape"):
        scale_intrinsics(camera, 320, 320)
    assert pytest.approx(K) == read_camera(Path("catalogs/cameras/dashcam-480x320.yaml")).K


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("{width: .inf, height: 2, focal_length: 3}", "finite"),
        ("{width: 1.0e+300, height: 2, focal_length: 3}", "width must be a number of 1 to 1e.06"),
        ("{width: 0.5, height: 2, focal_length: 3}", "width must be a number of 1"),
        ("{width: true, height: 2, focal_length: 3}", "width must be a number of 1"),
        (
            "{width: 4, height: 2, focal_length: 3, height_above_road: high}",
            "height_above_road must be a number",
        ),
        ("{width: 4, width: 5, height: 2, focal_length: 3}", "distinct keys"),
        ("{width: 4, height: 2, focal_length: 3, k1: [1]}", "k1 must be a number"),
        ("{width: 4, height: 2, focal_length: 3, k1: 0.1, k4: 1.5}", "k4: no such key"),
        ("{width: 4, height: 2, focal_length: 3, D: [0.1, 0, 0, 0]}", "D: no such key"),
        ("{width: 4, height: 2, K: [[3, 0, 2], [0, 3, 1], [0, 0, 1]]}", "K: no such key"),
        (
            "{width: 4, height: 2, focal_length: 3, camera_model: OPENCV_FISHEYE}",
            "camera_model OPENCV_FISHEYE is not known; known are pinhole",
        ),
        ("{width: 4, height: 2, focal_length: 3, distortion_model: equidistant}", "equidistant is not known"),
        (
            "{width: 4, height: 2, focal_length: {value: 3, unit: mm}}",
            "focal_length must have the unit px; it has 'mm'",
        ),
        ("{width: 4, height: 2, focal_length: 3, line_delay: 1.0e-5}", "line_delay must be 0"),
    ],
)
def test_a_camera_holds_what_a_camera_can_have(tmp_path: Path, content: str, words: str) -> None:
    (tmp_path / "K.yaml").write_text(content)
    with pytest.raises(InputError, match=words):
        read_camera(tmp_path / "K.yaml")


def test_a_camera_of_the_catalogue_looks_where_its_mount_says(tmp_path: Path) -> None:
    entry = Path("catalogs/cameras/dashcam-480x320.yaml").read_text()
    (tmp_path / "K.yaml").write_text(entry + "pitch_down: {value: 5, unit: deg, source: tilted}\n")
    ours, theirs = read_camera(tmp_path / "K.yaml"), load("camera", tmp_path / "K.yaml")
    np.testing.assert_allclose(ours.mount, theirs.T_rig_camera)


@pytest.mark.parametrize(
    ("columns", "words"),
    [
        ({"pitch": ["x", "y"]}, "pitch must be of numbers"),
        ({"pitch": [0.0, 1e9]}, r"pitch must be within 3\.142 rad"),
        ({"station": [0.0, float("inf")]}, "finite number of at most"),
        ({"time": [0.0, float("nan")]}, "time must rise"),
        ({"clip_id": ["a", "b"]}, "holds 2 clips"),
    ],
)
def test_a_claim_holds_what_a_drive_can_have(tmp_path: Path, columns: dict, words: str) -> None:
    sound = {"time": [0.0, 1.0], "pitch": [0.0, 0.1], "station": [0.0, 2.0]}
    pq.write_table(pa.table(sound | columns), tmp_path / "claim.parquet")
    with pytest.raises(InputError, match=words):
        read_claim(tmp_path / "claim.parquet")


@pytest.mark.parametrize(
    ("unit", "step", "told"), [(1.0, 0.1, False), (1.0, 0.4, False), (1e3, 0.1, True), (1e3, 1e-3, True)]
)
def test_a_claim_with_its_time_in_ms_is_not_judged_by_its_first_rows(
    unit: float, step: float, told: bool
) -> None:
    """The first 8 of its seconds would be 8 ms of driving, in which nothing happens: any video would pass."""
    time = np.arange(0.0, 8.0, step) * unit
    claim = VideoClaim(time=time, pitch=np.zeros(len(time)), station=time)
    frames = np.arange(80) * 0.1
    if told:
        with pytest.raises(InputError, match=r"The claim has .* rows in the 7\.9 s of the video's 80 frames"):
            sample_claim(claim, frames)
    else:
        assert len(sample_claim(claim, frames).rows) >= 76
