"""Tyre property files: what is read, what each fault is called, and how a vehicle and a dataset hold theirs."""

import re
from pathlib import Path

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from catalogs.documents import LARGEST_YAML
from catalogs.entries import entry_folder, entry_names, find_entry, load
from catalogs.tyres import parse_tyre
from flows.making.plan import make_plan
from manifests.explain import find_input_differences
from tasks.errors import InputError
from tasks.vehicle.tyres.magic_formula import MagicFormula, compute_tyre_forces

BOOK = (entry_folder("tyre") / "pacejka-205-60r15.tir").read_text()


def changed(*changes: tuple[str, str]) -> bytes:
    """The book's file with each key's line replaced by another; each key stands there."""
    text = BOOK
    for key, line in changes:
        text, count = re.subn(rf"(?m)^{key}\b.*$", line, text)
        assert count == 1, key
    return text.encode()


def problems(content: bytes) -> list[str]:
    with pytest.raises(InputError) as error:
        parse_tyre(content, "my.tir")
    return list(error.value.problems)


def test_every_tyre_of_the_catalogue_is_read_and_a_wrong_name_lists_them():
    assert "pacejka-205-60r15" in entry_names("tyre")
    assert all(isinstance(load("tyre", name), MagicFormula) for name in entry_names("tyre"))
    with pytest.raises(
        InputError, match=r"slick: no such tyre; give a .tir file or one of: .*pacejka-205-60r15"
    ):
        load("tyre", "slick")


def test_coefficients_stand_in_their_places():
    """Table A3.1: PKX1 21.51, PKY1 -14.95, RVY6 -10.71 at 4000 N."""
    tyre = load("tyre", entry_folder("tyre") / "pacejka-205-60r15.tir")
    assert (tyre.nominal_load, tyre.longitudinal.pkx1, tyre.lateral.pky1) == (4000.0, 21.51, -14.95)
    assert tyre.combined.rvy6 == -10.71 and tyre.lateral.pky4 == 2.0


def test_comments_quotes_case_and_sections_of_no_interest_change_nothing():
    text = BOOK.replace("FORCE = 'newton'", "force='Newton'   ! in N").replace(
        "PCX1 = 1.685", " pcx1=1.685$ shape °"
    )
    text = text.replace("[VERTICAL]", "[SHAPE]\n{radial width}\n 1.0 0.0\n[Vertical]").replace("\n", "\r\n")
    text += "[TYRE_MAKER]\nPDX1 = 7\nno key at all\n"
    assert parse_tyre(text.encode("latin-1"), "my.tir") == parse_tyre(BOOK.encode(), "my.tir")


def test_pressure_counts_by_its_distance_from_the_nominal_one():
    """Stiffness by PPX1 dp, friction by PPX3 dp (Pacejka 2012, 4.E13 and 4.E15); 242 kPa are a tenth above 220 kPa."""
    tyre = parse_tyre(
        changed(("INFLPRES", "INFLPRES = 242000"), ("PVX2", "PVX2 = 0\nPPX1 = -0.5\nPPX3 = -0.2")), ""
    )
    assert tyre.longitudinal.pkx1 == pytest.approx(21.51 * 0.95)
    assert tyre.longitudinal.pdx1 == pytest.approx(1.21 * 0.98)


def test_all_that_is_missing_is_said_in_one_sentence():
    content = changed(("PDX2", ""), ("PKX3", ""), ("RVY5", ""), ("FNOMIN", ""))
    (problem,) = problems(content)
    assert problem == (
        "my.tir: MF 6.1 needs FNOMIN, PDX2, PKX3, RVY5: add them, with 0 for what has no influence"
    )
    assert "MF 5.2 needs PHY3:" in problems(changed(("FITTYP", "FITTYP = 52")))[0]


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ([("FITTYP", "FITTYP = 21")], "FITTYP must be 6 or 52 (MF 5.2), 61 or 62 (MF 6.1); it is '21'"),
        ([("FITTYP", "")], "FITTYP must be 6 or 52 (MF 5.2), 61 or 62 (MF 6.1); it is None"),
        ([("LENGTH", "LENGTH = 'inch'")], "LENGTH must be meter; it is 'inch'"),
        ([("ANGLE", "ANGLE = 'degrees'")], "ANGLE must be radian; it is 'degrees'"),
        ([("PDX1", "PDX1 = fast")], "PDX1 must be a finite number; it is 'fast'"),
        ([("PDX1", "PDX1 = inf")], "PDX1 must be a finite number; it is 'inf'"),
        ([("PDX1", "PDX1 = 1.21\nPDX1 = 1.3")], "PDX1 must stand once; it stands again in line"),
        ([("PDX1", "PDX1 = 1.21\nsomething")], "must be KEY = value, as all of [LONGITUDINAL_COEFFICIENTS]"),
        ([("FNOMIN", "FNOMIN = 0")], "FNOMIN and LFZO must be above 0; they are 0 and 1"),
        ([("PCX1", "PCX1 = 0.9")], "PCX1 LCX must be above 1 and at most 2"),
        ([("PDX1", "PDX1 = -1.21")], "peak friction and slip stiffness must be above 0"),
        ([("PDX2", "PDX2 = -0.7")], "under 3 FNOMIN they are -0.19"),
        ([("PKX3", "PKX3 = 900")], "peak friction and slip stiffness must be above 0"),
        ([("PCY1", "PCY1 = 0")], "PCY1 LCY must be above 0 and at most 2; it is 0"),
        ([("PKY2", "PKY2 = 0"), ("PKY4", "PKY4 = 0")], "the coefficients must give finite forces"),
    ],
)
def test_each_fault_is_named_with_its_value(changes, words):
    assert any(words in problem for problem in problems(changed(*changes)))


def test_all_faults_are_told_at_once():
    content = changed(
        ("FITTYP", "FITTYP = 61\nwhat"), ("MASS", "MASS = 'lb'"), ("PDX1", "PDX1 = x"), ("PCX1", "")
    )
    assert [problem.split(": ")[1][:8] for problem in problems(content)] == [
        "line 16 ", "MASS mus", "MF 6.1 n", "PDX1 mus",
    ]  # fmt: skip


def test_a_file_without_bounds_is_not_read(tmp_path):
    (tmp_path / "big.tir").write_bytes(b"$" * (LARGEST_YAML + 1))
    with pytest.raises(InputError, match="a tyre must have at most 8388608 bytes"):
        load("tyre", tmp_path / "big.tir")


@given(st.binary(max_size=200), st.integers(0, len(BOOK)), st.integers(0, 40))
def test_damaged_files_are_read_or_refused_in_sentences(noise, at, lost):
    content = BOOK.encode()[:at] + noise + BOOK.encode()[at + lost :]
    try:
        tyre = parse_tyre(content, "my.tir")
    except InputError as error:
        assert all(problem.startswith("my.tir: ") and len(problem) < 1000 for problem in error.problems)
    else:
        assert abs(compute_tyre_forces(-0.1, 0.05, 0.0, tyre.nominal_load, tyre)[0]) < float("inf")


def own_vehicle(folder: Path, tyre: object) -> Path:
    entry = yaml.safe_load(find_entry("vehicle", "paper-reference").read_text())
    path = folder / "car.yaml"
    path.write_text(yaml.safe_dump(entry | {"tyre": tyre}, sort_keys=False))
    return path


def test_a_vehicle_names_its_tyre_in_the_catalogue_or_beside_itself(tmp_path):
    assert load("vehicle", "paper-reference").tyre is None
    path = own_vehicle(tmp_path, "pacejka-205-60r15")
    assert load("vehicle", path).tyre == load("tyre", "pacejka-205-60r15")
    (tmp_path / "pacejka-205-60r15.tir").write_bytes(changed(("PDX1", "PDX1 = 0.9")))
    assert load("vehicle", path).tyre.longitudinal.pdx1 == 0.9


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("slick", "slick: no such tyre; give a .tir file or one of: pacejka-205-60r15"),
        ("../slick", "tyre: a name must be no path; it is '../slick'"),
        (3, "tyre: must be a valid string; it is 3"),
    ],
)
def test_a_tyre_that_is_none_is_refused(tmp_path, name, words):
    with pytest.raises(InputError, match=re.escape(words)):
        load("vehicle", own_vehicle(tmp_path, name))


def test_a_dataset_keeps_the_tyre_beside_its_vehicle_and_names_what_differs(tmp_path):
    (tmp_path / "mine.tir").write_bytes(BOOK.encode())
    car = str(own_vehicle(tmp_path, "mine"))
    plan, inputs = make_plan("demo", "cpu", car, pictures=False)
    assert inputs["mine.tir"] == BOOK.encode() and "mine.tir" in plan.inputs
    kept = tmp_path / "inputs"
    kept.mkdir()
    for name in ("vehicle.yaml", "mine.tir"):
        (kept / name).write_bytes(inputs[name])
    assert load("vehicle", kept / "vehicle.yaml").tyre == load("tyre", tmp_path / "mine.tir")
    (tmp_path / "mine.tir").write_bytes(changed(("PDX1", "PDX1 = 0.9")))
    other, others = make_plan("demo", "cpu", car, pictures=False)
    assert {clip.clip_id for clip in plan.clips}.isdisjoint(clip.clip_id for clip in other.clips)
    (row,) = find_input_differences(plan.as_json(), other.as_json(), inputs, others)
    assert (row["input"], row["path"], row["a"], row["b"]) == ("mine.tir", "PDX1", "1.210", "0.9")
    assert row["reaches"] == ["vehicle", "render"]
