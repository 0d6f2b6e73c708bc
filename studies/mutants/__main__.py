"""``python -m studies.mutants [--count 40] [--seed 1] [--under tasks]``: how many changes do the tests catch?

Each change is made in a copy of the tree. The test files that import the changed one run first, then those of the
folder that mirrors its own, then those that import its folder. The first failure ends the run, and so does the end of
the work that ``--cpu-s`` allows. ``--numbers 3 17`` asks again about some of the chosen changes.
"""

import argparse
import json
import random
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

from manifests.provenance import SOURCE_ROOT
from studies.mutants.kernels import kernels_of_a_change
from studies.mutants.nearest_tests import list_nearest_tests
from studies.mutants.places import Place, places_of
from studies.mutants.warm_python import WarmPython, start_warm_python

LONGEST_S = 600.0
"""One group of tests may take this long by the clock [s]; what ends in time only without a change has caught it."""
ENOUGH_CPU_S = 60.0
"""Work of tests on one change after which no further one is asked [s]: a change that the nearest miss survives."""
SHARE = 0.9
"""Least share of the changes that have to be caught [1]."""


def chosen_places(tree: Path, under: str, count: int, seed: int) -> list[Place]:
    """Return places drawn at random among those of every file below a folder.

    Parameters
    ----------
    tree : root of the sources
    under : folder or file in it
    count : how many [1]
    seed : of the choice
    """
    root = tree / under
    files = sorted(root.rglob("*.py")) if root.is_dir() else [root]
    places = [
        place
        for file in files
        for place in places_of(file.relative_to(tree), file.read_text(encoding="utf-8"))
    ]
    return random.Random(seed).sample(places, min(count, len(places)))


def first_failure(
    python: WarmPython, tree: Path, kernels: Path, tests: list[str], most_cpu_s: float = LONGEST_S
) -> tuple[str | None, float]:
    """Return the first test that fails, or None, and the work of all [s].

    Parameters
    ----------
    python : what runs the tests
    tree : sources and tests
    kernels : folder of compiled kernels
    tests : files, or names of tests
    most_cpu_s : work after which no further test is asked [s]
    """
    environment = {
        "PYTHONDONTWRITEBYTECODE": "1", "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1", "PYTHONPATH": str(tree),
        "MUSYNC_CACHE": str(kernels.parent / "cache"), "NUMBA_CACHE_DIR": str(kernels),
    }  # fmt: skip
    arguments = ["-x", "-q", "-p", "no:cacheprovider", *tests]
    ended = python.run_tests(tree, arguments, environment, longest_s=LONGEST_S, most_cpu_s=most_cpu_s)
    if ended.code in (0, 5, -signal.SIGXCPU):
        return None, ended.cpu_s
    if ended.code is None:
        return f"over {LONGEST_S:g} s", ended.cpu_s
    failed = [line for line in ended.output.splitlines() if line.startswith(("FAILED ", "ERROR "))]
    name = failed[0].split(" - ")[0].split(" ", 1)[1] if failed else f"exit code {ended.code}"
    return name, ended.cpu_s


def caught_by(
    python: WarmPython, tree: Path, place: Place, enough_cpu_s: float = ENOUGH_CPU_S
) -> tuple[str | None, float]:
    """Return the first test that fails with a change and passes without it, or None, and the work of all tests [s].

    The tree is left as it was.

    Parameters
    ----------
    python : what runs the tests
    tree : a copy of the sources, to change; beside it lie kernels and caches
    place : the change
    enough_cpu_s : work after which no further test is asked [s]

    Raises
    ------
    RuntimeError
        If a test fails without the change too.
    """
    file, kept = tree / place.file, tree.parent / "kernels"
    sound, spent = file.read_text(encoding="utf-8"), 0.0
    for tests in list_nearest_tests(tree, place.file):
        if spent >= enough_cpu_s - 1.0:
            break
        with kernels_of_a_change(tree, place.file, kept) as kernels:
            file.write_text(place.applied(sound), encoding="utf-8")
            try:
                failed, cpu_s = first_failure(python, tree, kernels, tests, enough_cpu_s - spent)
            finally:
                file.write_text(sound, encoding="utf-8")
        spent += cpu_s
        if failed is None:
            continue
        again, cpu_s = first_failure(python, tree, kept, [failed] if failed.startswith("tests/") else tests)
        spent += cpu_s
        if again is None:
            return failed, spent
        if again.startswith("over "):
            return None, spent
        raise RuntimeError(f"{failed} without a change too")
    return None, spent


def copy_tree(folder: Path) -> Path:
    """Copy what git lists, with changes that are not committed."""
    listed = subprocess.run(
        ["git", "ls-files", "--cached", "--others", "--exclude-standard"],
        cwd=SOURCE_ROOT, capture_output=True, text=True, check=True,
    )  # fmt: skip
    for name in listed.stdout.splitlines():
        source, copy = SOURCE_ROOT / name, folder / name
        if source.is_file():
            copy.parent.mkdir(parents=True, exist_ok=True)
            copy.write_bytes(source.read_bytes())
    return folder


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=40)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--under", default="tasks")
    parser.add_argument("--cpu-s", type=float, default=ENOUGH_CPU_S)
    parser.add_argument("--numbers", type=int, nargs="*", help="of the chosen changes, these alone, from 1")
    asked = parser.parse_args()
    survived, work = [], 0.0
    with tempfile.TemporaryDirectory() as scratch, start_warm_python() as python:
        tree = copy_tree(Path(scratch) / "tree")
        chosen = list(enumerate(chosen_places(tree, asked.under, asked.count, asked.seed), 1))
        if asked.numbers:
            chosen = [chosen[number - 1] for number in asked.numbers]
        for number, place in chosen:
            test, spent = caught_by(python, tree, place, asked.cpu_s)
            work += spent
            what = f"{place.file}:{place.line}: {place.before} -> {place.after}"
            print(f"{number}: {what}: {test or 'SURVIVED'} ({spent:.0f} s)", file=sys.stderr, flush=True)
            survived += [] if test else [what]
    caught = len(chosen) - len(survived)
    print(json.dumps({"places": len(chosen), "caught": caught, "survived": survived, "cpu_s": round(work)}))
    sys.exit(0 if caught >= SHARE * len(chosen) else 1)
