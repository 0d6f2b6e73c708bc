"""OpenSCENARIO of every protocol: read again as the same approach, valid by the schema, and what is refused."""

import re
import subprocess
from pathlib import Path
from shutil import which
from xml.etree import ElementTree as ET

import pytest

from catalogs.entries import load
from catalogs.road_users import RoadUser
from catalogs.scenario import Scenario
from catalogs.scenes.opendrive import find_street, format_opendrive
from studies.emergency_braking.cases import list_cases
from studies.emergency_braking.compare import compare_brakes
from studies.emergency_braking.openscenario import format_openscenario, read_openscenario
from studies.emergency_braking.table import load_table
from tasks.errors import InputError

TABLE, STREET = load_table(), find_street("street")


def write(folder: Path, scenario: Scenario) -> Path:
    file = folder / "approach.xosc"
    file.write_text(
        format_openscenario(scenario, STREET, name="test", road_file="street.xodr", wheelbase=2.6)
    )
    return file


def list_scenarios() -> list[Scenario]:
    return [case.scenario for name, entry in TABLE.protocols.items() for case in list_cases(name, entry)]


def test_every_approach_is_read_as_it_was_written(tmp_path):
    sizes = load("road user sizes")
    for scenario in list_scenarios():
        (was,), again = scenario.objects, read_openscenario(write(tmp_path, scenario))
        (now,) = again.objects
        assert again.initial_speed_km_h == pytest.approx(scenario.initial_speed_km_h, abs=1e-9)
        assert now.kind == was.kind and again.hold_speed
        a, b = (user.build_track(user.choose_size(sizes)) for user in (was, now))
        assert b.start == pytest.approx(a.start, abs=1e-9)
        for name in ("heading", "speed", "change_at", "acceleration", "final_speed"):
            assert getattr(b, name) == pytest.approx(getattr(a, name), abs=1e-9), name


def test_positions_are_those_of_the_opendrive_road_with_the_car_on_its_rear_axle(tmp_path):
    standing = RoadUser.model_validate({"kind": "car", "track": {"station_m": 30.0, "lateral_m": 0.4}})
    root = ET.parse(write(tmp_path, Scenario(objects=(standing,)))).getroot()  # noqa: S314 (our own text)
    first = STREET.station_range[0]
    places = [(float(one.get("s")), float(one.get("t"))) for one in root.iter("RoadPosition")]
    assert places == [pytest.approx((-2.6 - first, 0.0)), pytest.approx((30.0 - first, 0.4))]


@pytest.mark.parametrize(
    ("was", "instead", "sentence"),
    [
        ("<CatalogLocations />", "<CatalogLocations /><ParameterDeclaration />", "it has ParameterDeclaration"),
        ('entityRef="ego"', 'entityRef="other"', "a start of every entity"),
        ("RoadPosition", "WorldPosition", "needs a BoundingBox, a RoadPosition"),
        ('s="', 's="x', "something else where a number belongs"),
        ('dynamicsDimension="rate"', 'dynamicsDimension="distance"', "at a rate or over a time; it has distance"),
        ("SimulationTimeCondition", "SpeedCondition", "one SpeedAction of one entity from a simulation time on"),
        ("</OpenSCENARIO>", "", "cannot be read as an OpenSCENARIO file"),
        ("<OpenSCENARIO>", "<!DOCTYPE a [<!ENTITY b 'c'>]><OpenSCENARIO>", "declare no document type"),
    ],
)  # fmt: skip
def test_a_file_of_another_shape_is_refused_with_a_sentence(tmp_path, was, instead, sentence):
    (*_, braking) = list_cases("ccrb", TABLE.protocols["ccrb"])
    file = write(tmp_path, braking.scenario)
    file.write_text(file.read_text().replace(was, instead))
    with pytest.raises(InputError, match=re.escape(sentence)):
        read_openscenario(file)


def test_the_command_writes_each_approach_and_drives_a_file_as_it_drives_the_protocol(tmp_path):
    asked = {"weather": ["ice"], "brake": ["blind"], "bounds": False}
    own = compare_brakes(protocol=["ccrb"], out=str(tmp_path), **asked)
    files = sorted((tmp_path / "openscenario").glob("*.xosc"))
    assert len(files) == 4 and (tmp_path / "openscenario" / "street.xodr").is_file()
    read = compare_brakes(protocol=[str(file) for file in files], **asked)
    impacts = [sorted(row["impact_speed_km_h"] for row in one["rows"]) for one in (own, read)]
    assert impacts[0] == impacts[1]


def test_the_checker_of_the_standard_finds_no_issue_in_a_file_of_each_protocol(tmp_path):
    """Its rules begin with the schema; it belongs to the Quality Checker Framework of ASAM."""
    if (checker := which("qc_openscenario")) is None:
        pytest.skip("pip install asam-qc-openscenarioxml")
    (tmp_path / "street.xodr").write_text(format_opendrive(STREET, "street"))
    for name, entry in TABLE.protocols.items():
        (*_, last) = list_cases(name, entry)
        file, found = write(tmp_path, last.scenario), tmp_path / "found.xqar"
        (tmp_path / "config.xml").write_text(
            f'<Config><Param name="InputFile" value="{file}"/><CheckerBundle application="xoscBundle">'
            f'<Param name="resultFile" value="{found}"/></CheckerBundle></Config>'
        )
        subprocess.run([checker, "-c", tmp_path / "config.xml"], check=True, capture_output=True)
        checks = list(ET.parse(found).getroot().iter("Checker"))  # noqa: S314 (the checker's own text)
        assert len(checks) >= 17 and {check.get("status") for check in checks} == {"completed"}
        assert [*ET.parse(found).getroot().iter("Issue")] == []  # noqa: S314


def test_a_foreign_reader_takes_a_file(tmp_path):
    foreign = pytest.importorskip("scenariogeneration.xosc", reason="pip install scenariogeneration")
    (*_, scenario) = list_scenarios()
    board = ET.parse(write(tmp_path, scenario)).getroot()  # noqa: S314 (our own text)
    entities = foreign.Entities.parse(board.find("Entities"))
    assert [one.name for one in entities.scenario_objects] == ["ego", f"{scenario.objects[0].kind}-1"]
    foreign.StoryBoard.parse(board.find("Storyboard"))
