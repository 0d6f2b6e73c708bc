"""Vehicle entries: the shipped one against the paper's tables, and how a wrong one is refused."""

import shutil
from math import degrees

import pytest
import yaml

from catalogs.entries import entry_names, find_entry, load
from catalogs.weather.grip import WEATHER, WeatherFolder
from tasks.errors import InputError
from tasks.surface.weather import WEATHERS


@pytest.fixture
def entry():
    return yaml.safe_load(find_entry("vehicle", "paper-reference").read_text())


def saved(tmp_path, entry):
    path = tmp_path / "broken.yaml"
    path.write_text(yaml.safe_dump(entry))
    return path


@pytest.mark.parametrize("name", entry_names("vehicle"))
def test_every_vehicle_loads(name):
    vehicle = load("vehicle", name)
    assert vehicle.name == name and all(vehicle.find_tyre_family(kind) for kind in WEATHERS)


def test_the_reference_vehicle_has_the_papers_loads_and_offsets():
    vehicle = load("vehicle", "paper-reference")
    front, rear = vehicle.static_axle_loads
    assert (round(front, 1), round(rear, 1)) == (7069.7, 5761.7)
    assert front + rear == pytest.approx(vehicle.mass * vehicle.gravity)
    assert (vehicle.mass, vehicle.wheelbase) == (1308, 2.7)
    assert degrees(vehicle.static_pitch) == pytest.approx(0.154150)


def test_a_vehicle_file_elsewhere_loads_like_the_shipped_one(tmp_path, entry):
    entry["sprung_mass"]["value"] = 1300
    assert load("vehicle", saved(tmp_path, entry)).sprung_mass == 1300


def test_all_problems_of_a_file_are_listed_at_once(tmp_path, entry):
    entry["sprung_mass"]["value"] = -1200
    entry["cg_height"]["unit"] = "mm"
    entry["pitch_inertia"]["value"] = float("inf")
    entry["wheel_radius"]["value"] = "0.32"
    entry["colour"] = {"value": 1, "unit": "1", "source": "none"}
    del entry["gravity"]
    del entry["brake_gain"]["source"]
    entry["families"]["rain"]["efficiency"]["value"] = [0.9, 1.0]
    entry["families"]["snow"]["surface_friction"]["value"] = [0.5, 0.4, 0.3]
    entry["families"]["dry"]["burckhardt"]["value"] = [0.1, 1.0, 0.5]
    path = saved(tmp_path, entry)
    with pytest.raises(InputError) as error:
        load("vehicle", path)
    said = "\n".join(error.value.problems)
    for expected in (
        "sprung_mass: must be above 0; it is -1200",
        "cg_height: unit must be m; it is mm",
        "pitch_inertia.value: must be a finite number; it is inf",
        "wheel_radius.value: must be a valid number; it is '0.32'",
        "colour: unknown key",
        "gravity is missing",
        "brake_gain.source is missing",
        "families.rain: efficiency must have one value per surface_friction knot (4); it has 2",
        "families.snow: surface_friction knots must ascend; they are [0.5, 0.4, 0.3]",
        "families.dry: burckhardt must rise from zero slip",
    ):
        assert expected in said
    assert len(error.value.problems) == 10


def test_a_kind_of_weather_brings_tyres_to_a_vehicle_that_has_none_for_it(tmp_path, entry):
    catalogue = tmp_path / "weather"
    shutil.copytree(WEATHER.folder, catalogue)
    snow = entry["families"].pop("snow")
    path = saved(tmp_path, entry)
    with pytest.raises(
        InputError, match=r"has no tyre family for weather snow, only for dry, rain: add families\.snow"
    ):
        load("vehicle", path, WeatherFolder(catalogue)).find_tyre_family("snow")
    look = yaml.safe_load((catalogue / "snow.yaml").read_text())
    (catalogue / "snow.yaml").write_text(yaml.safe_dump(look | {"tyre": snow}))
    assert (
        load("vehicle", path, WeatherFolder(catalogue)).find_tyre_family("snow")
        == load("vehicle", "paper-reference").families["snow"]
    )
    own = load("vehicle", "paper-reference", WeatherFolder(catalogue))
    assert own.find_tyre_family("snow") is own.families["snow"]


def test_a_family_of_no_kind_of_weather_is_refused(tmp_path, entry):
    entry["families"]["hail"] = entry["families"]["snow"]
    with pytest.raises(InputError, match=r"families\.hail: must be dry, rain"):
        load("vehicle", saved(tmp_path, entry))
