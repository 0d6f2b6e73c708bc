"""Pictures before the brake, the brake command, and the deceleration that follows: samples, and how they are split."""

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace

import numpy as np
import torch
from numpy.typing import NDArray

import musync

FRAMES = 3
"""Pictures of one sample [1]."""
WINDOWS = 4
"""Samples of one clip at most [1]."""
OVER_S = 1.5
"""The deceleration is the mean over this time from the brake onset on [s]."""
DRIVE = ["initial_speed_km_h", "peak_pressure_mpa", "brake_onset_m", "brake_onset_s"]
"""Controls that make a drive: clips that share them differ in the weather alone."""


@dataclass(frozen=True, kw_only=True)
class Samples:
    """Samples in the order of the dataset; every field has a row a sample.

    Parameters
    ----------
    pictures : uint8 [sample, frame x channel, y, x], all taken before the brake onset
    command : speed before the brake [m/s], brake pressure after the ramp [MPa]
    deceleration : mean over ``OVER_S`` from the brake onset on [m/s2]
    drive : number of the drive [1]
    weather, split, clip : kind of weather, split of the grid, label of the clip
    rate : precipitation [mm/h]
    """

    pictures: torch.Tensor
    command: NDArray[np.float64]
    deceleration: NDArray[np.float64]
    drive: NDArray[np.int64]
    weather: NDArray[np.str_]
    split: NDArray[np.str_]
    clip: NDArray[np.str_]
    rate: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.deceleration)

    def take(self, rows: NDArray[np.bool_]) -> "Samples":
        """Return the samples of some rows."""
        return replace(self, **{field.name: getattr(self, field.name)[rows] for field in fields(self)})


@dataclass(frozen=True, kw_only=True)
class Brake:
    """How a clip brakes.

    Parameters
    ----------
    onset_s : when [s]
    speed : then [m/s]
    deceleration : mean from then on, over the time that was asked for [m/s2]
    """

    onset_s: float
    speed: float
    deceleration: float


def read_brakes(data: musync.Dataset, *, over_s: float = OVER_S) -> dict[str, Brake]:
    """Return how each clip brakes, by its label; clips that never do are left out.

    Parameters
    ----------
    data : dataset, with frames or without
    over_s : time over which the deceleration is averaged [s]

    Raises
    ------
    InputError
        If the telemetry of a clip ends before that time.
    """
    brakes, short = {}, []
    for clip in data.pandas("clips").sort_values("index").to_dict("records"):
        ticks = data.pandas("ticks", ["t_ns", "speed", "brake_pressure_mpa"], clip=clip["clip_id"])
        pressed = np.flatnonzero(ticks["brake_pressure_mpa"].to_numpy() > 0)
        if not len(pressed):
            continue
        seconds, speed = ticks["t_ns"].to_numpy() * 1e-9, ticks["speed"].to_numpy()
        onset = seconds[pressed[0]]
        if onset + over_s > seconds[-1] + 1e-9:
            short.append(clip["label"])
            continue
        start, end = np.interp([onset, onset + over_s], seconds, speed)
        brakes[clip["label"]] = Brake(onset_s=onset, speed=start, deceleration=(start - end) / over_s)
    if short:
        raise musync.InputError(
            f"the telemetry must reach {over_s:g} s past the brake onset; that of {len(short)} clips"
            f" ({', '.join(short[:3])}) ends before: give the grid a longer duration_s"
        )
    return brakes


def read_samples(
    data: musync.Dataset, *, over_s: float = OVER_S, frames: int = FRAMES, most: int = WINDOWS
) -> Samples:
    """Read the samples of every clip that brakes and has enough frames before.

    Clips in quarantine are taken too: the pose check wants more pixels than these pictures have, and nothing is
    recovered from them here.

    Parameters
    ----------
    data : dataset with frames
    over_s : time over which the deceleration is averaged [s]
    frames : pictures of one sample [1]
    most : samples of one clip, each a frame earlier than the one before [1]

    Raises
    ------
    InputError
        If the telemetry of a clip ends before that time, or no clip has a sample.
    """
    clips = data.pandas("clips").sort_values("index")
    drives = clips.groupby(DRIVE, dropna=False, sort=True).ngroup().to_numpy()
    windows = data.torch(window=frames, stride=1, columns=["speed"], arrays=["rgb"], quarantined=True)
    rate_hz = data.manifest["grid"]["frame_rate_hz"]
    brakes = read_brakes(data, over_s=over_s)
    rows, pictures = [], []
    for clip, drive in zip(clips.to_dict("records"), drives, strict=True):
        if (brake := brakes.get(clip["label"])) is None:
            continue
        last = min(
            int(brake.onset_s * rate_hz), windows.starts[-1] + frames - 1
        )  # the last frame before the onset
        for first in range(last - frames + 1, max(last - frames + 1 - most, -1), -1):
            shown = windows[windows.clips.index(clip["index"]) * len(windows.starts) + first]["rgb"]
            pictures.append(shown.permute(0, 3, 1, 2).flatten(0, 1))
            rows.append({
                "command": (brake.speed, clip["peak_pressure_mpa"]), "deceleration": brake.deceleration,
                "drive": drive, "weather": clip["weather"], "split": clip["split"], "clip": clip["label"],
                "rate": clip["precipitation_mm_h"],
            })  # fmt: skip
    if not rows:
        raise musync.InputError(f"a sample needs {frames} frames before a brake onset; no clip has them")
    return Samples(
        pictures=torch.stack(pictures), **{name: np.array([row[name] for row in rows]) for name in rows[0]}
    )


def split_samples(samples: Samples) -> tuple[Samples, Samples]:
    """Return the samples to train with and those to test with, which share no drive.

    Parameters
    ----------
    samples : of both splits

    Raises
    ------
    InputError
        If a split has no sample, or a drive stands in both: its street and speed would be known beforehand.
    """
    train, test = (samples.take(samples.split == name) for name in ("train", "test"))
    problems = [
        f"split {name!r} has no sample: the grid's splits must be train and test"
        for name, part in (("train", train), ("test", test))
        if not len(part)
    ]
    if shared := sorted(set(train.drive) & set(test.drive)):
        told = ", ".join(sorted(set(test.clip[np.isin(test.drive, shared)]))[:3])
        problems.append(
            f"{len(shared)} drives are in both splits ({told}): split by speed, pressure or brake onset,"
            " not by weather"
        )
    if problems:
        raise musync.InputError(problems)
    return train, test


def relabel_samples(samples: Samples, brakes: Mapping[str, Brake]) -> Samples:
    """Return the same pictures with the deceleration of a world that looks the same before the brake.

    Parameters
    ----------
    samples : whose pictures are kept
    brakes : of that world, by label of the clip

    Raises
    ------
    InputError
        If a clip of the samples does not brake there.
    """
    if lacking := sorted(set(samples.clip) - brakes.keys()):
        raise musync.InputError(
            f"both worlds must have the same clips; {len(lacking)} ({', '.join(lacking[:3])}) brake in one alone"
        )
    return replace(samples, deceleration=np.array([brakes[label].deceleration for label in samples.clip]))
