"""``python -m studies.crashes [--kills 200] [--flips 500] [--stop 60] [--readers 64]``: count what survives."""

import argparse
import json
import sys
import tempfile
from pathlib import Path

from studies.crashes.commands import kill_commands
from studies.crashes.disturbances import disturb_runs
from studies.crashes.full_disk import full_disk_study
from studies.crashes.kills import GRID, kill_study
from studies.crashes.readers import read_while_written
from studies.crashes.rot import flip_study

if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    for name, count in (
        ("kills", 200),
        ("flips", 500),
        ("disks", 20),
        ("stop", 60),
        ("clips", 10_000),
        ("readers", 64),
        ("seed", 9),
    ):
        parser.add_argument(f"--{name}", type=int, default=count)
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        place = Path(scratch)
        (place / "grid.yaml").write_text(GRID)
        killed = kill_study(place / "grid.yaml", place, asked.kills, asked.seed)
        flipped = flip_study(place / "whole", asked.flips)
        filled = full_disk_study(place / "grid.yaml", place / "filled", place / "whole", asked.disks)
        commands = kill_commands(place / "commands")
        disturbed = disturb_runs(place / "disturbed", asked.stop)
        disturbed["many readers"] = read_while_written(place / "read", asked.clips, asked.readers)
    found = {
        "killed": killed,
        "flipped": flipped,
        "filled": filled,
        "commands": commands,
        "disturbed": disturbed,
    }
    print(json.dumps(found))
    good = (
        killed["equal"] == killed["runs_finished"] > 0
        and killed["half_clips"] == 0
        and flipped["named"] == flipped["flips"]
        and all(row["told"] == row["equal"] == row["disks"] for row in filled.values())
        and all(row["equal"] == row["kills"] > 0 for row in commands.values())
        and all(row["right"] for row in disturbed.values())
    )
    sys.exit(0 if good else 1)
