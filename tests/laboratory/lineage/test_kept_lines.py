"""Lines of kept files: every number with a source is one, and a file with one changed still is a sound entry."""

import pytest

from catalogs.entries import find_entry, load
from catalogs.tyres import tyre_entries
from catalogs.vehicles import open_vehicle
from studies.lineage.kept_lines import list_lines, scale_line


@pytest.mark.parametrize("name", ["paper-reference", "multibody-grown"])
def test_one_number_of_a_vehicle_changes_and_no_other_and_a_frozen_one_is_sealed_anew(name, tmp_path):
    source = find_entry("vehicle", name)
    content = source.read_bytes()
    (tmp_path / source.name).write_bytes(scale_line("vehicle.yaml", content, ("cg_height",), 1.01))
    before, after = load("vehicle", name), load("vehicle", tmp_path / source.name)
    assert after.cg_height == pytest.approx(1.01 * before.cg_height)
    changed = [field for field in vars(before) if getattr(before, field) != getattr(after, field)]
    assert changed == ["cg_height"]
    assert (open_vehicle(name).provenance is None) == (
        open_vehicle(tmp_path / source.name).provenance is None
    )


def test_knots_bounds_and_a_zero_are_changed_too():
    content = (
        b"a: {b: {value: [2, 0], unit: m, bounds: [1, 3], source: x}}\nc: {value: 5, unit: m, source: y}\n"
    )
    one, other = list_lines("surface.yaml", scale_line("surface.yaml", content, ("a", "b"), 1.5))
    assert (one.key, one.value, other.value) == ("a.b", [3.0, 0.5], 5)
    assert b"bounds: [1.5, 4.5]" in scale_line("surface.yaml", content, ("a", "b"), 1.5)


def test_a_line_of_a_tyre_file_changes_alone_and_carries_the_files_own_source():
    content = find_entry("tyre", "pacejka-205-60r15").read_bytes()
    lines = {line.key: line for line in list_lines("a.tir", content)}
    assert "Pacejka" in lines["PDX1"].source and "FILE_TYPE" not in lines
    before, after = tyre_entries(content), tyre_entries(scale_line("a.tir", content, ("PDX1",), 2.0))
    assert {key: after[key] for key in before if before[key] != after[key]} == {"PDX1": "2.42"}
