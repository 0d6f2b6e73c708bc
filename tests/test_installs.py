"""The packages that `make` installs are one choice within pyproject.toml's bounds, with hashes, for every Python."""

import re
import tomllib

import pytest
from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet
from packaging.utils import canonicalize_name
from packaging.version import Version

from manifests.provenance import SOURCE_ROOT

PROJECT = tomllib.loads((SOURCE_ROOT / "pyproject.toml").read_text())["project"]
LISTED = (SOURCE_ROOT / "constraints.txt").read_text()
ENTRIES = [
    (Requirement(head), re.findall(r"--hash=sha256:([0-9a-f]{64})\b", rest))
    for head, rest in re.findall(r"^([a-z0-9][^\\\n]*?) \\\n((?:    --hash=.*\n?)+)", LISTED, flags=re.M)
]
ASKED = [Requirement(line) for line in PROJECT["dependencies"] + PROJECT["optional-dependencies"]["dev"]]
STATED = [c.rsplit(" ", 1)[1] for c in PROJECT["classifiers"] if "Python :: 3." in c]


def chosen(python: str, platform: str) -> dict[str, list[str]]:
    """Name to the versions that would be installed there."""
    place = {
        "python_version": python, "python_full_version": f"{python}.9", "sys_platform": platform,
        "platform_python_implementation": "CPython", "implementation_name": "cpython",
    }  # fmt: skip
    found: dict[str, list[str]] = {}
    for entry, _ in ENTRIES:
        if entry.marker is None or entry.marker.evaluate(place):
            found.setdefault(entry.name, []).append(str(entry.specifier).removeprefix("=="))
    return found


@pytest.mark.parametrize("platform", ["linux", "darwin"])
@pytest.mark.parametrize("python", STATED)
def test_every_requirement_has_one_version_within_its_bounds(python, platform):
    """After a change of pyproject.toml: make lock."""
    listed = chosen(python, platform)
    assert all(len(versions) == 1 for versions in listed.values())
    outside = [
        str(asked)
        for asked in ASKED
        if asked.name != "torch"
        and not asked.specifier.contains(listed.get(canonicalize_name(asked.name), ["0"])[0])
    ]
    assert outside == []


def test_every_entry_has_a_version_and_hashes_and_no_address():
    lines = [line for line in LISTED.splitlines() if line and not line.startswith((" ", "#"))]
    assert len(lines) == len(ENTRIES) > 100
    assert all(re.fullmatch(r"==[^,]+", str(entry.specifier)) and hashes for entry, hashes in ENTRIES)
    assert "://" not in LISTED


def test_torch_and_what_its_cuda_builds_need_are_left_to_the_index():
    assert not [e.name for e, _ in ENTRIES if re.match(r"torch$|nvidia-|triton|cuda-", e.name)]


def test_every_requirement_has_an_upper_bound():
    extras = [Requirement(line) for lines in PROJECT["optional-dependencies"].values() for line in lines]
    open_ended = [
        str(asked)
        for asked in ASKED + extras
        if not any(bound.operator in {"<", "=="} for bound in asked.specifier)
    ]
    assert open_ended == []


def test_the_stated_pythons_are_those_that_may_install():
    allowed = SpecifierSet(PROJECT["requires-python"])
    assert [f"3.{minor}" for minor in range(9, 20) if Version(f"3.{minor}.9") in allowed] == STATED
