"""A vehicle grown twice carries both, and its file says what the runs could not tell."""

import hashlib
import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from catalogs.entries import entry_folder, find_entry, load
from catalogs.vehicles import open_vehicle
from flows.measured.grown_vehicle import grown_vehicle, tyre_beside
from manifests.canonical import sha256_of_file
from tasks.identification.decision.answer import NamedEffect, Parameter, Verdict
from tests.flows.measured.findings import verdict_of


def drag(value: float, name: str = "aerodynamic_drag") -> NamedEffect:
    parameter = Parameter(
        name="drag_area",
        value=value,
        ci_low=value - 0.1,
        ci_high=value + 0.1,
        lower=0.0,
        upper=3.0,
        unit="m2",
    )
    return NamedEffect(
        name=name, effect_class="effect", port="longitudinal_force", variable="speed", parameters=(parameter,),
        score=50.0, gain=60.0,
    )  # fmt: skip


def found(effect: NamedEffect, campaign: str, rivals: tuple[tuple[str, NamedEffect], ...] = ()) -> Verdict:
    kind = "SET" if rivals else "FOUND"
    return replace(verdict_of(effect), verdict=kind, rivals=rivals, campaign=campaign)


def grown(base: str, verdict: Verdict, path: Path) -> Path:
    text, missing = grown_vehicle(open_vehicle(base), verdict, {})
    assert text is not None and missing == []
    path.write_text(text)
    return path


def test_what_a_second_campaign_finds_comes_on_top_of_what_the_first_found(tmp_path: Path) -> None:
    once = grown("paper-reference", found(drag(0.5), "spring"), tmp_path / "once.yaml")
    twice = grown(str(once), found(drag(0.2), "autumn"), tmp_path / "twice.yaml")
    assert load("vehicle", twice).effects["drag_area"] == 0.7
    assert "spring" in twice.read_text() and "autumn" in twice.read_text()


@pytest.mark.parametrize("number", ["slope", "no_such_number"])
def test_what_no_vehicle_can_carry_is_missing_from_it_and_the_rest_is_there(number: str) -> None:
    foreign = replace(
        drag(0.3), name="of the road", parameters=(replace(drag(0.3).parameters[0], name=number),)
    )
    verdict = replace(found(drag(0.5), "spring"), effects=(foreign, drag(0.5)))
    text, missing = grown_vehicle(open_vehicle("paper-reference"), verdict, {})
    assert missing == [f"of the road: {number}"]
    assert text is not None and "drag_area" in text
    assert grown_vehicle(open_vehicle("paper-reference"), replace(verdict, effects=(foreign,)), {}) == (
        None,
        missing,
    )


def test_what_the_runs_could_not_tell_from_it_stands_in_its_provenance(tmp_path: Path) -> None:
    rivals = (("aerodynamic_drag", drag(0.1, "headwind")),)
    path = grown("paper-reference", found(drag(0.5), "spring", rivals), tmp_path / "set.yaml")
    assert "the runs cannot tell it from headwind" in " ".join(path.read_text().split())


def test_what_grows_from_a_vehicle_that_extends_another_is_whole_and_has_the_hash_of_all_of_it(
    tmp_path: Path,
) -> None:
    car, elsewhere = tmp_path / "car.yaml", tmp_path / "elsewhere"
    car.write_text("extends: paper-reference\nsprung_mass: {value: 1500, unit: kg, source: scales}\n")
    elsewhere.mkdir()
    path = grown(str(car), found(drag(0.5), "spring"), elsewhere / "grown.yaml")
    base = open_vehicle(path).provenance.base_sha256
    assert b"extends" not in path.read_bytes()
    assert load("vehicle", path) == replace(load("vehicle", car), name="grown", effects={"drag_area": 0.5})
    assert base == hashlib.sha256(open_vehicle(car).content).hexdigest() != sha256_of_file(car)


def test_the_tyre_that_the_extended_vehicle_has_beside_it_goes_with_what_grows(tmp_path: Path) -> None:
    tyre = find_entry("tyre", "pacejka-205-60r15")
    (tmp_path / "base.yaml").write_text("extends: paper-reference\ntyre: mine\n")
    (tmp_path / "mine.tir").write_bytes(tyre.read_bytes())
    (tmp_path / "car.yaml").write_text("extends: base.yaml\n")
    assert tyre_beside(open_vehicle(tmp_path / "car.yaml")) == {"mine.tir": tyre.read_bytes()}
    (tmp_path / "base.yaml").write_text("extends: paper-reference\ntyre: pacejka-205-60r15\n")
    assert tyre_beside(open_vehicle(tmp_path / "car.yaml")) == {}


def test_a_tyre_beside_a_vehicle_of_the_catalogue_goes_along_with_what_extends_that(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for kind in ("vehicle", "tyre"):
        shutil.copytree(entry_folder(kind), tmp_path / entry_folder(kind).name)
    monkeypatch.setattr("catalogs.entries.CATALOGUE", tmp_path)
    (tmp_path / "vehicles" / "slick.yaml").write_text("extends: paper-reference\ntyre: slick\n")
    (tmp_path / "tyres" / "pacejka-205-60r15.tir").rename(tmp_path / "vehicles" / "slick.tir")
    (tmp_path / "car.yaml").write_text("extends: slick\n")
    assert list(tyre_beside(open_vehicle(tmp_path / "car.yaml"))) == ["slick.tir"]
