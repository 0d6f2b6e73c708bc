"""Where editors of known behaviour land in `musync lab judge-set`, beside what the metrics' equations say.

The street is ray-cast and not rendered by this project. What drives through it is the paper's vehicle; what the editors
do is simple enough that every figure can be computed without a picture: grade colours, add noise, answer late, warp the
road, or code again.
"""

import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from catalogs.entries import load
from catalogs.scenario import Scenario
from flows.making.driving import simulate_drive
from flows.store.layout import write_json
from studies.evaluation.metrics.video_motion import PAPER_OPENING, geometry_error
from studies.synthetic_street import camera_matrix, make_mount, render_clip, rig_poses
from studies.video_sets.judge_set import format_cell, judge_video_set
from tasks.eval.body_agreement import rms

WIDTH, HEIGHT, FOCAL = 480, 320, 400.0
FRAMES, WEATHER_HZ, GEOMETRY_HZ = 81, 10.0, 16.0
LATE, NOISE, WARP_PX = 4, 12.0, 2.0
"""Frames that the late editor is behind, deviation of the noise [1 of 255], amplitude of the warp [px]."""
LEVELS = {
    "sunny": {},
    "rain-50": {"weather": "rain", "precipitation_mm_h": 50.0},
    "snow-3": {"weather": "snow", "precipitation_mm_h": 3.0, "snow_accumulation_h": 1.0},
}
FEATURES = {
    "hump": {"hazard_center_m": 25.0, "hazard_length_m": 0.6, "hazard_height_m": 0.10},
    "depression": {"hazard_center_m": 25.7, "hazard_length_m": 2.0, "hazard_height_m": -0.08},
}
STOP = {"initial_speed_km_h": 60.0, "peak_pressure_mpa": 2.3, "brake_onset_s": 1.0}
GRADES = {"sunny": (1.0, 0.0), "rain-50": (0.6, 10.0), "snow-3": (0.7, 70.0)}
"""Gain and offset of the colours in each weather [1], [1 of 255]."""

Frames = NDArray[np.uint8]


@dataclass(frozen=True, kw_only=True)
class Motion:
    """Motion of one drive at its frames: station [m], heave [m] and pitch [rad]."""

    rate: float
    station: NDArray[np.float64]
    heave: NDArray[np.float64]
    pitch: NDArray[np.float64]

    def delay(self, frames: int) -> "Motion":
        """The same motion some frames later, standing where it began until then."""
        shown = np.maximum(np.arange(FRAMES) - frames, 0)
        return Motion(
            rate=self.rate, station=self.station[shown], heave=self.heave[shown], pitch=self.pitch[shown]
        )

    @property
    def progress(self) -> NDArray[np.float64]:
        """Station from 0 to 1 [1]."""
        return (self.station - self.station[0]) / np.ptp(self.station)


def drive(rate: float, **asked: Any) -> Motion:
    """Motion of the paper's vehicle at the frames of a video."""
    _, ride = simulate_drive(
        Scenario(**asked), load("vehicle", "paper-reference"), load("surface", "dense-asphalt"), "paper", 9.0
    )
    ticks = np.rint(np.arange(FRAMES) * 1000 / rate).astype(int)
    station, heave, pitch = (ride.columns[name][ticks] for name in ("station", "heave", "pitch"))
    return Motion(rate=rate, station=station, heave=heave, pitch=pitch)


def film(motion: Motion) -> Frames:
    """Return what a camera sees of the ray-cast street."""
    K = camera_matrix(WIDTH, HEIGHT, FOCAL)
    return render_clip(motion.station, motion.heave, motion.pitch, K=K, width=WIDTH, height=HEIGHT).frames


def mask_feature(motion: Motion, feature: dict[str, float]) -> NDArray[np.bool_]:
    """Pixels of the road within a feature's length and 3 m of the middle, bool [F, H, W]."""
    K = camera_matrix(WIDTH, HEIGHT, FOCAL)
    poses = rig_poses(motion.station, motion.heave, motion.pitch) @ make_mount()
    near, far = (feature["hazard_center_m"] + side * feature["hazard_length_m"] / 2 for side in (-1, 1))
    corners = np.array([[near, -3, 0], [near, 3, 0], [far, 3, 0], [far, -3, 0]], np.float64)
    masks = np.zeros((FRAMES, HEIGHT, WIDTH), np.uint8)
    for k, pose in enumerate(poses):
        seen = (corners - pose[:3, 3]) @ pose[:3, :3]
        if seen[:, 2].min() > 1.0:
            points = (seen / seen[:, 2:]) @ K.T
            cv2.fillConvexPoly(masks[k], points[:, :2].round().astype(np.int32), 1)
    return masks > 0


def grade(frames: Frames, weather: str) -> Frames:
    """Frames with the colours of a weather."""
    gain, offset = GRADES[weather]
    return np.clip(frames * gain + offset, 0, 255).astype(np.uint8)


def add_noise(frames: Frames, seed: int) -> Frames:
    """Frames with noise of their own each."""
    draw = np.random.Generator(np.random.Philox(seed))
    return np.clip(frames + draw.normal(0, NOISE, frames.shape), 0, 255).astype(np.uint8)


def warp_road(frames: Frames) -> Frames:
    """Frames whose road swims: below the horizon each row is shifted up and down by a wave that runs with time."""
    height, width = frames.shape[1:3]
    y, x = np.mgrid[:height, :width].astype(np.float32)
    road = np.clip((y - 0.55 * height) / (0.1 * height), 0, 1)
    return np.stack([
        cv2.remap(frame, x, y + WARP_PX * road * np.sin(0.6 * k + y / 15), cv2.INTER_LINEAR,
                  borderMode=cv2.BORDER_REPLICATE)
        for k, frame in enumerate(frames)
    ])  # fmt: skip


def paint(frames: Frames, mask: NDArray[np.bool_]) -> Frames:
    """Frames with a pale patch where a feature is prescribed."""
    return np.where(mask[..., None], frames // 2 + 110, frames).astype(np.uint8)


def write_video(path: Path, frames: Frames, rate: float, codec: str = "FFV1") -> None:
    """Write frames, without loss unless another codec is named."""
    path.parent.mkdir(parents=True, exist_ok=True)
    height, width = frames.shape[1:3]
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*codec), rate, (width, height))
    if not writer.isOpened():
        raise RuntimeError(f"{path}: OpenCV cannot write {codec} here")
    for frame in frames:
        writer.write(cv2.cvtColor(frame, cv2.COLOR_RGB2BGR))
    writer.release()


def write_set(folder: Path) -> dict[str, dict[str, float]]:
    """Write the set; return what the equations say of each editor, without smoothing."""
    stops = {name: drive(WEATHER_HZ, **STOP, **level) for name, level in LEVELS.items()}
    slow = {"initial_speed_km_h": 40.0}
    passes = {name: drive(GEOMETRY_HZ, **slow, **feature) for name, feature in FEATURES.items()}
    flat = drive(GEOMETRY_HZ, **slow)
    for name, motion in {**{f"weather/{n}": m for n, m in stops.items()},
                         **{f"geometry/{n}": m for n, m in passes.items()}}.items():  # fmt: skip
        place = folder / f"claims/{name}.parquet"
        place.parent.mkdir(parents=True, exist_ok=True)
        times = np.arange(FRAMES) / motion.rate
        pq.write_table(pa.table({"time": times, "pitch": motion.pitch, "station": motion.station}), place)
    (folder / "camera.yaml").write_text(
        f"width: {WIDTH}\nheight: {HEIGHT}\nfx: {FOCAL}\nfy: {FOCAL}\n"
        f"cx: {(WIDTH - 1) / 2}\ncy: {(HEIGHT - 1) / 2}\n"
    )
    sunny, plain = film(stops["sunny"]), film(flat)
    masks = {name: mask_feature(flat, feature) for name, feature in FEATURES.items()}
    for name, mask in masks.items():
        write_video(
            folder / f"targets/{name}.avi", np.repeat(mask[..., None] * np.uint8(255), 3, 3), GEOMETRY_HZ
        )
    kept = {"braking": sunny}
    for name, feature in FEATURES.items():
        kept[name] = film(drive(WEATHER_HZ, **STOP, **feature))
    for name, frames in kept.items():
        write_video(folder / f"source/preservation/sunny-{name}.avi", frames, WEATHER_HZ)

    def write_edits(
        model: str, seed: int, edit: Callable[[Frames, str], Frames], codec: str = "FFV1"
    ) -> None:
        """Write what an editor makes of the sources, whatever the car should do."""
        place = folder / f"models/{model}/seed-{seed}"
        suffix = "avi" if codec == "FFV1" else "mp4"
        for name in LEVELS:
            write_video(place / f"weather/{name}.{suffix}", edit(sunny, name), WEATHER_HZ, codec)
        write_video(place / f"geometry/flat.{suffix}", edit(plain, "sunny"), GEOMETRY_HZ, codec)
        for name, mask in masks.items():
            write_video(
                place / f"geometry/{name}.{suffix}", paint(edit(plain, "sunny"), mask), GEOMETRY_HZ, codec
            )
        for name, frames in kept.items():
            write_video(
                place / f"preservation/sunny-{name}.{suffix}", edit(frames, "sunny"), WEATHER_HZ, codec
            )

    write_edits("graded", 2025, grade)
    for seed in (2025, 2026):
        write_edits("noisy", seed, lambda frames, _, seed=seed: add_noise(frames, seed))
    write_edits("warped-road", 2025, lambda frames, name: frames if name == "sunny" else warp_road(frames))
    write_edits("recoded", 2025, lambda frames, _: frames, codec="mp4v")
    for model, behind in (("synchronised", 0), ("late", LATE)):
        place = folder / f"models/{model}/seed-2025"
        for name, motion in stops.items():
            late = motion.delay(behind if name != "sunny" else 0)
            write_video(place / f"weather/{name}.avi", grade(film(late), name), WEATHER_HZ)
        write_video(place / "geometry/flat.avi", plain, GEOMETRY_HZ)
        for name, motion in passes.items():
            late = motion.delay(behind)
            painted = paint(film(late), mask_feature(late, FEATURES[name]))
            write_video(place / f"geometry/{name}.avi", painted, GEOMETRY_HZ)
    return expect_figures(stops, passes)


def expect_figures(stops: dict[str, Motion], passes: dict[str, Motion]) -> dict[str, dict[str, float]]:
    """Return the figures that the equations of Appendix A.5 give for the editors' motion, without any picture."""
    dry = stops["sunny"].progress
    wet = [motion for name, motion in stops.items() if name != "sunny"]
    times = np.arange(FRAMES) / GEOMETRY_HZ

    def error(motion: Motion, behind: int) -> float:
        return geometry_error(times, motion.delay(behind).pitch, motion.pitch, PAPER_OPENING, None)

    still = {f"e_geometry_{name}": 1.0 for name in passes}
    unmoved = {"e_weather": float(np.mean([rms(m.progress - dry) for m in wet])), **still, "e_path": 0.0}
    return {
        "synchronised": {"e_weather": 0.0, **dict.fromkeys(still, 0.0), "e_path": 0.0},
        "late": {
            "e_weather": float(np.mean([rms(m.delay(LATE).progress - m.progress) for m in wet])),
            **{f"e_geometry_{name}": error(motion, LATE) for name, motion in passes.items()},
            "e_path": 0.0,
        },
        **{
            name: unmoved | {"motion_retention": 1.0}
            for name in ("graded", "noisy", "recoded", "warped-road")
        },
    }


def main(folder: Path) -> None:
    """Make the set, judge it, and print every figure beside what the equations say."""
    expected = write_set(folder / "set")
    result = judge_video_set(str(folder / "set"), out=str(folder / "judged"), window=0)
    rows = []
    for row in result["table"]:
        if row["by"] == "measured":
            for metric, value in expected[row["model"]].items():
                found = row[metric]
                rows.append({"model": row["model"], "metric": metric, "expected": value,
                             "measured": None if found is None else found["mean"]})  # fmt: skip
                print(f"{row['model']:13s} {metric:24s} expected {value:8.4f}  measured {format_cell(found)}")
            for metric in ("localised_edit_rate", "temporal_iou", "anchor_error"):
                print(f"{row['model']:13s} {metric:24s} measured {format_cell(row[metric])}")
    write_json(folder / "editors.json", {"rows": rows, "table": result["table"]})


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "datasets/editors"))
