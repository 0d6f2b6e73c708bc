"""Readers of a dataset while it is written: each gets the answer that it is unfinished, or right values."""

import re
import subprocess
import sys
import time
from collections import Counter
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import yaml

import musync
from flows.auditing.verify import verify_dataset
from studies.scale.copies import grid_of
from tasks.errors import InputError

PROCESSES = 2
TOLD, RIGHT = "told", "right"
"""What an answer may be."""
UNFINISHED = r"must be (a )?finished"
PAUSE_S = 0.1
"""Between two questions of a reader [s]: one that asks on and on takes the writer's processor."""


def read_while_written(place: Path, clips: int, readers: int) -> dict[str, Any]:
    """Ask a dataset of copied clips for itself from many threads, from before it is begun until it is sealed.

    Parameters
    ----------
    place : folder to work in; made here
    clips : at least how many [1]
    readers : threads, in two processes [1]

    Returns
    -------
    ``right``, whether every answer was ``told`` or ``right`` and each kind of question came to be answered; answers by
    question and outcome.
    """
    place.mkdir()
    grid, folder, ended = place / "grid.yaml", place / "data", place / "ended"
    grid.write_text(yaml.safe_dump(grid_of(clips), sort_keys=False))
    made = 100 * -(-clips // 100)
    found: Counter[str] = Counter()
    writer = subprocess.Popen(
        [sys.executable, "-m", "studies.scale.make", str(grid), str(folder)], stdout=subprocess.DEVNULL
    )
    try:
        with ProcessPoolExecutor(PROCESSES, get_context("spawn")) as pool:
            asked = [
                pool.submit(_ask_on, folder, ended, made, readers // PROCESSES) for _ in range(PROCESSES)
            ]
            code = writer.wait()
            ended.touch()
            for one in asked:
                found.update(one.result())
    finally:
        writer.kill()
    answered = all(found[f"{name}: {RIGHT}"] and found[f"{name}: {TOLD}"] for name in QUESTIONS)
    sound = all(name.endswith((TOLD, RIGHT)) for name in found)
    return {"right": code == 0 and answered and sound, "answers": dict(found)}


def _ask_on(folder: Path, ended: Path, clips: int, threads: int) -> Counter[str]:
    found: Counter[str] = Counter()
    with ThreadPoolExecutor(threads) as pool:
        for answers in pool.map(lambda number: _ask_in_turn(folder, ended, clips, number), range(threads)):
            found.update(answers)
    return found


def _ask_in_turn(folder: Path, ended: Path, clips: int, number: int) -> Counter[str]:
    """One reader's answers; the last is of the finished dataset."""
    found: Counter[str] = Counter()
    name, question = list(QUESTIONS.items())[number % len(QUESTIONS)]
    last = False
    while not last:
        last = ended.exists()
        try:
            outcome = RIGHT if question(folder) == clips else "wrong"
        except InputError as error:
            outcome = TOLD if re.search(UNFINISHED, str(error)) else str(error)
        except Exception as error:
            outcome = f"{type(error).__name__}: {error}"
        found[f"{name}: {outcome}"] += 1
        time.sleep(PAUSE_S)
    return found


def _count_clips(folder: Path) -> int:
    return len(musync.open(folder))


def _query_clips(folder: Path) -> int:
    (row,) = musync.open(folder).sql("SELECT count(*), count(DISTINCT clip_id) FROM clips").fetchall()
    return row[0] if row[0] == row[1] else -1


def _verify_clips(folder: Path) -> int:
    return len(musync.open(folder)) if verify_dataset(str(folder))["verified"] else -1


QUESTIONS = {"open": _count_clips, "sql": _query_clips, "verify": _verify_clips}
