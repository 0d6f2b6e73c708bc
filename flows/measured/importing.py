"""Measured recordings become a campaign folder: campaign.yaml, runs.csv and runs/*.parquet."""

import csv
import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import yaml

from catalogs.campaigns import HEAT_COLUMN, SLOPE_COLUMN
from catalogs.channel_maps import ChannelMap, FaultyMap
from catalogs.channel_maps.conditions import Conditions
from catalogs.entries import load
from catalogs.recordings import recording_files, recording_root, stored_files
from flows.measured.readable_recordings import find_signal_problems, leave_out_faulty, read_recordings
from flows.measured.run_plan import PlannedRun, find_run_problems, plan_runs
from flows.measured.signal_listing import list_recorded_signals
from flows.store.layout import write_atomically, write_folder, write_json
from flows.store.missing import null_missing
from flows.store.telemetry import write_parquet
from manifests.canonical import sha256_of_file
from tasks.campaign.assembly import Assembled, assemble_run
from tasks.campaign.braking_heat import measure_braking_heat
from tasks.campaign.channels import BRAKE_SIGNALS, CHANNELS_BY_NAME
from tasks.campaign.checks import apply_checks
from tasks.campaign.measured import MeasuredRun, Recordings, Session
from tasks.campaign.signals import Signal
from tasks.campaign.slow_channels import measure_slow_rates
from tasks.campaign.speed_by_acceleration import estimate_slopes
from tasks.campaign.stated_units import find_unknown_units
from tasks.errors import InputError
from tasks.surface.weather import DRY


def import_measurements(
    source: str, *, map: str | None = None, out: str | None = None, list_signals: bool = False
) -> dict[str, Any]:
    """Read recordings through a channel map and write a campaign folder; or list the signals for such a map.

    Parameters
    ----------
    source : a recording of one of the forms of ``catalogs.recordings``, or a folder of them
    map : channel map by name or YAML file
    out : campaign folder to make; new or empty
    list_signals : list the signals and write nothing; a map, as far as it is written, then gives the clock of tables

    Returns
    -------
    Report on what was made: ``campaign``, ``runs[]``, ``channels``, ``slow_channels_hz`` (of the channels slower than
    their runs), ``not_measured``, ``assumed_tolerances_1sigma`` (what the map leaves open), ``sources``, and
    ``warnings[]`` (what may be wrong, or was left out), ``left_out[]`` (why) where segments are no runs, or runs and
    recordings are faulty, and ``faulty[]``, the names of these; or ``signals``, a row for each in every recording.

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
        channel_map, map_file = load("channel map", map)
    except FaultyMap as faulty:
        raise InputError([*faulty.problems, *find_signal_problems(Path(source), faulty.readable)]) from None
    root = recording_root(Path(source))
    channel_map, recordings, left_out, lost = read_recordings(
        recording_files(Path(source), channel_map), channel_map
    )
    planned, unused = plan_runs(channel_map, root, recordings)
    left_out += unused
    if problems := find_run_problems(planned, recordings, channel_map.sample_rate_hz):
        raise InputError(problems)
    made, faults = leave_out_faulty([(run, _assemble(run, recordings, channel_map)) for run in planned])
    left_out += faults
    lost += [run.name for run in planned if run.name not in {kept.name for kept, _ in made}]
    computed = dict.fromkeys(found.computed for _, found in made if found.computed)
    if computed:
        channel_map, made = _leave_out_acceleration(channel_map, made)
    table = load("table of checks")
    of_session = apply_checks(table.session, Session(runs=[found.run for _, found in made]))
    if problems := [one.sentence for one in of_session if one.check.fault != "warning"]:
        raise InputError(problems)
    logged = Recordings(signals=list(recordings.values()), rules=channel_map.rules)
    warnings = [one.sentence for one in (*of_session, *apply_checks(table.recordings, logged))]
    unknown = [
        found for signals in recordings.values() for found in find_unknown_units(channel_map.rules, signals)
    ]
    warnings += [*computed, *dict.fromkeys(unknown)]
    sources = {
        file.relative_to(root).as_posix(): sha256_of_file(file)
        for recording in recordings
        for file in stored_files(recording)
    }
    beside: dict[str, Any] = {}
    if warnings:
        beside["warnings"] = warnings
    if left_out:
        beside["left_out"] = left_out
    if lost:
        beside["faulty"] = lost
    heat = _estimate_heat(channel_map, made, recordings)
    return write_campaign(folder, root, channel_map, made, heat, sources, sha256_of_file(map_file), beside)


def _assemble(
    run: PlannedRun, recordings: dict[Path, dict[str, Signal]], channel_map: ChannelMap
) -> Assembled:
    """Return a planned run on its clock."""
    about = MeasuredRun(
        name=run.name,
        interval=1.0 / channel_map.sample_rate_hz,
        slippery=run.conditions.weather != DRY,
        over_feature=run.conditions.hazard_length_m > 0.0,
    )
    signals, rules, table = recordings[run.file], channel_map.rules, load("table of checks")
    return assemble_run(signals, rules, run.start, run.end, channel_map.sample_rate_hz, table, about=about)


def write_campaign(
    folder: Path,
    root: Path,
    channel_map: ChannelMap,
    made: list[tuple[PlannedRun, Assembled]],
    heat: dict[str, float],
    sources: dict[str, str],
    map_hash: str,
    beside: dict[str, Any],
) -> dict[str, Any]:
    """Write the folder, whole or not at all, and say what is in it."""
    with write_folder(folder) as partial:
        made_from = {"channel_map_sha256": map_hash, "files_sha256": sources}
        return _fill_folder(partial, str(folder), root, channel_map, made, heat, made_from, beside)


def _fill_folder(
    folder: Path,
    name: str,
    root: Path,
    channel_map: ChannelMap,
    made: list[tuple[PlannedRun, Assembled]],
    heat: dict[str, float],
    made_from: dict[str, Any],
    beside: dict[str, Any],
) -> dict[str, Any]:
    rate = channel_map.sample_rate_hz
    felt = "longitudinal_acceleration" in channel_map.channels
    limits = {check.name: check.conditions for check in load("table of checks").session}
    slopes = estimate_slopes([found.run for _, found in made], **limits["felt_slope"]) if felt else {}
    split = {part: [run.name for run, _ in made if run.part == part] for part in ("train", "held_out")}
    table = io.StringIO()
    columns = ["run", *Conditions.model_fields, HEAT_COLUMN, SLOPE_COLUMN, "drive", "start_s"]
    writer = csv.DictWriter(table, columns, lineterminator="\n")
    writer.writeheader()
    for run, found in made:
        drive = run.file.relative_to(root).with_suffix("").as_posix()
        row = {
            "run": run.name,
            HEAT_COLUMN: f"{heat[run.name]:.4g}",
            SLOPE_COLUMN: f"{slopes.get(run.name, 0.0):.4g}",
            "drive": drive,
            "start_s": f"{found.start:.6f}",
        }
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
        **({} if channel_map.speed_from == "ground" else {"speed_from": channel_map.speed_from}),
        "made_from": made_from,
    }
    text = yaml.safe_dump(header, sort_keys=False, allow_unicode=True)
    write_atomically(folder / "campaign.yaml", text.encode())
    report = {
        "campaign": name,
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
        "slow_channels_hz": measure_slow_rates([found.columns for _, found in made], rate),
        "not_measured": list(channel_map.not_measured),
        "assumed_tolerances_1sigma": channel_map.tolerances_1sigma.list_assumed(),
        "sources": made_from["files_sha256"],
        **beside,
    }
    write_json(folder / "import.json", report)
    return report


def _estimate_heat(
    channel_map: ChannelMap,
    made: list[tuple[PlannedRun, Assembled]],
    recordings: dict[Path, dict[str, Signal]],
) -> dict[str, float]:
    """Return the heat with which each run begins, by its name [J/kg]; 0 where the map declares its disc temperature."""
    heat = dict.fromkeys((run.name for run, _ in made), 0.0)
    unknown = [
        (run, found)
        for run, found in made
        if "disc_temperature_above_ambient_c" not in run.conditions.model_fields_set
    ]
    for file, signals in recordings.items():
        starts = {run.name: found.start for run, found in unknown if run.file == file}
        heat |= zip(
            starts, measure_braking_heat(signals, channel_map.rules, list(starts.values())), strict=True
        )
    return heat


def _leave_out_acceleration(
    channel_map: ChannelMap, made: list[tuple[PlannedRun, Assembled]]
) -> tuple[ChannelMap, list[tuple[PlannedRun, Assembled]]]:
    """Return the map and its runs as if the acceleration stood under ``not_measured``."""
    name = "longitudinal_acceleration"
    channels = {channel: entry for channel, entry in channel_map.channels.items() if channel != name}
    left = channel_map.model_copy(
        update={"channels": channels, "not_measured": (*channel_map.not_measured, name)}
    )
    return left, [(run, found.without(name)) for run, found in made]


def _brake_facts(channel_map: ChannelMap) -> dict[str, str]:
    """Return the signal that stands for the brake pressure; empty where the pressure was measured."""
    rules = {rule.channel: rule for rule in channel_map.rules}
    if "brake_pressure" in rules:
        gain = rules["brake_pressure"].gain
        return {} if gain is None else {"brake_stands_for": f"a signal in {gain.source_unit}"}
    found = [name for name in BRAKE_SIGNALS if name in rules]
    return {"brake_signal": found[0]} if found else {}


def run_table(columns: Mapping[str, np.ndarray], rate: float) -> pa.Table:
    """A run's Parquet table: time from 0 and its channels, units in the field metadata."""
    count = len(next(iter(columns.values())))
    fields = [pa.field("time", pa.float64(), metadata={"units": "s"})] + [
        pa.field(name, pa.float64(), metadata={"units": CHANNELS_BY_NAME[name].unit}) for name in columns
    ]
    arrays = [pa.array(np.arange(count) / rate)] + [pa.array(values) for values in columns.values()]
    return null_missing(pa.Table.from_arrays(arrays, schema=pa.schema(fields)))
