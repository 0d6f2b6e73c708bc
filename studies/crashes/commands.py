"""Kill -9 at every change of the disk by a command, and the same command again: as if undisturbed, and nothing left?

A command runs in this process on a disk that fails (`studies.store_faults.disk`): a kill before each change in turn.
The command that follows has another process id, as it would have.
"""

import itertools
import shutil
import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np

from flows.auditing.repair import repair_dataset
from flows.auditing.signing import sign_dataset
from flows.exporting.export import export_dataset
from flows.making.generate import generate_dataset
from flows.measured import closing
from flows.measured.importing import import_measurements
from flows.reading.report import make_report
from flows.scheduled.retention import remove_oldest
from flows.scheduled.run_record import FORMAT, record_name
from flows.store.layout import Layout, write_json
from flows.store.sealed import read_manifest
from studies.crashes.kills import files_of
from studies.store_faults.clips import cheap_clips, write_grid
from studies.store_faults.disk import KILLED, FaultyDisk, Killed
from tasks.identification.decision.verdict import judge_runs

MAP = """\
campaign: killed
vehicle: paper-reference
source: made up
sample_rate_hz: 100
time: {source: t, unit: s}
channels:
  brake_pressure: {source: p, unit: MPa}
  speed: {source: v, unit: m/s}
  longitudinal_acceleration: {source: a, unit: m/s^2}
not_measured: [wheel_speed_front, wheel_speed_rear, pitch, pitch_rate, vertical_acceleration]
runs:
  - {name: first, file: first.csv, part: train}
  - {name: second, file: second.csv, part: train}
  - {name: third, file: third.csv, part: held_out}
"""
PEAKS_MPA = {"first": 2.0, "second": 1.2, "third": 1.6}
OLD, NEW = (f"store-faults-2026030{day}T030000Z" for day in (1, 2))


@dataclass(frozen=True, kw_only=True)
class Trial:
    """A command that is killed.

    Parameters
    ----------
    name : as the user types it
    run : the command on the files of a folder
    prepare : brings these from the folder with the dataset into the empty folder
    """

    name: str
    run: Callable[[Path], object]
    prepare: Callable[[Path, Path], object]


def copy_dataset(source: Path, place: Path) -> None:
    """Copy the dataset and the key beside it."""
    shutil.copytree(source / "data", place / "data")
    shutil.copy(source / "key.pem", place / "key.pem")


def copy_damaged(source: Path, place: Path) -> None:
    """Copy the dataset without three files, with half of a fourth."""
    copy_dataset(source, place)
    for name in ("telemetry/clips.parquet", "frames.zarr/rgb/zarr.json", "previews/contact_sheet.png"):
        (place / "data" / name).unlink()
    shard = Layout(place / "data").frame_shard("depth", 1)
    shard.write_bytes(shard.read_bytes()[:100])


def copy_schedule(source: Path, place: Path) -> None:
    """Copy the dataset twice, as a schedule made it."""
    run_id = read_manifest(Layout(source / "data"))["run_id"]
    times = dict.fromkeys(("scheduled", "began", "updated"), "2026-03-01T03:00:00+00:00")
    for name in (OLD, NEW):
        shutil.copytree(source / "data", place / name)
        record = {"format": FORMAT, "dataset": name, "grid": "store-faults", "run_id": run_id, **times}
        write_json(place / record_name(name), record)


def write_recordings(_: Path, place: Path) -> None:
    """Write a braking car as a logger does, and its map."""
    place.joinpath("log").mkdir()
    t = np.arange(401) / 100
    for name, peak in PEAKS_MPA.items():
        pressure = peak * np.clip((t - 1.5) / 0.3, 0.0, 1.0)
        speed = 20.0 - 1.5 * np.cumsum(pressure) / 100
        rows = np.column_stack([t, pressure, speed, -1.5 * pressure])
        np.savetxt(place / "log" / f"{name}.csv", rows, delimiter=",", header="t,p,v,a", comments="")
    (place / "map.yaml").write_text(MAP)


def import_recordings(place: Path) -> object:
    """Import the recordings."""
    return import_measurements(str(place / "log"), map=str(place / "map.yaml"), out=str(place / "campaign"))


def import_campaign(source: Path, place: Path) -> None:
    """Write the recordings and import them."""
    write_recordings(source, place)
    import_recordings(place)


def close_campaign(place: Path) -> object:
    """Judge the campaign; the fit, which writes nothing, is made once.

    The ledger is left out: a call that is killed while it writes results counts as a reading, because they may be read.
    """
    with (
        mock.patch.object(closing, "judge_runs", _judge_once),
        mock.patch.object(closing, "count_readings", lambda *_: 0),
        mock.patch.object(closing, "record_reading", lambda *_: 0),
    ):
        return closing.close_loop(str(place / "campaign"), out=str(place / "out"))


def _judge_once(*asked: Any) -> Any:
    if not _OUTCOMES:
        _OUTCOMES.append(judge_runs(*asked))
    return _OUTCOMES[0]


_OUTCOMES: list[Any] = []


def export_to(form: str) -> Trial:
    """Return the trial of an export."""
    return Trial(
        name=f"export --to {form}",
        run=lambda place: export_dataset(str(place / "data"), form, out=str(place / "out")),
        prepare=copy_dataset,
    )


TRIALS = (
    Trial(
        name="repair",
        # without --out, whose repair.json names what the second call found: less, where the first had put some right
        run=lambda place: repair_dataset(str(place / "data"), runner="threads", workers=1),
        prepare=copy_damaged,
    ),
    Trial(
        name="sign",
        run=lambda place: sign_dataset(str(place / "data"), key=str(place / "key.pem")),
        prepare=copy_dataset,
    ),
    Trial(
        name="report",
        run=lambda place: make_report(str(place / "data"), out=str(place / "out")),
        prepare=copy_dataset,
    ),
    export_to("kitti"),
    export_to("croissant"),
    Trial(name="retention", run=lambda place: remove_oldest("store-faults", str(place), 1), prepare=copy_schedule),
    Trial(name="import-measurements", run=import_recordings, prepare=write_recordings),
    Trial(name="close-loop", run=close_campaign, prepare=import_campaign),
)  # fmt: skip


def kill_commands(place: Path, names: tuple[str, ...] = ()) -> dict[str, dict[str, Any]]:
    """Kill each command before each of its changes in turn, and run it again.

    Parameters
    ----------
    place : empty folder to work in
    names : of `TRIALS`; none takes all

    Returns
    -------
    By command: ``kills``; ``equal``, those after which the same command ended with the files of an undisturbed one;
    ``first``, what was otherwise the first time, or None.
    """
    source = place / "source"
    source.mkdir(parents=True)
    with cheap_clips(), mock.patch("flows.scheduled.retention.list_open_paths", lru_cache(set)):
        generate_dataset(write_grid(source), str(source / "data"), runner="threads", workers=1)
        (source / "key.pem").write_bytes(_make_key())
        return {
            trial.name: _kill_everywhere(trial, source, place / "work")
            for trial in TRIALS
            if not names or trial.name in names
        }


def _make_key() -> bytes:
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey
    from cryptography.hazmat.primitives.serialization import Encoding, NoEncryption, PrivateFormat

    key = Ed25519PrivateKey.from_private_bytes(bytes(range(32)))
    return key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption())


def _kill_everywhere(trial: Trial, source: Path, place: Path) -> dict[str, Any]:
    found: dict[str, Any] = {"kills": 0, "equal": 0, "first": None}
    wanted: dict[str, str] = {}
    for step in itertools.count():
        shutil.rmtree(place, ignore_errors=True)
        place.mkdir()
        trial.prepare(source, place)
        disk = FaultyDisk(place, KILLED, at=step)
        try:
            with disk, _own_process(1):
                trial.run(place)
        except (Killed, Exception):  # a handler may turn a kill into an error of its own, which nobody sees
            if not disk.struck:
                raise
        if step == 0:
            wanted = _list_entries(place)
            continue
        if not disk.struck:
            print(f"{trial.name}: {found['equal']} of {found['kills']} equal", file=sys.stderr)
            return found
        found["kills"] += 1
        try:
            with _own_process(2):
                trial.run(place)
            after = _list_entries(place)
            differing = sorted(
                name for name in wanted.keys() | after.keys() if wanted.get(name) != after.get(name)
            )
        except Exception as error:
            differing = [f"{type(error).__name__}: {error}"]
        found["equal"] += not differing
        if differing and found["first"] is None:
            found["first"] = {"step": step, "differs": differing[:4]}


def _own_process(number: int) -> Any:
    """Name half-written files and folders as a process of another number does; none such lives."""
    return mock.patch("os.getpid", lambda: 2**22 + number)


def _list_entries(place: Path) -> dict[str, str]:
    folders = (path.relative_to(place).as_posix() for path in place.rglob("*") if path.is_dir())
    return files_of(place) | dict.fromkeys(folders, "folder")
