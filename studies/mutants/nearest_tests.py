"""Which tests are asked about a changed file, and in which order."""

from collections.abc import Iterator
from pathlib import Path


def list_nearest_tests(tree: Path, file: Path) -> Iterator[list[str]]:
    """Yield groups of test files, those nearest to a changed file first; none twice.

    First those that are named after the file or import it, then those of the folder that mirrors its own, then those
    that import something else of its folder.

    Parameters
    ----------
    tree : root of the sources
    file : path of the changed file in it
    """
    texts = {path: path.read_text(encoding="utf-8") for path in sorted((tree / "tests").rglob("test_*.py"))}
    mirror = tree.joinpath("tests", *file.parts[1:-1])
    while not mirror.is_dir():
        mirror = mirror.parent
    below_mirror = [path for path in texts if mirror.name != "tests" and path.is_relative_to(mirror)]
    module, folder = ".".join(file.with_suffix("").parts), ".".join(file.parent.parts)
    named = [path for path in texts if set(file.stem.split("_")) <= set(path.stem.split("_"))]
    importing = [path for path, text in texts.items() if f"from {module} import" in text]
    seen: set[Path] = set()
    for group in (
        [path for path in texts if path in importing or (path in named and path in below_mirror)],
        below_mirror,
        [path for path, text in texts.items() if f"from {folder}" in text],
    ):
        fresh = [path for path in group if path not in seen]
        seen.update(fresh)
        if fresh:
            ordered = sorted(fresh, key=lambda path: (path not in named, path not in below_mirror, path))
            yield [str(path.relative_to(tree)) for path in ordered]
