"""The mutation study: the places that it changes, which tests it asks first, and which kernels it compiles again."""

from pathlib import Path

import pytest

from studies.mutants.__main__ import caught_by, chosen_places
from studies.mutants.kernels import kernels_of_a_change, list_stale_kernels
from studies.mutants.nearest_tests import list_nearest_tests
from studies.mutants.places import places_of
from studies.mutants.warm_python import start_warm_python

SOURCES = {
    "tasks/law.py": "from tasks.level import LEVEL\n\n@njit\ndef height(x):\n    return x + LEVEL\n",
    "tasks/level.py": "LEVEL = 1.5\n",
    "tasks/other.py": "@njit\ndef twice(x):\n    return 2 * x\n",
    "tasks/road/bump.py": "def rise(x: int) -> int:\n    return x + 1\n",
    "tests/road/test_bump.py": "from tasks.road.bump import rise\ndef test_rise():\n    assert rise(1) == 2\n",
    "tests/road/test_edge.py": "",
    "tests/test_all.py": "# from tasks.road import dip\n",
    "tests/test_far.py": "",
}


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    for name, text in SOURCES.items():
        (tmp_path / "tree" / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "tree" / name).write_text(text)
    return tmp_path / "tree"


def test_operators_and_numbers_are_changed_and_neither_texts_nor_types_nor_errors():
    text = 'def f(x: "1 + 1"):\n    if x > 2 and not x:\n        raise E(3 - 1)\n    return f"{x * 5}" + x\n'
    found = [(place.before, place.after) for place in places_of(Path("f.py"), text)]
    assert sorted(found) == [("+", "-"), ("2", "3"), (">", ">="), ("and", "or")]
    changed = {place.applied(text) for place in places_of(Path("f.py"), text)}
    assert text.replace("x > 2", "x > 3") in changed and text.replace(" and ", " or ") in changed


def test_the_choice_follows_from_its_seed(tree):
    first, again, other = (chosen_places(tree, "tasks", 3, seed) for seed in (1, 1, 2))
    assert first == again != other and len(first) == 3


def test_the_nearest_tests_are_asked_first_and_none_twice(tree):
    groups = list(list_nearest_tests(tree, Path("tasks/road/bump.py")))
    assert groups == [["tests/road/test_bump.py"], ["tests/road/test_edge.py"], ["tests/test_all.py"]]


def test_kernels_that_reach_a_change_are_compiled_again_elsewhere_and_others_kept(tree, tmp_path):
    law, kept = tree / "tasks" / "law.py", tmp_path / "kernels"
    assert list_stale_kernels(tree, Path("tasks/level.py")) == [Path("tasks/law.py")]
    before = law.stat().st_mtime_ns
    with kernels_of_a_change(tree, Path("tasks/level.py"), kept) as folder:
        assert folder != kept and law.stat().st_mtime_ns != before
    assert law.stat().st_mtime_ns == before and not folder.exists()
    with kernels_of_a_change(tree, Path("tasks/road/bump.py"), kept) as folder:
        assert folder == kept


def test_a_change_is_caught_by_a_test_that_passes_without_it_and_the_tree_is_left_as_it_was(tree):
    file = Path("tasks/road/bump.py")
    plus = next(place for place in places_of(file, SOURCES[str(file)]) if place.before == "+")
    (unseen,) = places_of(Path("tasks/level.py"), SOURCES["tasks/level.py"])
    with start_warm_python(libraries=("pytest",)) as python:
        assert caught_by(python, tree, plus)[0] == "tests/road/test_bump.py::test_rise"
        assert (tree / file).read_text() == SOURCES[str(file)]
        assert caught_by(python, tree, unseen)[0] is None
