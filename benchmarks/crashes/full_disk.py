"""A file system that is full at a random write: one sentence, and the same command goes on when there is room."""

import random
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from benchmarks.crashes.kills import files_of
from benchmarks.crashes.processes import finish_run

ROOM = 2**30
"""Of the file system once it has been freed [B]."""


def full_disk_study(grid: Path, place: Path, whole: Path, disks: int, seed: int = 4) -> dict[str, Any]:
    """Make a dataset on small file systems of random sizes, then give them room and run the same command again.

    Parameters
    ----------
    grid : grid file
    place : empty folder to mount in; needs the right to mount
    whole : folder of the same dataset, made undisturbed
    disks : how many [1]
    seed : of their sizes

    Returns
    -------
    ``disks``; ``told``, those on which the run ended with exit code 2 and a sentence about the disk; ``equal``, those
    on which the same command then gave the bytes of the undisturbed run; ``plans``, those that had a plan by then.
    """
    draw = random.Random(seed)
    wanted = files_of(whole)
    size = sum(path.stat().st_size for path in whole.rglob("*") if path.is_file())
    found = {"disks": disks, "told": 0, "equal": 0, "plans": 0}
    for turn in range(disks):
        # half of them below 300 kB, where plan, inputs and metadata are written
        bound = 300_000 if turn % 2 else size
        with _small_disk(place / f"disk-{turn}", draw.randrange(4096, bound)) as disk:
            code, said = finish_run(grid, disk / "data")
            told = code == 2 and "the disk is full" in said and "Traceback" not in said
            found["told"] += told
            found["plans"] += (disk / "data" / "plan.json").is_file()
            _remount_disk(disk, ROOM)
            again, said_again = finish_run(grid, disk / "data")
            equal = again == 0 and files_of(disk / "data") == wanted
            found["equal"] += equal
            print(f"disk {turn + 1} of {disks}: {'told' if told else said}, {'equal' if equal else said_again}",
                file=sys.stderr)  # fmt: skip
    return found


@contextmanager
def _small_disk(place: Path, size: int) -> Iterator[Path]:
    place.mkdir()
    subprocess.run(["/bin/mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", str(place)], check=True)
    try:
        yield place
    finally:
        subprocess.run(["/bin/umount", str(place)], check=True)


def _remount_disk(place: Path, size: int) -> None:
    subprocess.run(["/bin/mount", "-o", f"remount,size={size}", str(place)], check=True)
