"""A file system that is full at a random write: one sentence, and the same command goes on when there is room."""

import random
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from studies.crashes.commands import write_recordings
from studies.crashes.kills import files_of
from studies.crashes.processes import finish_command

ROOM = 2**30
"""Of the file system once it has been freed [B]."""


def full_disk_study(
    grid: Path, place: Path, whole: Path, disks: int, seed: int = 4
) -> dict[str, dict[str, Any]]:
    """Let commands write to small file systems of random sizes, then give these room and run the same command again.

    Parameters
    ----------
    grid : grid file
    place : empty folder to mount in; needs the right to mount
    whole : folder of the dataset of the grid, made undisturbed
    disks : how many, for each command [1]
    seed : of their sizes

    Returns
    -------
    By command: ``disks``; ``told``, those on which it ended with exit code 2 and a sentence about the disk; ``equal``,
    those on which the same command then gave the bytes of an undisturbed one.
    """
    place.mkdir()
    write_recordings(place, place)
    commands = {
        "generate": ["generate", str(grid), "--runner", "threads"],
        "import-measurements": ["import-measurements", str(place / "log"), "--map", str(place / "map.yaml")],
        "export": ["export", str(whole), "--to", "kitti"],
    }
    draw = random.Random(seed)
    return {name: _fill_disks(place / name, words, disks, draw) for name, words in commands.items()}


def _fill_disks(place: Path, words: list[str], disks: int, draw: random.Random) -> dict[str, Any]:
    with _small_disk(place, ROOM) as disk:
        finish_command(*words, "--out", str(disk / "data"))
        wanted = files_of(disk / "data")
        size = sum(path.stat().st_size for path in (disk / "data").rglob("*") if path.is_file())
    found = {"disks": disks, "told": 0, "equal": 0}
    for turn in range(disks):
        # half of them small, where plan, inputs and metadata are written
        bound = min(300_000, size // 3) if turn % 2 else size
        with _small_disk(place, draw.randrange(4096, bound)) as disk:
            code, said = finish_command(*words, "--out", str(disk / "data"))
            told = code == 2 and "the disk is full" in said and "Traceback" not in said
            found["told"] += told
            _remount_disk(disk, ROOM)
            again, said_again = finish_command(*words, "--out", str(disk / "data"))
            equal = again == 0 and files_of(disk / "data") == wanted and [*disk.iterdir()] == [disk / "data"]
            found["equal"] += equal
            print(f"{place.name}, disk {turn + 1} of {disks}: {'told' if told else said},"
                f" {'equal' if equal else said_again}", file=sys.stderr)  # fmt: skip
    return found


@contextmanager
def _small_disk(place: Path, size: int) -> Iterator[Path]:
    place.mkdir(exist_ok=True)
    subprocess.run(["/bin/mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", str(place)], check=True)
    try:
        yield place
    finally:
        subprocess.run(["/bin/umount", str(place)], check=True)


def _remount_disk(place: Path, size: int) -> None:
    subprocess.run(["/bin/mount", "-o", f"remount,size={size}", str(place)], check=True)
