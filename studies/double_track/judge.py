"""Judging campaigns as `musync close-loop` does, with all channels or some of them."""

import json
import os
import shutil
import time
from collections.abc import Mapping
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import yaml

from studies.double_track.make import LABELS
from studies.double_track.outcomes import estimate_of, judge_verdict

CHANNEL_SETS: dict[str, tuple[str, ...]] = {
    "all": (),
    "no-pitch": ("pitch", "pitch_rate"),
    "speed-acceleration": (
        "wheel_speed_front", "wheel_speed_rear", "pitch", "pitch_rate", "vertical_acceleration",
    ),
    "speed-pressure": (
        "longitudinal_acceleration", "wheel_speed_front", "wheel_speed_rear", "pitch", "pitch_rate",
        "vertical_acceleration",
    ),
}  # fmt: skip
"""Channels that each set lacks."""


def judge_campaigns(folder: Path, channels: str, workers: int, minutes: float = 1e9) -> list[dict[str, Any]]:
    """Judge every labelled campaign; what was judged with the same set of channels is kept.

    Every verdict is a line of ``judged-CHANNELS.jsonl`` as soon as it is there, so a stop loses nothing. Move that
    file away after a change of the engine.

    Parameters
    ----------
    folder : with campaigns and labels.json
    channels : a key of `CHANNEL_SETS`
    workers : processes
    minutes : no campaign is begun after so long
    """
    labels: dict[str, Any] = json.loads((folder / LABELS).read_text(encoding="utf-8"))
    log = folder / f"judged-{channels}.jsonl"
    lines = log.read_text(encoding="utf-8").splitlines() if log.is_file() else []
    rows = [json.loads(line) for line in lines]
    done = {row["campaign"] for row in rows}
    ends = time.time() + 60.0 * minutes
    # as the command does: with a BLAS of two threads beside another worker's, a verdict takes four times as long
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        jobs = [
            pool.submit(judge_campaign, folder, name, label, channels, ends)
            for name, label in labels.items()
            if name not in done
        ]
        for job in as_completed(jobs):
            row = job.result()
            if row is not None:
                rows.append(row)
                with log.open("a", encoding="utf-8") as file:
                    file.write(json.dumps(row) + "\n")
    return rows


def judge_campaign(
    folder: Path, name: str, label: Mapping[str, Any], channels: str, ends: float
) -> dict[str, Any] | None:
    """Judge one campaign; None where there is no time left.

    Parameters
    ----------
    folder, name : of the campaign
    label : its truth
    channels : a key of `CHANNEL_SETS`
    ends : time after which nothing is begun [s since 1970]
    """
    if time.time() > ends:
        return None
    os.environ["MUSYNC_LEDGER"] = str(folder / "held-out-readings.jsonl")
    from flows.measured.closing import close_loop
    from tasks.errors import InputError

    out = folder / f"verdicts-{channels}" / name
    source = without_channels(folder / name, folder / f"campaigns-{channels}" / name, CHANNEL_SETS[channels])
    row: dict[str, Any] = {"campaign": name, "channels": channels, **label}
    started = time.process_time()
    try:
        verdict = close_loop(str(source), out=str(out))
    except InputError as error:
        return {**row, "outcome": "refused", "verdict": "REFUSED", "reasons": list(error.problems)}
    return {
        **row,
        "outcome": judge_verdict(label, verdict),
        "verdict": verdict["verdict"],
        "named": [[effect["name"], effect["port"], effect["variable"]] for effect in verdict["effects"]],
        "rivals": [rival["name"] for rival in verdict["rivals"]],
        "tried": [[effect["name"], effect["score"]] for effect in verdict["tried"][:3]],
        "estimate": estimate_of(label, verdict),
        "error": {key: [e["frozen"], e["retuned"], e["after"]] for key, e in verdict["error"].items()},
        "reasons": verdict["reasons"],
        "left_out": verdict["runs_left_out"],
        "cpu_s": time.process_time() - started,
    }


def without_channels(campaign: Path, copy: Path, lacking: tuple[str, ...]) -> Path:
    """The campaign, or a copy of it without some channels, which its header then lists under ``not_measured``.

    Parameters
    ----------
    campaign : folder
    copy : folder to make
    lacking : channels to leave out
    """
    if not lacking:
        return campaign
    if copy.exists():
        shutil.rmtree(copy)
    shutil.copytree(campaign, copy)
    header = yaml.safe_load((copy / "campaign.yaml").read_text(encoding="utf-8"))
    (copy / "campaign.yaml").write_text(
        yaml.safe_dump(header | {"not_measured": list(lacking)}, sort_keys=False), encoding="utf-8"
    )
    for path in (copy / "runs").glob("*.parquet"):
        table = pq.read_table(path)
        pq.write_table(table.drop_columns(list(lacking)), path)
    return copy
