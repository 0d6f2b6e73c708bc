"""The weather catalogue: every value with unit and source, and every mistake in it told at once."""

import shutil
from pathlib import Path

import pytest
import yaml

from catalogs.weather.grip import WEATHER, WeatherFolder
from catalogs.weather.look import load_weather
from tasks.errors import InputError
from tasks.surface.weather import WEATHERS


def leaves(entries, place=""):
    for name, entry in entries.items():
        if "value" in entry:
            yield f"{place}{name}", entry
        else:
            yield from leaves(entry, f"{place}{name}.")


@pytest.fixture
def copy(tmp_path) -> Path:
    for path in WEATHER.folder.glob("*.yaml"):
        shutil.copy(path, tmp_path)
    return tmp_path


@pytest.mark.parametrize("path", sorted(WEATHER.folder.glob("*.yaml")), ids=lambda path: path.stem)
def test_every_value_has_unit_and_source(path):
    for name, entry in leaves(yaml.safe_load(path.read_text())):
        assert set(entry) - {"bounds"} == {"value", "unit", "source"}, name
        assert len(str(entry["source"])) > 5, name
        assert isinstance(entry["unit"], str), name


def test_published_numbers_stand_as_published(parameters):
    assert (
        parameters.kinds["rain"].particles.intercept,
        parameters.kinds["rain"].particles.slope,
        parameters.kinds["rain"].particles.slope_exponent,
    ) == (
        8000,
        4.1,
        -0.21,
    )
    snow = parameters.kinds["snow"].particles
    assert (snow.intercept, snow.intercept_exponent, snow.slope, snow.slope_exponent) == (
        2500,
        -0.94,
        2.29,
        -0.45,
    )
    assert parameters.kinds["rain"].particles.fall_speed == (9.65, 10.3, 0.6)
    # mass [mg] = 0.012 (area [mm2])^1.5, the melted flake a sphere of 1 mg/mm3
    area = (3.141592653589793 / 6 / 0.012) ** (2 / 3)
    assert snow.visible_diameter_ratio == pytest.approx((4 * area / 3.141592653589793) ** 0.5, abs=0.005)


def test_all_mistakes_are_told_at_once(copy):
    rain = yaml.safe_load((copy / "rain.yaml").read_text())
    particles = rain["particles"]
    particles["slope"]["value"] = "steep"
    particles["classes"]["value"] = 2.5
    particles["colour"] = {"value": 1, "unit": "1", "source": "none"}
    del particles["flutter_m"]
    (copy / "rain.yaml").write_text(yaml.safe_dump(rain))
    air = yaml.safe_load((copy / "air.yaml").read_text())
    air["wind_m_s"]["value"] = 3.0
    del air["near"]["nearest_m"]["source"]
    air["near"]["fade_share"]["source"] = ""
    air["near"]["farthest_m"]["unit"] = 7
    air["haze_visual_range_m"]["value"] = float("inf")
    (copy / "air.yaml").write_text(yaml.safe_dump(air))
    (copy / "sky.yaml").write_text("a: [")
    (copy / "snow.yaml").rename(copy / "hail.yaml")
    with pytest.raises(InputError) as caught:
        load_weather(WeatherFolder(copy))
    text = "\n".join(caught.value.problems)
    for part in (
        "rain.yaml: particles.slope.value: must be a valid number; it is 'steep'",
        "rain.yaml: particles.classes.value: must be a valid integer; it is 2.5",
        "rain.yaml: particles.colour: unknown key",
        "rain.yaml: particles.flutter_m is missing",
        "air.yaml: wind_m_s.value: must be a valid tuple; it is 3.0",
        "air.yaml: near.nearest_m.source is missing",
        "air.yaml: near.fade_share.source: String should have at least 1 character; it is ''",
        "air.yaml: near.farthest_m.unit: must be a valid string; it is 7",
        "air.yaml: haze_visual_range_m.value: must be a finite number; it is inf",
        "sky.yaml: a weather catalogue's file must be valid YAML",
        "hail.yaml: must be of a kind of weather, which are rain, snow",
    ):
        assert part in text
    assert len(caught.value.problems) == 11


def test_an_unedited_copy_is_the_same_catalogue(copy, parameters):
    assert load_weather(WeatherFolder(copy)) == parameters


def test_the_pavements_numbers_in_a_kept_copy_of_before_are_not_read(copy, parameters):
    for kind, section, name in (
        ("snow", "snow_cover", "full_cover_mm"),
        ("rain", "film", "texture_depth_mm"),
    ):
        entry = yaml.safe_load((copy / f"{kind}.yaml").read_text())
        owner = entry[section].get("water", entry[section])
        assert name not in owner
        owner[name] = {"value": 7, "unit": "mm", "source": "the paper"}
        (copy / f"{kind}.yaml").write_text(yaml.safe_dump(entry))
    assert load_weather(WeatherFolder(copy)) == parameters


@pytest.mark.parametrize("kind", [kind for kind, row in WEATHERS.items() if row.overcast])
def test_every_kind_under_cloud_has_an_entry(kind, parameters):
    assert parameters.find_look(kind) is not None


def test_a_kind_without_an_entry_is_named(copy):
    (copy / "snow.yaml").unlink()
    with pytest.raises(InputError, match=r"weather snow: the weather catalogue has no snow\.yaml"):
        load_weather(WeatherFolder(copy)).find_look("snow")
