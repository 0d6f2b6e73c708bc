"""Surface entries: the shipped one, and how a wrong one is refused."""

import os
import shutil

import pytest
import yaml

from catalogs.entries import entry_names, find_entry, load
from catalogs.surfaces import SurfaceEntry
from catalogs.weather.grip import WEATHER, WeatherFolder
from tasks.errors import InputError


def broken(tmp_path, **changes):
    content = yaml.safe_load(find_entry("surface", "dense-asphalt").read_text())
    for name, change in changes.items():
        content[name] = content.get(name, {}) | change if isinstance(change, dict) else change
    path = tmp_path / "broken.yaml"
    path.write_text(yaml.safe_dump(content))
    return path


@pytest.mark.parametrize("name", entry_names("surface"))
def test_every_surface_loads_with_bounds_around_its_values(name):
    surface = load("surface", name)
    for field, (low, high) in surface.bounds.items():
        assert low <= getattr(surface, field) <= high


def test_dense_asphalt_holds_the_papers_values_and_bounds():
    asphalt = load("surface", "dense-asphalt")
    assert (asphalt.dry_friction, asphalt.texture_depth_mm, asphalt.crossfall) == (0.82, 0.5, 0.02)
    assert asphalt.bounds["flooded_friction"] == (0.306, 0.374)
    assert len(asphalt.bounds.keys() & SurfaceEntry.model_fields.keys()) == 10


def test_all_problems_of_a_file_are_listed_at_once(tmp_path):
    path = broken(
        tmp_path,
        crossfall={"unit": "%"},
        drainage_length={"value": -1.0},
        snow_friction={"value": float("nan")},
        dry_friction={"bounds": [0.9, 1.0]},
        texture_depth_mm={"source": ""},
        grip={"value": 1},
    )
    with pytest.raises(InputError) as error:
        load("surface", path)
    said = "\n".join(error.value.problems)
    for expected in (
        "crossfall: unit must be m m-1; it is %",
        "drainage_length: ",
        "must be above 0; it is -1",
        "snow_friction.value: must be a finite number; it is nan",
        "dry_friction: value must lie within its bounds 0.9 to 1; it is 0.82",
        "texture_depth_mm.source",
        "grip: unknown key",
    ):
        assert expected in said
    assert all(str(path) in problem for problem in error.value.problems)


def test_wet_friction_above_dry_is_refused(tmp_path):
    path = broken(tmp_path, flooded_friction={"value": 0.9, "bounds": [0.85, 0.95]})
    with pytest.raises(InputError, match="flooded_friction must not exceed dry_friction"):
        load("surface", path)


def test_a_number_that_no_pavement_takes_is_refused(tmp_path):
    """A kind of weather may bring fields of the surface that pavements do not have, and no others."""
    catalogue = tmp_path / "weather"
    shutil.copytree(WEATHER.folder, catalogue)
    number = {"value": 0.1, "unit": "1", "bounds": [0.05, 0.15], "source": "a book"}
    rain = yaml.safe_load((catalogue / "rain.yaml").read_text())
    for name in ("slush_friction", "snow_friction"):
        (catalogue / "rain.yaml").write_text(yaml.safe_dump(rain | {"surface": {name: number}}))
        with pytest.raises(InputError, match=f"surface: {name}: no number"):
            load("surface", "dense-asphalt", WeatherFolder(catalogue))


def test_numbers_that_a_kind_of_weather_brings_keep_units_limits_and_bounds(tmp_path):
    shutil.copytree(WEATHER.folder, catalogue := tmp_path / "weather")
    ice = yaml.safe_load((catalogue / "ice.yaml").read_text())
    ice["surface"]["glaze_mm"] |= {"unit": "m", "value": -0.4}
    ice["surface"]["ice_friction"] |= {"unit": "%", "value": 0.5}
    (catalogue / "ice.yaml").write_text(yaml.safe_dump(ice))
    with pytest.raises(InputError) as error:
        load("surface", "dense-asphalt", WeatherFolder(catalogue))
    for expected in (
        "glaze_mm: unit must be mm; it is m; value must lie within its bounds 0.2 to 0.6; it is -0.4; must be above 0",
        "ice_friction: unit must be 1; it is %; value must lie within its bounds 0.05 to 0.15; it is 0.5",
    ):
        assert expected in str(error.value)


def test_an_entry_of_the_same_size_and_time_is_read_anew(tmp_path):
    shutil.copytree(WEATHER.folder, catalogue := tmp_path / "weather")
    path = catalogue / "ice.yaml"
    text, before = path.read_text(), path.stat()
    assert load("surface", "dense-asphalt", WeatherFolder(catalogue)).glaze_mm == 0.4
    path.write_text(text.replace("value: 0.4\n", "value: 0.5\n"))
    os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))
    assert load("surface", "dense-asphalt", WeatherFolder(catalogue)).glaze_mm == 0.5
