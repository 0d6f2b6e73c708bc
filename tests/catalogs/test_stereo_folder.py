"""Stereo folders: what is read, and that every problem of a bad one is named at once."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from catalogs.scenes.stereo_folder import read_stereo_folder
from tasks.errors import InputError

LEFT_P = "700 0 60 0 0 700 40 0 0 0 1 0"
RIGHT_P = "700 0 60 -350 0 700 40 0 0 0 1 0"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "calib.txt").write_text(f"{LEFT_P}\n{RIGHT_P}")
    poses = ["1 0 0 0 0 1 0 0 0 0 1 " + str(0.5 * i) for i in range(4)]
    (tmp_path / "poses.txt").write_text("\n".join(poses) + "\n")
    for side in ("image_l", "image_r"):
        (tmp_path / side).mkdir()
        for i in range(4):
            cv2.imwrite(str(tmp_path / side / f"{i:06d}.png"), np.full((80, 120), 10 * i, np.uint8))
    return tmp_path


def test_a_sequence_is_read_as_it_lies_there(folder: Path) -> None:
    sequence = read_stereo_folder(folder)
    assert sequence.left.shape == sequence.right.shape == (4, 80, 120, 3)
    assert sequence.baseline == 0.5
    assert sequence.disparity_scale == 350.0
    np.testing.assert_array_equal(sequence.intrinsics, [[700, 0, 60], [0, 700, 40], [0, 0, 1]])
    np.testing.assert_array_equal(sequence.T_origin_camera[:, 2, 3], [0, 0.5, 1.0, 1.5])
    assert [int(p[0, 0, 0]) for p in sequence.left] == [0, 10, 20, 30]


def test_colours_are_read_as_red_green_blue(folder: Path) -> None:
    blue = np.zeros((80, 120, 3), np.uint8)
    blue[..., 0] = 255  # OpenCV writes blue first
    cv2.imwrite(str(folder / "image_l" / "000000.png"), blue)
    assert read_stereo_folder(folder).left[0, 0, 0].tolist() == [0, 0, 255]


def test_the_baseline_is_that_between_the_two_cameras_wherever_their_origin_is(folder: Path) -> None:
    """KITTI's colour cameras are measured from the left grey one: 0.06 m and -0.47 m from it, 0.53 m apart."""
    (folder / "calib.txt").write_text(
        LEFT_P.replace("60 0", "60 42", 1) + "\n" + RIGHT_P.replace("-350", "-329")
    )
    assert read_stereo_folder(folder).baseline == 0.53


def test_a_picture_that_lacks_on_each_side_does_not_shift_the_pairs(folder: Path) -> None:
    for side, name in (("image_l", "000000"), ("image_r", "000003")):
        (folder / side / f"{name}.png").unlink()
    (folder / "poses.txt").write_text("1 0 0 0 0 1 0 0 0 0 1 0\n" * 3)
    assert "000001.png and 000000.png and 2 more do not" in problems_of(folder)


def test_pairs_may_name_their_cameras(folder: Path) -> None:
    for side, camera in (("image_l", "cam2"), ("image_r", "cam3")):
        for path in (folder / side).iterdir():
            path.rename(path.with_name(f"{camera}_{path.name}"))
    assert read_stereo_folder(folder).left.shape == (4, 80, 120, 3)


def problems_of(folder: Path) -> str:
    with pytest.raises(InputError) as caught:
        read_stereo_folder(folder)
    return "\n".join(caught.value.problems)


def test_every_problem_is_named_at_once(folder: Path) -> None:
    (folder / "calib.txt").write_text(f"{RIGHT_P}\n{LEFT_P}\n")
    (folder / "poses.txt").write_text("1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 nan 0 1 0 0 0 0 1 0\n")
    (folder / "image_l" / "000003.png").write_bytes(b"no picture")
    (folder / "image_r" / "000003.png").unlink()
    (folder / "image_r" / "000002.png").unlink()
    text = problems_of(folder)
    for part in ("to the right", "row 2", "cannot be decoded", "must pair up; they hold 3 and 2"):
        assert part in text


@pytest.mark.parametrize(
    ("name", "content", "part"),
    [
        ("poses.txt", "1 2 3\n", "twelve finite numbers; row 1 is '1 2 3'"),
        ("poses.txt", "", "it is empty"),
        ("poses.txt", "2 0 0 0 0 1 0 0 0 0 1 0\n" * 4, "4 are not, the first is row 1"),
        ("poses.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n" * 3, "it has 3 for 4"),
        ("calib.txt", LEFT_P, "it has 1 row"),
        ("calib.txt", f"P0: {LEFT_P}\nP1: {RIGHT_P}\nP2: {LEFT_P}\nP3: {RIGHT_P}\n", "it has 4 rows"),
        ("calib.txt", f"{LEFT_P}\n{RIGHT_P.replace('700', '701')}", "rows 1 and 2 differ"),
        ("calib.txt", f"{LEFT_P.replace('700', '0')}\n{RIGHT_P}", "focal lengths must be positive"),
    ],
)
def test_a_bad_file_is_named_with_its_value(folder: Path, name: str, content: str, part: str) -> None:
    (folder / name).write_text(content)
    text = problems_of(folder)
    assert part in text
    assert name in text


def test_a_missing_file_and_sizes_that_differ_are_named(folder: Path) -> None:
    (folder / "poses.txt").unlink()
    cv2.imwrite(str(folder / "image_r" / "000001.png"), np.zeros((80, 100), np.uint8))
    text = problems_of(folder)
    assert "poses.txt" in text
    assert "100 x 80, 120 x 80" in text


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda b: b[:18], "cannot be decoded"),
        (lambda b: b[:16] + b"\x7f\xff\xff\xff" * 2 + b[24:], "2147483647 x 2147483647 pixels"),
        (lambda b: b[:30] + b"damaged", "cannot be decoded"),
    ],
)
def test_a_picture_that_is_cut_or_of_no_camera_s_size_is_refused_before_it_is_decoded(folder, change, words):
    path = folder / "image_r" / "000001.png"
    path.write_bytes(change(path.read_bytes()))
    assert words in problems_of(folder)
