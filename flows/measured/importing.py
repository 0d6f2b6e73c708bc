"""Measured recordings become a campaign folder: campaign.yaml, runs.csv and runs/*.parquet."""

import csv
import io
from dataclasses import dataclass
from math import inf
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import yaml

from catalogs.campaign_files import MOST_SAMPLES
from catalogs.channel_maps import ChannelMap, FaultyMap, SegmentEntry, load_channel_map
from catalogs.channel_maps.conditions import Conditions
from catalogs.names import name_problem
from catalogs.recordings import read_signals, recording_files, recording_root, stored_files
from catalogs.sentences import shorten
from flows.measured.signal_listing import list_recorded_signals
from flows.store.layout import write_atomically, write_json
from flows.store.telemetry import write_parquet
from manifests.canonical import sha256_of_file
from tasks.campaign.assembly import Assembled, assemble_run
from tasks.campaign.channels import BRAKE_SIGNALS, CHANNELS_BY_NAME
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


def import_measurements(
    source: str, *, map: str | None = None, out: str | None = None, list_signals: bool = False
) -> dict[str, Any]:
    """Read recordings through a channel map and write a campaign folder; or list the signals for such a map.

    Parameters
    ----------
    source : a recording of one of the forms of ``catalogs.recordings``, or a folder of them
    map : channel map by name or YAML file
    out : campaign folder to make; new or empty
    list_signals : list the signals and write nothing; a map, as far as it is written, then tells the clock of tables

    Returns
    -------
    Report on what was made: ``campaign``, ``runs[]``, ``channels``, ``not_measured``, ``sources``; or ``signals``, a
    row for each in every recording.

    Raises
    ------
    InputError
        Listing every problem of every run and channel; then nothing is written.
    """
    if list_signals:
        return list_recorded_signals(source, map)
    if map is None or out is None:
        raise InputError(
            "import-measurements needs --map and --out, or --list-signals to see what a map can name"
        )
    folder = Path(out)
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise InputError(
            f"{folder}: a campaign is made in a new or empty folder; this one holds other things"
        )
    try:
        channel_map, map_file = load_channel_map(map)
    except FaultyMap as faults:
        raise InputError([*faults.problems, *_signal_problems(Path(source), faults.readable)]) from None
    recordings = _read_all(recording_files(Path(source), channel_map), channel_map)
    planned = planned_runs(channel_map, recordings)
    if problems := _plan_problems(planned, recordings, channel_map.sample_rate_hz):
        raise InputError(problems)
    made = [
        (
            run,
            assemble_run(
                recordings[run.file], channel_map.rules, run.start, run.end, channel_map.sample_rate_hz
            ),
        )
        for run in planned
    ]
    problems = [
        f"{run.name} ({run.file.name}): {problem}" for run, found in made for problem in found.problems
    ]
    if problems:
        raise InputError(problems)
    root = recording_root(Path(source))
    sources = {
        file.relative_to(root).as_posix(): sha256_of_file(file)
        for recording in recordings
        for file in stored_files(recording)
    }
    return write_campaign(folder, root, channel_map, made, sources, sha256_of_file(map_file))


def planned_runs(channel_map: ChannelMap, recordings: dict[Path, dict[str, Signal]]) -> list[PlannedRun]:
    """The runs that a map asks for: as it lists them, one per brake application, or one per file.

    Raises
    ------
    InputError
        If there is none.
    """
    runs = [
        PlannedRun(
            name=run.name,
            file=next(file for file in recordings if file.match(run.file)),
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
        runs = _segmented(channel_map, channel_map.segment, recordings)
    if not runs:
        raise InputError("the map's segment finds no brake application: lower above_mpa or minimum_s")
    return runs


def write_campaign(
    folder: Path,
    root: Path,
    channel_map: ChannelMap,
    made: list[tuple[PlannedRun, Assembled]],
    sources: dict[str, str],
    map_hash: str,
) -> dict[str, Any]:
    """Write the folder and say what is in it; campaign.yaml comes last, so that it marks a whole campaign."""
    rate = channel_map.sample_rate_hz
    split = {part: [run.name for run, _ in made if run.part == part] for part in ("train", "held_out")}
    table = io.StringIO()
    writer = csv.DictWriter(table, ["run", *Conditions.model_fields, "drive", "start_s"], lineterminator="\n")
    writer.writeheader()
    for run, found in made:
        drive = run.file.relative_to(root).with_suffix("").as_posix()
        row = {"run": run.name, "drive": drive, "start_s": f"{found.start:.6f}"}
        writer.writerow(row | run.conditions.model_dump())
        write_parquet(run_table(found.columns, rate), folder / "runs" / f"{run.name}.parquet")
    write_atomically(folder / "runs.csv", table.getvalue().encode())
    header = {
        "campaign": channel_map.campaign,
        "vehicle": channel_map.vehicle,
        "sample_rate_hz": rate,
        "split": split,
        "tolerances_1sigma": channel_map.tolerances_1sigma.model_dump(),
        "source": channel_map.source,
        "notes": channel_map.notes,
        "not_measured": list(channel_map.not_measured),
        **_brake_facts(channel_map),
        "made_from": {"channel_map_sha256": map_hash, "files_sha256": sources},
    }
    text = yaml.safe_dump(header, sort_keys=False, allow_unicode=True)
    write_atomically(folder / "campaign.yaml", text.encode())
    report = {
        "campaign": str(folder),
        "runs": [
            {
                "run": run.name,
                "part": run.part,
                "file": run.file.relative_to(root).as_posix(),
                "start_s": found.start,
                "duration_s": (len(next(iter(found.columns.values()))) - 1) / rate,
            }
            for run, found in made
        ],
        "channels": list(channel_map.channels),
        "not_measured": list(channel_map.not_measured),
        "sources": sources,
    }
    write_json(folder / "import.json", report)
    return report


def _brake_facts(channel_map: ChannelMap) -> dict[str, str]:
    """Return the signal that stands for the brake pressure; empty where the pressure was measured."""
    rules = {rule.channel: rule for rule in channel_map.rules}
    if "brake_pressure" in rules:
        gain = rules["brake_pressure"].gain
        return {} if gain is None else {"brake_stands_for": f"a signal in {gain.source_unit}"}
    found = [name for name in BRAKE_SIGNALS if name in rules]
    return {"brake_signal": found[0]} if found else {}


def run_table(columns: dict[str, np.ndarray], rate: float) -> pa.Table:
    """A run's Parquet table: time from 0 and its channels, units in the field metadata."""
    count = len(next(iter(columns.values())))
    fields = [pa.field("time", pa.float64(), metadata={"units": "s"})] + [
        pa.field(name, pa.float64(), metadata={"units": CHANNELS_BY_NAME[name].unit}) for name in columns
    ]
    arrays = [pa.array(np.arange(count) / rate)] + [pa.array(values) for values in columns.values()]
    return pa.Table.from_arrays(arrays, schema=pa.schema(fields))


def _plan_problems(
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
            )
    return problems


def _signal_problems(source: Path, channel_map: ChannelMap | None) -> list[str]:
    """Faults of the signals that a faulty map names, as far as it can be read."""
    if channel_map is None:
        return []
    try:
        _read_all(recording_files(source, channel_map), channel_map)
    except InputError as error:
        return list(error.problems)
    return []


def _read_all(files: tuple[Path, ...], channel_map: ChannelMap) -> dict[Path, dict[str, Signal]]:
    recordings: dict[Path, dict[str, Signal]] = {}
    problems: list[str] = []
    for file in files:
        try:
            recordings[file] = read_signals(file, channel_map)
        except InputError as error:
            problems += error.problems
    if problems:
        raise InputError(problems)
    return recordings


def _segmented(
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
