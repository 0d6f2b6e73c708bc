"""The study: inputs for every parser, what became of them, and exit code 1 where it is not what must be."""

import argparse
import json
import sys
import tempfile
import time
from collections import Counter, defaultdict
from pathlib import Path

from studies.fuzzing.desk import FINDINGS, Desk, lay_out, write_documents
from studies.fuzzing.parser import Parser
from studies.fuzzing.parsers import BY_NAME, PARSERS
from studies.fuzzing.watched import Reading, count_outcomes, read_watched

SEED = 2025


def plan_inputs(parsers: list[Parser], count: int) -> list[tuple[str, range]]:
    """How many inputs each parser reads: by its share, at least ``count`` in all."""
    whole = sum(parser.share for parser in parsers)
    return [(parser.name, range(-int(-count * parser.share // whole))) for parser in parsers]


def run_study(
    parsers: list[Parser], count: int, *, seed: int = SEED, workers: int = 2
) -> dict[str, list[Reading]]:
    """Readings of at least ``count`` inputs, by parser."""
    readings: dict[str, list[Reading]] = {parser.name: [] for parser in parsers}
    with tempfile.TemporaryDirectory() as shelf:
        write_documents(parsers, Path(shelf))
        plan = plan_inputs(parsers, count)
        for number, reading in enumerate(read_watched(plan, Path(shelf), seed, workers), start=1):
            readings[reading.parser].append(reading)
            if number % 5_000 == 0:
                print(f"{number} of {sum(len(numbers) for _, numbers in plan)} inputs read", file=sys.stderr)
    return readings


def list_findings(readings: dict[str, list[Reading]]) -> list[Reading]:
    """The readings that must not be."""
    return [reading for rows in readings.values() for reading in rows if reading.outcome in FINDINGS]


def reproduce_input(name: str, number: int, seed: int, keep: str | None) -> int:
    """Make and read one input, and report it; 1 if it is a finding."""
    with tempfile.TemporaryDirectory() as shelf, tempfile.TemporaryDirectory() as place:
        write_documents([BY_NAME[name]], Path(shelf))
        made, outcome, detail = Desk(Path(shelf), Path(place)).read(name, seed, number)
        print(f"{name} {number}: {made.what}; {outcome}: {detail}")
        for file, content in made.changed.items():
            print(f"--- {file}, {len(content)} bytes, begins {content[:300]!r}")
        if keep is not None:
            lay_out(dict(made.changed), Path(keep))
    return int(outcome in FINDINGS)


def main() -> int:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--count", type=int, default=100_000)
    options.add_argument("--seed", type=int, default=SEED)
    options.add_argument("--workers", type=int, default=2)
    options.add_argument("--parser", action="append", choices=sorted(BY_NAME))
    options.add_argument("--input", type=int, help="this one alone, of the parser that is named")
    options.add_argument("--keep", help="folder for the changed files of that input")
    options.add_argument("--out", help="file for the counts and findings, as JSON")
    asked = options.parse_args()
    chosen = [BY_NAME[name] for name in asked.parser] if asked.parser else list(PARSERS)
    if asked.input is not None:
        return reproduce_input(chosen[0].name, asked.input, asked.seed, asked.keep)
    begun = time.monotonic()
    readings = run_study(chosen, asked.count, seed=asked.seed, workers=asked.workers)
    table = {name: count_outcomes(rows) for name, rows in readings.items()}
    table["all"] = count_outcomes([reading for rows in readings.values() for reading in rows])
    columns = list(table["all"])
    print(f"{'parser':22}" + "".join(f"{column:>12}" for column in columns))
    for name, row in table.items():
        print(f"{name:22}" + "".join(f"{row[column]:>12}" for column in columns))
    print(f"{time.monotonic() - begun:.0f} s with {asked.workers} processes")
    found = list_findings(readings)
    kinds: dict[tuple[str, str, str], list[int]] = defaultdict(list)
    for reading in found:
        kinds[reading.parser, reading.outcome, _name_kind(reading.detail)].append(reading.number)
    for (name, outcome, detail), numbers in sorted(kinds.items()):
        print(f"{name}: {outcome}: {detail} ({len(numbers)} times, such as input {numbers[0]})")
    if asked.out:
        told = [
            {"parser": r.parser, "input": r.number, "outcome": r.outcome, "detail": r.detail} for r in found
        ]
        Path(asked.out).write_text(json.dumps({"counts": table, "findings": told}, indent=1))
    print(f"findings: {dict(Counter(reading.outcome for reading in found)) or 'none'}")
    return int(bool(found))


def _name_kind(detail: str) -> str:
    """Place and exception, without what differs from input to input."""
    place, _, rest = detail.partition(" ")
    return f"{place} {rest.split(':')[0]}" if ".py:" in place else detail


if __name__ == "__main__":
    sys.exit(main())
