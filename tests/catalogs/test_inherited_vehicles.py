"""A vehicle that extends another one: what is inherited, what is refused, and what a copy of it holds."""

import hashlib
from dataclasses import replace

import pytest

from catalogs.entries import entry_names, find_entry, load
from catalogs.vehicles import open_vehicle
from catalogs.vehicles.inherited import MOST_GENERATIONS
from tasks.errors import InputError
from tasks.vehicle.effects.table import EFFECT_UNITS
from tasks.vehicle.parameters import Vehicle

HEAVY = "sprung_mass: {value: 1500, unit: kg, source: scales, tolerance: 15}\n"


@pytest.fixture
def write(tmp_path):
    def write(name, text):
        path = tmp_path / name
        path.write_text(text)
        return path

    return write


def refusal(path):
    with pytest.raises(InputError) as caught:
        load("vehicle", path)
    (problem,) = caught.value.problems
    return problem


def test_what_is_not_given_is_that_of_the_other_vehicle(write):
    base = load("vehicle", "paper-reference")
    car = load("vehicle", write("car.yaml", f"extends: paper-reference\n{HEAVY}"))
    assert car == replace(base, name="car", sprung_mass=1500)


def test_families_their_tables_and_effects_are_inherited_one_by_one_and_forms_as_a_whole(write):
    write(
        "base.yaml",
        """
extends: paper-reference
effects:
  drag_area: {value: 0.6, unit: m2, source: data sheet}
  lag: {value: 0.05, unit: s, source: stop}
tyre: pacejka-205-60r15
""",
    )
    car = load(
        "vehicle",
        write(
            "car.yaml",
            """
extends: base.yaml
families:
  rain: {efficiency: {value: [0.8, 0.8, 0.8, 0.8], unit: "1", source: worn}}
effects:
  lag: {value: 0.1, unit: s, source: another stop}
""",
        ),
    )
    base = load("vehicle", "paper-reference")
    assert car.effects == {"drag_area": 0.6, "lag": 0.1}
    assert car.tyre is not None
    assert car.families == {
        **base.families,
        "rain": replace(base.families["rain"], efficiency=(0.8, 0.8, 0.8, 0.8)),
    }
    assert load("vehicle", write("bare.yaml", "extends: base.yaml\ntyre: null\n")).tyre is None


def test_a_number_is_inherited_with_its_tolerance_or_given_whole(write):
    write("base.yaml", f"extends: paper-reference\n{HEAVY}")
    assert open_vehicle(write("car.yaml", "extends: base.yaml\n")).tolerances == {"sprung_mass": 0.01}
    own = write("own.yaml", "extends: base.yaml\nsprung_mass: {value: 1400, unit: kg, source: scales}\n")
    assert open_vehicle(own).tolerances == {}
    half = write("half.yaml", "extends: base.yaml\nsprung_mass: {tolerance: 3}\n")
    with pytest.raises(InputError, match=r"sprung_mass\.value is missing"):
        load("vehicle", half)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("extends: tractor", "a file beside this one; tractor: no such vehicle; give a YAML file or one of: bmw-320i"),
        ("extends: tractor.yaml", "tractor.yaml: no such vehicle"),
        ("extends: ../car.yaml", "the name of the vehicle that it extends must be no path; it is '../car.yaml'"),
        ("extends: ''", "must have 1 to 100 characters"),
        ("extends: [paper-reference]", "extends must be the name of a vehicle; it is ['paper-reference']"),
        ("extends: car.yaml", "car.yaml -> car.yaml leads back to itself: remove one extends"),
        ("extends: paper-reference\nsprung_mass: {value: 1, unit: g, source: s}", "unit must be kg; it is g"),
        ("extends: paper-reference\ncolour: 3", "colour: unknown key"),
        ("extends: paper-reference\nfamilies:", "families: must be a table of keys and values; it is None"),
    ],
)  # fmt: skip
def test_what_cannot_be_inherited_is_one_sentence(write, text, words):
    path = write("car.yaml", text)
    problem = refusal(path)
    assert words in problem and problem.startswith(str(path))


def test_a_loop_is_told_with_every_file_of_it(write):
    write("a.yaml", "extends: b.yaml")
    write("b.yaml", "extends: c.yaml")
    write("c.yaml", "extends: b.yaml")
    path = write("car.yaml", "extends: a.yaml")
    assert "car.yaml -> a.yaml -> b.yaml -> c.yaml -> b.yaml leads back to itself" in refusal(path)


def test_a_line_of_files_has_an_end(write):
    write("0.yaml", "extends: paper-reference")
    for k in range(1, MOST_GENERATIONS):
        write(f"{k}.yaml", f"extends: {k - 1}.yaml")
    assert load("vehicle", write("last.yaml", f"extends: {MOST_GENERATIONS - 3}.yaml")).mass == 1308
    assert "at most 8 files may extend each other" in refusal(
        write("car.yaml", f"extends: {MOST_GENERATIONS - 1}.yaml")
    )


@pytest.mark.parametrize("name", entry_names("vehicle"))
def test_a_vehicle_that_extends_none_is_kept_as_its_file_is(name):
    assert open_vehicle(name).content == find_entry("vehicle", name).read_bytes()


@pytest.mark.parametrize("base", entry_names("vehicle"))
def test_the_whole_copy_loads_alone_as_the_same_car(write, tmp_path, base):
    write(
        "base.yaml", f"extends: {base}\ncg_height: {{value: 0.6, unit: m, source: guess, tolerance: 0.03}}\n"
    )
    path = write("car.yaml", f"extends: base.yaml\n{HEAVY}")
    (tmp_path / "elsewhere").mkdir()
    copy = tmp_path / "elsewhere" / "car.yaml"
    copy.write_bytes(open_vehicle(path).content)
    assert b"extends" not in copy.read_bytes()
    assert load("vehicle", copy) == load("vehicle", path)
    assert (
        open_vehicle(copy).tolerances
        == open_vehicle(path).tolerances
        == {"cg_height": pytest.approx(0.05), "sprung_mass": 0.01}
    )
    assert open_vehicle(copy).content == copy.read_bytes()
    assert open_vehicle(copy).provenance == open_vehicle(path).provenance


def test_the_whole_copy_names_the_hash_of_every_file_in_it(write):
    base = write("base.yaml", "extends: paper-reference\n")
    path = write("car.yaml", f"extends: base.yaml\n{HEAVY}")
    before = open_vehicle(path).content
    first = before.splitlines()[0].decode()
    for content in (path.read_bytes(), open_vehicle(base).content):
        assert hashlib.sha256(content).hexdigest() in first
    base.write_text("extends: paper-reference\n# another word, and the same car\n")
    assert (
        open_vehicle(path).content != before
        and open_vehicle(path).content.splitlines()[1:] == before.splitlines()[1:]
    )


def test_numbers_over_a_frozen_vehicle_keep_its_mode_and_bounds_and_say_whose_they_are(write):
    path = write("car.yaml", f"extends: multibody-grown\n{HEAVY}")
    provenance, before = open_vehicle(path).provenance, open_vehicle("multibody-grown").provenance
    assert (provenance.mode, provenance.bounds, provenance.base) == (
        "coupled",
        before.bounds,
        "multibody-grown",
    )
    assert provenance.base_sha256 == hashlib.sha256(open_vehicle("multibody-grown").content).hexdigest()
    assert provenance.procedure_sha256 == hashlib.sha256(path.read_bytes()).hexdigest()
    assert provenance.procedure == f"numbers of its own over those of multibody-grown: {before.procedure}"


def test_a_frozen_vehicle_that_was_changed_lends_nothing(write):
    frozen = find_entry("vehicle", "multibody-grown").read_text()
    write("base.yaml", frozen.replace("sprung_mass: {value: 12", "sprung_mass: {value: 13"))
    assert "a frozen vehicle must be as it was frozen" in refusal(write("car.yaml", "extends: base.yaml"))


def test_the_tyre_lies_beside_the_file_that_names_it(write, tmp_path):
    tyre = find_entry("tyre", "pacejka-205-60r15")
    (tmp_path / tyre.name).write_bytes(tyre.read_bytes())
    write("base.yaml", "extends: paper-reference\ntyre: pacejka-205-60r15\n")
    assert open_vehicle(write("car.yaml", "extends: base.yaml")).tyre_source == tmp_path / tyre.name


@pytest.mark.parametrize(
    ("number", "words"),
    [
        (
            "{value: 0.55, unit: m, source: s, tolerance: 0}",
            "cg_height.tolerance: must be greater than 0; it is 0",
        ),
        ("{value: 0.55, unit: m, source: s, tolerance: 5 %}", "it is '5 %': write it without the sign"),
        ("{value: 0.55, unit: m, source: s, tolerance: .nan}", "must be a finite number"),
    ],
)
def test_a_tolerance_that_is_none_is_refused(write, number, words):
    assert words in refusal(write("car.yaml", f"extends: paper-reference\ncg_height: {number}\n"))


@pytest.mark.parametrize(
    ("number", "words"),
    [
        ("{value: '0,55', unit: m, source: s}", "it is '0,55': write it with a point, 0.55"),
        ("{value: 5.5e-1, unit: m, source: s, tolerance: 1e2}", "the sign of the power, 1.0e+2"),
        ("{value: 55e-2, unit: m, source: s}", "the sign of the power, 55.0e-2"),
        ("{value: 0.55, unit: m, source: 7}", "it is 7: put it in quotes"),
        ("{value: 055, unit: m, source: s}", "YAML takes 055 for one to the base of 8 or 60"),
    ],
)
def test_a_number_as_people_write_it_is_told_how_yaml_wants_it(write, number, words):
    assert words in refusal(write("car.yaml", f"extends: paper-reference\ncg_height: {number}\n"))


def test_a_tolerance_is_one_sigma_in_the_numbers_own_unit_and_is_asked_for_as_a_share_of_the_value(write):
    path = write(
        "car.yaml",
        """
extends: paper-reference
static_pitch: {value: -0.5, unit: deg, source: level, tolerance: 0.1}
effects:
  drag_area: {value: 0.6, unit: m2, source: data sheet, tolerance: 0.03}
""",
    )
    assert open_vehicle(path).tolerances == pytest.approx({"static_pitch": 0.2, "drag_area": 0.05})
    assert open_vehicle("paper-reference").tolerances == {}
    zero = write(
        "zero.yaml", "extends: car.yaml\nstatic_pitch: {value: 0, unit: deg, source: s, tolerance: 0.1}\n"
    )
    assert "static_pitch: a value of 0 must have no tolerance" in refusal(zero)


def test_fields_and_numbers_of_effects_share_no_name():
    assert not EFFECT_UNITS.keys() & Vehicle.__dataclass_fields__.keys()
