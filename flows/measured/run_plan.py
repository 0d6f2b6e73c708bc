"""Stretches of recordings that become the runs of a campaign: listed, one per brake application, or one per file."""

from dataclasses import dataclass
from math import inf
from pathlib import Path

import numpy as np

from catalogs.campaign_files import MOST_SAMPLES
from catalogs.channel_maps import ChannelMap, SegmentEntry
from catalogs.channel_maps.conditions import Conditions
from catalogs.entries import load
from catalogs.names import find_name_problem
from catalogs.sentences import cap_problems, shorten
from tasks.campaign.channels import BRAKE_SIGNALS
from tasks.campaign.segments import SegmentRule, cut_segments, find_brake_rule
from tasks.campaign.signals import Signal
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
) -> tuple[list[PlannedRun], list[str]]:
    """The runs that a map asks for: as it lists them, one per brake application, or one per file.

    Brake applications that are no runs, and recordings without one, are reported beside them, one sentence each.

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
    if channel_map.segment is not None:
        return _cut_recordings(channel_map, channel_map.segment, root, recordings)
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
    if not runs:
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
    return runs, []


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
        if problem := find_name_problem(run.name):
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


def _cut_recordings(
    channel_map: ChannelMap, segment: SegmentEntry, root: Path, recordings: dict[Path, dict[str, Signal]]
) -> tuple[list[PlannedRun], list[str]]:
    rule = find_brake_rule(channel_map.rules)
    if rule is None:
        raise InputError(
            f"a map with segment needs one of the channels {', '.join(BRAKE_SIGNALS)}: it names none"
        )
    cut = SegmentRule(
        threshold=segment.above_mpa,
        merge_gap=segment.merge_gap_s,
        minimum=segment.minimum_s,
        before=segment.before_s,
        after=segment.after_s,
    )
    runs: list[PlannedRun] = []
    left_out: list[str] = []
    faulty = 0
    for file, signals in recordings.items():
        parts = cut_segments(signals, channel_map.rules, rule, cut, load("table of checks"))
        if not parts:
            left_out.append(
                f"{shorten(file.relative_to(root))}: no run, for the brake is never applied above"
                f" {rule.describe_pressure(segment.above_mpa)} for {segment.minimum_s:g} s: cut it by runs in place of"
                " segment where it is to be used, as a coast-down is"
            )
        for part in parts:
            if part.fault:
                part_name = f"{shorten(file.relative_to(root))} from {part.start:.3f} to {part.end:.3f} s"
                left_out.append(f"{part_name}: {part.fault}")
                faulty += 1
                continue
            number = len(runs) + 1
            runs.append(
                PlannedRun(
                    name=f"run-{number:02d}",
                    file=file,
                    start=part.start,
                    end=part.end,
                    part="held_out" if number % segment.held_out_every == 0 else "train",
                    conditions=channel_map.conditions,
                )
            )
    if not runs:
        raise InputError([_explain_absence(faulty), *cap_problems(left_out)])
    return runs, left_out


def _explain_absence(faulty: int) -> str:
    """Return why a map's segment makes no run, and what to do, by the number of brake applications that it finds."""
    if not faulty:
        return "the map's segment finds no brake application: lower above_mpa or minimum_s"
    return (
        f"the map's segment finds {faulty} brake application{'s' if faulty > 1 else ''}, and none is a run: put right"
        " what each is left out for"
    )
