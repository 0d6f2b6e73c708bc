"""``python -m studies.double_track --make DIR`` and ``--judge DIR``: how often is close-loop right on other physics?

Without ``--effects`` 60 campaigns of the plain car, 28 effects, and forms that no library holds are made.
"""

import argparse
import json
import sys
from pathlib import Path

from studies.double_track.declared import read_declared
from studies.double_track.effects import NULLS
from studies.double_track.judge import CHANNEL_SETS, judge_campaigns
from studies.double_track.make import make_campaigns
from studies.double_track.scores import format_tables, summarise

if __name__ == "__main__":
    parser = argparse.ArgumentParser(prog="python -m studies.double_track", description=__doc__)
    what = parser.add_mutually_exclusive_group(required=True)
    what.add_argument("--make", type=Path, metavar="DIR", help="write campaign folders and labels.json")
    what.add_argument("--judge", type=Path, metavar="DIR", help="judge them and write the tables")
    parser.add_argument(
        "--effects", default="null,standard,forms", help="names or groups of effects.yaml, or null"
    )
    parser.add_argument("--sizes", type=int, default=5, help="campaigns of each effect, small to large")
    parser.add_argument("--nulls", type=int, default=NULLS, help="campaigns of the plain car")
    parser.add_argument("--design", choices=tuple(read_declared("designs")["designs"]), default="rich")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--minutes", type=float, default=1e9, help="begin no verdict after so long")
    parser.add_argument("--channels", choices=tuple(CHANNEL_SETS), default="all")
    asked = parser.parse_args()
    if asked.make:
        try:
            made = make_campaigns(
                asked.make,
                asked.effects.split(","),
                asked.sizes,
                asked.nulls,
                asked.design,
                asked.seed,
                asked.workers,
            )
        except ValueError as error:
            sys.exit(str(error))
        print(f"{len(made)} campaigns in {asked.make}")
    else:
        rows = judge_campaigns(asked.judge, asked.channels, asked.workers, asked.minutes)
        tables = format_tables(rows, asked.channels)
        (asked.judge / f"tables-{asked.channels}.md").write_text(tables, encoding="utf-8")
        (asked.judge / f"summary-{asked.channels}.json").write_text(
            json.dumps(summarise(rows), indent=1), encoding="utf-8"
        )
        print(tables)
