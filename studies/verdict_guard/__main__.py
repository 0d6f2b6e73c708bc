"""``python -m studies.verdict_guard MEASURED``: judge labelled campaigns and hold each verdict against what it was.

A wrong name, a name where nothing is missing, and an outcome worse than the recorded one fail (exit code 1).
"""

import argparse
import json
import sys
from pathlib import Path

from studies.verdict_guard.judge import RANKED, judge_all

if __name__ == "__main__":
    parser = argparse.ArgumentParser(prog="python -m studies.verdict_guard", description=__doc__)
    parser.add_argument("measured", type=Path, help="folder with the sets of campaigns")
    parser.add_argument("--out", type=Path, default=Path("datasets/verdict-guard"))
    parser.add_argument("--workers", type=int, default=2)
    asked = parser.parse_args()
    worse = []
    for group, name, before, row in judge_all(asked.measured, asked.out, asked.workers):
        lost = RANKED.index(row["outcome"]) < RANKED.index(before)
        worse += [f"{group}/{name}: {before} before, {row['outcome']} now"] if lost else []
        print(json.dumps({"set": group, "campaign": name, "before": before, **row}), flush=True)
    sys.exit("\n".join(worse) if worse else None)
