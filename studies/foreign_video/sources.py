"""Footage and its camera, read from files of others, for the judge of foreign videos."""

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from catalogs.documents import LARGEST_YAML, parse_yaml, read_content
from catalogs.sentences import cap_problems, shorten, shorten_value
from studies.foreign_video.film_length import READ_ONLY, measure_missing_end
from studies.foreign_video.outside_trajectory import motion_from_trajectory
from studies.foreign_video.trajectories import SUFFIXES, read_trajectory
from tasks.errors import InputError
from tasks.eval.poses.essential import recover_motion_essential
from tasks.eval.poses.motion import RecoveredMotion
from tasks.eval.poses.resampling import COEFFICIENTS, undistort_frames

MOST_FRAMES, LEAST_FRAMES = 3000, 5
MOST_PIXELS = 960 * 540
"""Size that frames are judged at; larger ones are reduced by area, so that the longest video fills 5 GB."""
LARGEST_CAMERA = 1e6
"""Greatest number of a camera's file [px, m or 1]."""
MISSING_FRAMES = 3
"""Frames that may be missing at an end [1]: containers round their length."""
MOUNT = ("behind_front_axle", "left_of_centre", "height_above_road", "pitch_down")
UNITS = (
    dict.fromkeys(("width", "height", "focal_length", "fx", "fy", "cx", "cy"), "px")
    | dict.fromkeys(COEFFICIENTS, "1")
    | dict.fromkeys(MOUNT[:3], "m")
    | {"pitch_down": "deg", "name": "", "exposure": "s", "exposure_compensation": "EV", "full_well": "e-"}
    | {"read_noise": "e-", "line_delay": "s", "motion_blur": ""}
)
"""Keys of a camera's file and their units: those that a film is judged by, and those that only making one takes."""
MODEL_KEYS = ("camera_model", "distortion_model", "model")
MODELS = ("pinhole", "simple_pinhole", "opencv", "radtan", "plumb_bob")
"""Models of a lens that have the coefficients of Brown and Conrady, or none."""
REMEDY = "give a camera in these keys, and undistort a video of any other lens to a pinhole first"
CHUNK = 64
"""Frames that are undistorted at once."""
LEVEL = np.array([[0.0, 0.0, 1.0, 0.0], [-1.0, 0.0, 0.0, 0.0], [0.0, -1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
"""A camera that looks level ahead, for a camera file without a mount."""


@dataclass(frozen=True, kw_only=True)
class ForeignCamera:
    """The camera of a video.

    Parameters
    ----------
    K : float64 [3, 3] intrinsics, pixel centres at whole numbers [px]
    width, height : the size they hold for [px]
    mount : float64 [4, 4] T_rig_camera [m]
    distortion : float64 [5] k1, k2, p1, p2, k3 as OpenCV has them; None without [1]
    """

    K: NDArray[np.float64]
    width: int
    height: int
    mount: NDArray[np.float64]
    distortion: NDArray[np.float64] | None


@dataclass(frozen=True, kw_only=True)
class Footage:
    """A video, or the camera trajectory that somebody recovered from one.

    Parameters
    ----------
    name : of the file
    times : float64 [F] from 0 [s]
    frames : uint8 [F, H, W, 3] sRGB at the size that is judged; None for a trajectory
    poses : float64 [F, 4, 4] camera to world [m]; None for a video
    width, height : of the video as it is stored [px]; None for a trajectory
    """

    name: str
    times: NDArray[np.float64]
    frames: NDArray[np.uint8] | None
    poses: NDArray[np.float64] | None
    width: int | None = None
    height: int | None = None

    def motion(
        self, camera: ForeignCamera, rows: NDArray[np.int64] | None = None, *, metric: bool = False
    ) -> RecoveredMotion:
        """Return the ego motion: recovered by the essential chain from a video, or read from a trajectory.

        Parameters
        ----------
        camera : of the footage
        rows : the frames to use; None for all
        metric : whether a trajectory's lengths are metres

        Raises
        ------
        InputError
            If the intrinsics cannot be those of the video.
        """
        used = slice(None) if rows is None else _as_slice(rows)
        if self.frames is None:
            assert self.poses is not None
            name = Path(self.name).stem
            return motion_from_trajectory(
                name, self.times[used], self.times, self.poses, camera.mount, metric=metric
            )
        height, width = self.frames.shape[1:3]
        K = scale_intrinsics(camera, width, height)
        seen = self.frames[used]
        if camera.distortion is not None:
            bent, seen = seen, np.empty_like(seen)
            for first in range(0, len(bent), CHUNK):
                part = slice(first, first + CHUNK)
                seen[part] = undistort_frames({"rgb": bent[part]}, K, camera.distortion)["rgb"]
        return recover_motion_essential(seen, K, camera.mount)


def _as_slice(rows: NDArray[np.int64]) -> slice | NDArray[np.int64]:
    """Rows in a row as a slice, which copies no frame."""
    in_a_row = len(rows) > 0 and bool((np.diff(rows) == 1).all())
    return slice(int(rows[0]), int(rows[-1]) + 1) if in_a_row else rows


def read_footage(path: Path) -> Footage:
    """A video, or a trajectory by its suffix.

    Raises
    ------
    InputError
        If the file cannot be read.
    """
    if path.suffix in SUFFIXES:
        times, poses = read_trajectory(path)
        return Footage(name=path.name, times=times - times[0], frames=None, poses=poses)
    frames, times, (width, height) = read_video(path)
    return Footage(name=path.name, times=times, frames=frames, poses=None, width=width, height=height)


def read_video(path: Path) -> tuple[NDArray[np.uint8], NDArray[np.float64], tuple[int, int]]:
    """Frames [F, H, W, 3] sRGB, at most `MOST_PIXELS` each, their times [s], and the stored width and height [px].

    Raises
    ------
    InputError
        If there is no such file, it is no video, breaks off, or has too few or too many frames.
    """
    if not path.is_file():
        raise InputError(f"{path}: no such file; give a video.")
    if path.stat().st_size == 0:
        raise InputError(f"{path}: the file is empty; give a video.")
    os.environ["OPENCV_FFMPEG_CAPTURE_OPTIONS"] = "|".join(";".join(pair) for pair in READ_ONLY.items())
    stream = cv2.VideoCapture(str(path), cv2.CAP_FFMPEG)
    rate = stream.get(cv2.CAP_PROP_FPS)
    # an estimate where the container holds no number of frames, so that it only says how much room to take first
    expected = int(stream.get(cv2.CAP_PROP_FRAME_COUNT))
    frames, size = np.empty((0, 0, 0, 3), np.uint8), (0, 0)
    stamps: list[float] = []
    while len(stamps) <= MOST_FRAMES:
        good, picture = stream.read()
        if not good:
            break
        count = len(stamps)
        if count == 0:
            size = picture.shape[1], picture.shape[0]
            room = expected + 1 if 0 < expected < MOST_FRAMES else MOST_FRAMES + 1
            frames = np.empty((room, *_judged_size(*size)[::-1], 3), np.uint8)
        elif count == len(frames):
            frames = np.concatenate((frames, np.empty_like(frames)))
        height, width = frames.shape[1:3]
        if (width, height) != size:
            picture = cv2.resize(picture, (width, height), interpolation=cv2.INTER_AREA)
        cv2.cvtColor(picture, cv2.COLOR_BGR2RGB, dst=frames[count])
        stamps.append(stream.get(cv2.CAP_PROP_POS_MSEC))
    stream.release()
    if not stamps:
        raise InputError(f"{path}: no frame can be read; the file is damaged or no video.")
    if len(stamps) > MOST_FRAMES:
        raise InputError(f"{path}: at most {MOST_FRAMES} frames are judged at once; cut the video.")
    if len(stamps) < LEAST_FRAMES:
        raise InputError(f"{path}: at least {LEAST_FRAMES} frames are needed; there are {len(stamps)}.")
    times = _read_times(path, np.asarray(stamps) / 1000, rate)
    missing = measure_missing_end(path)
    steps = np.diff(times)
    if missing > max(MISSING_FRAMES * np.median(steps), steps.max()):
        raise InputError(
            f"{path}: only {len(stamps)} frames can be read, and {missing:.2f} s of what the file announces cannot;"
            " the file breaks off."
        )
    return frames[: len(stamps)], times, size


def _read_times(path: Path, times: NDArray[np.float64], rate: float) -> NDArray[np.float64]:
    """Times of frames from 0 [s]: their stamps, or, where a container has none, by the rate [Hz]."""
    if times.min() == times.max():
        if not rate > 0:
            raise InputError(f"{path}: the video has neither time stamps nor a frame rate.")
        return np.arange(len(times)) / rate
    if not (np.diff(times) > 0).all():
        late = int((np.diff(times) <= 0).argmax()) + 1
        raise InputError(
            f"{path}: the time must rise from frame to frame; frame {late} is at {times[late]:.3f} s and the one before"
            f" at {times[late - 1]:.3f} s: was the file joined of several? Write it anew."
        )
    return times - times[0]


def _judged_size(width: int, height: int) -> tuple[int, int]:
    """Width and height that a video is judged at [px]: its own up to `MOST_PIXELS`, else of the same shape."""
    scale = min(1.0, float(np.sqrt(MOST_PIXELS / (width * height))))
    return int(scale * width), int(scale * height)


def read_camera(path: Path) -> ForeignCamera:
    """The camera of a video from YAML: focal_length or fx, fy, cx, cy; width and height; mount and distortion.

    Raises
    ------
    InputError
        If the file cannot be read, lacks a number, or states what no film is judged by.
    """
    content = parse_yaml(read_content(path, "camera", LARGEST_YAML), path, "camera")
    wrong = [f"{path}: {problem}." for problem in _find_unknown(content)]
    numbers: dict[str, Any] = {k: v.get("value") if isinstance(v, dict) else v for k, v in content.items()}
    if "focal_length" in numbers and _is_number(numbers.get("width")) and _is_number(numbers.get("height")):
        f = numbers["focal_length"]
        centre = {"cx": numbers["width"] / 2 - 0.5, "cy": numbers["height"] / 2 - 0.5}
        numbers = {"fx": f, "fy": f} | centre | numbers
    wrong += [
        f"{path}: the camera's {key} must be a number of {least} to {LARGEST_CAMERA:g};"
        f" it is {shorten_value(numbers.get(key))}."
        for key, least in (("width", 1), ("height", 1), ("fx", 1e-3), ("fy", 1e-3), ("cx", 0.0), ("cy", 0.0))
        if not _is_number(numbers.get(key), least)
    ]
    rest = {key: 0.0 if numbers.get(key) is None else numbers[key] for key in (*COEFFICIENTS, *MOUNT)}
    wrong += [
        f"{path}: the camera's {key} must be a number within +-{LARGEST_CAMERA:g}; it is {shorten_value(value)}."
        for key, value in rest.items()
        if not _is_number(value, -LARGEST_CAMERA)
    ]
    if wrong:
        raise InputError(cap_problems(wrong))
    K = np.array(
        [[numbers["fx"], 0, numbers["cx"]], [0, numbers["fy"], numbers["cy"]], [0, 0, 1]], np.float64
    )
    mount = LEVEL.copy()
    mount[:3, :3] = Rotation.from_euler("y", rest["pitch_down"], degrees=True).as_matrix() @ mount[:3, :3]
    mount[:3, 3] = -rest["behind_front_axle"], rest["left_of_centre"], rest["height_above_road"]
    bends = [rest[key] for key in COEFFICIENTS]
    return ForeignCamera(
        K=K,
        width=int(numbers["width"]),
        height=int(numbers["height"]),
        mount=mount,
        distortion=np.array(bends, np.float64) if any(bends) else None,
    )


def _find_unknown(content: dict[str, Any]) -> list[str]:
    """What a camera's file states that no film is judged by here, or in another unit than it has here."""
    problems = []
    for key, value in content.items():
        number = value.get("value") if isinstance(value, dict) else value
        if key in MODEL_KEYS and str(value).lower() not in MODELS:
            problems.append(f"{key} {value} is not known; known are {', '.join(MODELS)}: {REMEDY}")
        elif key not in (*UNITS, *MODEL_KEYS):
            problems.append(f"{key}: no such key; a lens has {', '.join(COEFFICIENTS)}: {REMEDY}")
        elif key == "line_delay" and number:
            problems.append(
                "line_delay must be 0: the rows of a rolling shutter are not put right in a video; leave it out to"
                " judge them as one"
            )
        elif isinstance(value, dict):
            if unknown := sorted(map(str, value.keys() - {"value", "unit", "source"})):
                problems.append(f"{key} has value, unit and source; {', '.join(unknown)} is not known")
            if (unit := value.get("unit", UNITS[key])) != UNITS[key]:
                problems.append(f"{key} must have the unit {UNITS[key]}; it has {shorten_value(unit)}")
    return [shorten(problem, 300) for problem in problems]


def _is_number(value: Any, least: float = 0.0) -> bool:
    number = isinstance(value, int | float) and not isinstance(value, bool)
    return number and bool(least <= value <= LARGEST_CAMERA)


def scale_intrinsics(camera: ForeignCamera, width: int, height: int) -> NDArray[np.float64]:
    """Intrinsics [3, 3] for a video that was scaled from the camera's size [px].

    Parameters
    ----------
    camera : at its own size
    width, height : of the video [px]

    Raises
    ------
    InputError
        If the video was cropped or squeezed: then they are unknown.
    """
    across, down = width / camera.width, height / camera.height
    if abs(across / down - 1) > 0.02:
        raise InputError(
            f"The video is {width} x {height} and the camera {camera.width} x {camera.height}: not the same shape,"
            " so the intrinsics are unknown; give the camera of the video as it is."
        )
    scaled = camera.K.copy()
    scaled[:2, 2] += 0.5
    scaled[0] *= across
    scaled[1] *= down
    scaled[:2, 2] -= 0.5
    return scaled
