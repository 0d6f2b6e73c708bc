"""Stretches of recordings that become the runs of a campaign: listed, one per brake application, or one per file."""

from dataclasses import dataclass
from math import inf
from pathlib import Path

import numpy as np

from catalogs.campaign_files import MOST_SAMPLES
from catalogs.channel_maps import ChannelMap, SegmentEntry
from catalogs.channel_maps.conditions import Conditions
from catalogs.names import name_problem
from catalogs.sentences import shorten
from tasks.campaign.episodes import pressure_episodes
from tasks.campaign.signals import Signal, convert_to_channel
from tasks.errors import InputError


@dataclass(frozen=True, kw_only=True)
class PlannedRun:
    """A stretch of one file that becomes a run; infinite times mean all there is [s]."""

    name: str
    file: Path
    start: float
    end: float
    part: str
    conditions: Conditions


def plan_runs(
    channel_map: ChannelMap, root: Path, recordings: dict[Path, dict[str, Signal]]
) -> list[PlannedRun]:
    """The runs that a map asks for: as it lists them, one per brake application, or one per file.

    Parameters
    ----------
    channel_map : lists the runs, or says how to cut them
    root : folder in which the map's files lie
    recordings : signals of each file

    Raises
    ------
    InputError
        If there is none.
    """
    runs = [
        PlannedRun(
            name=run.name,
            file=root / run.file,
            start=-inf if run.from_s is None else run.from_s,
            end=inf if run.to_s is None else run.to_s,
            part=run.part,
            conditions=channel_map.conditions_of(run),
        )
        for run in channel_map.runs
    ]
    if not runs and channel_map.segment is None:
        runs = [
            PlannedRun(
                name=file.stem,
                file=file,
                start=-inf,
                end=inf,
                part="train",
                conditions=channel_map.conditions,
            )
            for file in recordings
        ]
    if channel_map.segment is not None:
        runs = _cut_segments(channel_map, channel_map.segment, recordings)
    if not runs:
        raise InputError("the map's segment finds no brake application: lower above_mpa or minimum_s")
    return runs


def find_run_problems(
    planned: list[PlannedRun], recordings: dict[Path, dict[str, Signal]], rate: float
) -> list[str]:
    """Runs whose name is no file name or not their own, and runs of more samples than a campaign may hold."""
    names = [run.name for run in planned]
    problems = [
        f"run {shorten(name)} stands twice: rename a file, or list the map's runs"
        for name in sorted({name for name in names if names.count(name) > 1})
    ]
    for run in planned:
        if problem := name_problem(run.name):
            problems.append(f"{shorten(run.file)}: a run takes the file's name, which must {problem}")
        shared = [
            np.clip(signal.time[[0, -1]], run.start, run.end)
            for signal in recordings[run.file].values()
            if len(signal.time)
        ]
        count = min((float(end - start) for start, end in shared), default=0.0) * rate
        if count > MOST_SAMPLES:
            problems.append(
                f"run {shorten(run.name)} must have at most {MOST_SAMPLES} samples; at {rate:g} Hz it has {count:.3g}"
            )
    return problems + _shared_stretches(planned)


def _shared_stretches(planned: list[PlannedRun]) -> list[str]:
    """Held-out runs that a training run has samples of: what judges a fit must be nothing that was fitted."""
    problems = []
    for judge in (run for run in planned if run.part == "held_out"):
        taught = [
            shorten(run.name)
            for run in planned
            if run.part == "train"
            and run.file == judge.file
            and max(run.start, judge.start) < min(run.end, judge.end)
        ]
        if taught:
            problems.append(
                f"run {shorten(judge.name)} is held out and must share no sample with a training run; it shares some of"
                f" {shorten(judge.file.name)} with {shorten(', '.join(taught))}: correct its file or its window"
                " (before_s and after_s of a segment)"
            )
    return problems


def _cut_segments(
    channel_map: ChannelMap, segment: SegmentEntry, recordings: dict[Path, dict[str, Signal]]
) -> list[PlannedRun]:
    rule = next((rule for rule in channel_map.rules if rule.channel == "brake_pressure"), None)
    if rule is None:
        raise InputError("a map with segment needs the channel brake_pressure")
    runs: list[PlannedRun] = []
    for file, signals in recordings.items():
        pressure = convert_to_channel(signals[rule.sources[0]], rule)
        episodes = pressure_episodes(
            pressure.time, pressure.values, threshold=segment.above_mpa, merge_gap=segment.merge_gap_s
        )
        for episode in episodes:
            if episode.duration < segment.minimum_s:
                continue
            number = len(runs) + 1
            runs.append(
                PlannedRun(
                    name=f"run-{number:02d}",
                    file=file,
                    start=max(episode.onset_time - segment.before_s, float(pressure.time[0])),
                    end=min(episode.end_time + segment.after_s, float(pressure.time[-1])),
                    part="held_out" if number % segment.held_out_every == 0 else "train",
                    conditions=channel_map.conditions,
                )
            )
    return runs
