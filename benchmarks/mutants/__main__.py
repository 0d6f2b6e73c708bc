"""``python -m benchmarks.mutants [--count 40] [--seed 1] [--under tasks]``: how many changes do the tests catch?

Each change is made in a copy of the tree. The tests of the folder that mirrors the changed one run first, then the test
files that import the changed module, then those that import its folder; the first failure ends the run.
"""

import argparse
import json
import os
import random
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

from benchmarks.mutants.places import Place, places_of
from manifests.provenance import SOURCE_ROOT

LONGEST_S = 900.0
"""A change with which a test goes on for ever is caught [s]."""


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


def tests_for(tree: Path, file: Path) -> Iterator[list[str]]:
    """Yield test files, those nearest to a changed file first; none twice.

    Parameters
    ----------
    tree : root of the sources
    file : path of the changed file in it
    """
    tests = sorted((tree / "tests").rglob("test_*.py"))
    mirror = tree.joinpath("tests", *file.parts[1:-1])
    while not mirror.is_dir():
        mirror = mirror.parent
    texts = {path: path.read_text(encoding="utf-8") for path in tests}
    module, folder = ".".join(file.with_suffix("").parts), ".".join(file.parent.parts)
    seen: set[Path] = set()
    for group in (
        [path for path in tests if module in texts[path]],
        [path for path in tests if path.is_relative_to(mirror) and mirror.name != "tests"],
        [path for path in tests if f"from {folder}" in texts[path]],
    ):
        fresh = [str(path.relative_to(tree)) for path in group if path not in seen]
        seen.update(group)
        if fresh:
            yield fresh


def caught_by(tree: Path, place: Place) -> str | None:
    """Return the first test that fails with a change, or None; the tree is left as it was.

    Parameters
    ----------
    tree : a copy of the sources, to change
    place : the change
    """
    file = tree / place.file
    sound = file.read_text(encoding="utf-8")
    file.write_text(place.applied(sound), encoding="utf-8")
    environment = os.environ | {"PYTHONPATH": str(tree), "MUSYNC_CACHE": str(tree / ".cache")}
    environment.pop("NUMBA_CACHE_DIR", None)
    try:
        for tests in tests_for(tree, place.file):
            command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", *tests]
            done = subprocess.run(
                command, cwd=tree, env=environment, capture_output=True, text=True, timeout=LONGEST_S
            )
            if done.returncode not in (0, 5):
                failed = [line for line in done.stdout.splitlines() if line.startswith(("FAILED", "ERROR"))]
                if not failed:
                    return f"exit code {done.returncode}"
                name = failed[0].split(" - ")[0].split(" ", 1)[1]
                file.write_text(sound, encoding="utf-8")
                again = [*command[: -len(tests)], name]
                if subprocess.run(again, cwd=tree, env=environment, capture_output=True).returncode:
                    raise RuntimeError(f"{name} fails without a change too")
                return name
    except subprocess.TimeoutExpired:
        return f"over {LONGEST_S:g} s"
    finally:
        file.write_text(sound, encoding="utf-8")
    return None


def copy_of_the_tree(folder: Path) -> Path:
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
    asked = parser.parse_args()
    survived = []
    with tempfile.TemporaryDirectory() as scratch:
        tree = copy_of_the_tree(Path(scratch) / "tree")
        chosen = chosen_places(tree, asked.under, asked.count, asked.seed)
        for number, place in enumerate(chosen, 1):
            test = caught_by(tree, place)
            what = f"{place.file}:{place.line}: {place.before} -> {place.after}"
            print(f"{number} of {len(chosen)}: {what}: {test or 'SURVIVED'}", file=sys.stderr, flush=True)
            survived += [] if test else [what]
    caught = len(chosen) - len(survived)
    print(json.dumps({"places": len(chosen), "caught": caught, "survived": survived}))
    sys.exit(0 if caught >= 0.9 * len(chosen) else 1)
