"""``python -m studies.store_faults [SEQUENCES] [SEED]``: count what holds under random sequences of faults."""

import argparse
import json
import sys
import time

from studies.store_faults.study import study_faults

if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("sequences", type=int, nargs="?", default=2000)
    parser.add_argument("seed", type=int, nargs="?", default=1)
    asked = parser.parse_args()
    started = time.perf_counter()
    counts, broken = study_faults(asked.sequences, asked.seed)
    for name, count in sorted(counts.items()):
        print(f"{count:8d} {name}")
    print(json.dumps({"counts": counts, "wall_s": round(time.perf_counter() - started), "broken": broken}))
    sys.exit(1 if broken else 0)
