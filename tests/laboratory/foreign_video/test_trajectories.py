"""Reading trajectories in the TUM format, and judging one against a claim."""

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from scipy.spatial.transform import Rotation

from studies.foreign_video.judge import judge_video
from studies.foreign_video.trajectories import read_trajectory, trajectory_files
from studies.synthetic_street import drive_clip
from tasks.errors import InputError

CAMERA = "width: 240\nheight: 160\nfocal_length: 200\n"


def tum_lines(times: np.ndarray, poses: np.ndarray) -> str:
    quaternions = Rotation.from_matrix(poses[:, :3, :3]).as_quat()
    rows = np.column_stack([times, poses[:, :3, 3], quaternions])
    return "# timestamp tx ty tz qx qy qz qw\n" + "\n".join(" ".join(map(repr, row.tolist())) for row in rows)


def test_what_is_written_is_read(tmp_path: Path) -> None:
    times = np.array([1.5, 1.6, 1.9])
    poses = np.tile(np.eye(4), (3, 1, 1))
    poses[:, :3, :3] = Rotation.from_euler("xyz", [[1, 2, 3], [4, 5, 6], [7, 8, 9]]).as_matrix()
    poses[:, :3, 3] = np.arange(9).reshape(3, 3)
    (tmp_path / "t.txt").write_text(tum_lines(times, poses))
    read_times, read_poses = read_trajectory(tmp_path / "t.txt")
    np.testing.assert_array_equal(read_times, times)
    np.testing.assert_allclose(read_poses, poses, atol=1e-15)


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        ("0 1 2 3 0 0 0 1\n1 1 2 3 0 0 0", "line 2 must hold eight numbers"),
        ("0 1 2 3 0 0 0 1\nx 1 2 3 0 0 0 1", "line 2 must hold eight numbers"),
        ("0 1 2 3 0 0 0 2\n1 1 2 3 0 0 0 1", "line 1: the quaternion's length must be 1"),
        ("1 1 2 3 0 0 0 1\n0 1 2 3 0 0 0 1", "times must rise"),
        ("# nothing\n", "at least two poses; there are 0"),
    ],
)
def test_a_faulty_file_is_told_by_line(tmp_path: Path, lines: str, words: str) -> None:
    (tmp_path / "t.txt").write_text(lines)
    with pytest.raises(InputError, match=words):
        read_trajectory(tmp_path / "t.txt")


def test_files_belong_to_clips_by_name(tmp_path: Path) -> None:
    for name in ("vggt/a", "vggt/b", "droid/a"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / f"{name}.txt").touch()
    found = trajectory_files(tmp_path, ["a", "b", "c"])
    assert {clip: sorted(files) for clip, files in found.items()} == {"a": ["droid", "vggt"], "b": ["vggt"]}
    with pytest.raises(InputError, match="belongs to no clip"):
        trajectory_files(tmp_path, ["a"])
    with pytest.raises(InputError, match="holds no METHOD/CLIP_ID"):
        trajectory_files(tmp_path / "vggt", ["a"])


@pytest.mark.parametrize(("factor", "good"), [(1.0, True), (0.7, False), (-1.0, False)])
def test_a_trajectory_is_judged_as_a_video_is(tmp_path: Path, factor: float, good: bool) -> None:
    clip = drive_clip(frames=24, frame_rate=16.0, hump_at=0.2, width=24, height=16, focal=20.0)
    times = np.arange(24) / 16.0
    poses = clip.T_world_rig @ clip.T_rig_camera
    poses[:, :3, 3] *= 0.1
    (tmp_path / "vggt.txt").write_text(tum_lines(times + 100.0, poses))
    (tmp_path / "K.yaml").write_text(CAMERA)
    claim = pa.table({"time": times, "pitch": factor * clip.pitch, "station": clip.station})
    pq.write_table(claim, tmp_path / "claim.parquet")
    result = judge_video(
        str(tmp_path / "vggt.txt"), claim=str(tmp_path / "claim.parquet"), camera=str(tmp_path / "K.yaml")
    )
    assert result["method"] == "vggt" and result["passed"] == good
    assert result["width"] is None and result["frames"] == 24
