"""Pictures before the brake, the brake command, and the deceleration that follows: samples, and how they are split."""

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

import musync
from tasks.conventions import GRAVITY

PICTURES = 4
"""Samples of one clip at most: its last pictures before the brake, one each [1]."""
OVER_S = 1.5
"""The deceleration is the mean over this time from the brake onset on [s]."""
DRIVE = ["initial_speed_km_h", "peak_pressure_mpa", "brake_onset_m", "brake_onset_s"]
"""Controls that make a drive: clips that share them differ in the weather alone."""


@dataclass(frozen=True, kw_only=True)
class Samples:
    """Samples in the order of the dataset; every field has a row a sample.

    Parameters
    ----------
    pictures : uint8 [sample, channel, y, x], each taken before the brake onset
    command : speed before the brake [m/s], brake pressure after the ramp [MPa]
    friction : reference coefficient of the road [1]
    deceleration : mean over ``OVER_S`` from the brake onset on, as on a level road [m/s2]
    drive : number of the drive [1]
    weather, split, clip : kind of weather, split of the grid, label of the clip
    rate : precipitation [mm/h]
    """

    pictures: torch.Tensor
    command: NDArray[np.float64]
    friction: NDArray[np.float64]
    deceleration: NDArray[np.float64]
    drive: NDArray[np.int64]
    weather: NDArray[np.str_]
    split: NDArray[np.str_]
    clip: NDArray[np.str_]
    rate: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.deceleration)

    def take(self, rows: NDArray[Any]) -> "Samples":
        """Return the samples of some rows."""
        return replace(self, **{field.name: getattr(self, field.name)[rows] for field in fields(self)})


@dataclass(frozen=True, kw_only=True)
class Brake:
    """How a clip brakes.

    Parameters
    ----------
    onset_s : when [s]
    speed : then [m/s]
    friction : reference coefficient of the road [1]
    deceleration : mean from then on, over the time that was asked for, less what the road's grade gives [m/s2]
    """

    onset_s: float
    speed: float
    friction: float
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
        ticks = data.pandas(
            "ticks", ["t_ns", "speed", "brake_pressure_mpa", "road_grade"], clip=clip["clip_id"]
        )
        pressed = np.flatnonzero(ticks["brake_pressure_mpa"].to_numpy() > 0)
        if not len(pressed):
            continue
        seconds, speed = ticks["t_ns"].to_numpy() * 1e-9, ticks["speed"].to_numpy()
        onset = seconds[pressed[0]]
        if onset + over_s > seconds[-1] + 1e-9:
            short.append(clip["label"])
            continue
        start, end = np.interp([onset, onset + over_s], seconds, speed)
        braking = (seconds >= onset) & (seconds <= onset + over_s)
        climb = GRAVITY * ticks["road_grade"].to_numpy()[braking].mean()
        brakes[clip["label"]] = Brake(
            onset_s=onset,
            speed=start,
            friction=clip["surface_friction"],
            deceleration=(start - end) / over_s - climb,
        )
    if short:
        raise musync.InputError(
            f"the telemetry must reach {over_s:g} s past the brake onset; that of {len(short)} clips"
            f" ({', '.join(short[:3])}) ends before: give the grid a longer duration_s"
        )
    return brakes


def read_samples(data: musync.Dataset, *, over_s: float = OVER_S) -> Samples:
    """Read the samples of every clip that brakes.

    Clips in quarantine are taken too: the pose check wants more pixels than these pictures have, and nothing is
    recovered from them here.

    Parameters
    ----------
    data : dataset with frames
    over_s : time over which the deceleration is averaged [s]

    Raises
    ------
    InputError
        If the telemetry of a clip ends before that time, or no clip has a sample.
    """
    clips = data.pandas("clips").sort_values("index")
    drives = clips.groupby(DRIVE, dropna=False, sort=True).ngroup().to_numpy()
    windows = data.torch(window=PICTURES, stride=1, columns=["speed"], arrays=["rgb"], quarantined=True)
    rate_hz = data.manifest["grid"]["frame_rate_hz"]
    brakes = read_brakes(data, over_s=over_s)
    rows, pictures = [], []
    for clip, drive in zip(clips.to_dict("records"), drives, strict=True):
        if (brake := brakes.get(clip["label"])) is None:
            continue
        last = min(int(brake.onset_s * rate_hz), windows.starts[-1] + PICTURES - 1)
        first = max(last - PICTURES + 1, 0)
        shown = windows[windows.clips.index(clip["index"]) * len(windows.starts) + first]["rgb"]
        before = shown[: last - first + 1].permute(0, 3, 1, 2)
        pictures.append(before)
        rows += len(before) * [{
            "command": (brake.speed, clip["peak_pressure_mpa"]), "friction": brake.friction,
            "deceleration": brake.deceleration, "drive": drive, "rate": clip["precipitation_mm_h"],
            "weather": clip["weather"], "split": clip["split"], "clip": clip["label"],
        }]  # fmt: skip
    if not rows:
        raise musync.InputError("no clip brakes")
    return Samples(
        pictures=torch.cat(pictures), **{name: np.array([row[name] for row in rows]) for name in rows[0]}
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
    """Return the same pictures with friction and deceleration of a world that looks the same before the brake.

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
    others = [brakes[label] for label in samples.clip]
    return replace(
        samples,
        friction=np.array([brake.friction for brake in others]),
        deceleration=np.array([brake.deceleration for brake in others]),
    )
