"""Every kind of catalogue entry: what ships is read, and each rule of its own names the value that breaks it."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from catalogs.entries import CATALOGUE, find_entry, load
from catalogs.vehicles.frozen import frozen_text
from catalogs.weather.grip import WEATHER, WeatherFolder
from catalogs.weather.look import load_weather
from studies.closing_benchmark.truths import load_sizes, load_truths
from studies.evaluation.learned_judges import load_judges
from tasks.errors import InputError

Change = Callable[[Any], None]


@pytest.mark.parametrize(
    ("kind", "name", "change", "words"),
    [
        ("library of effects", None, lambda c: c[7].update(parameters=3), "7.parameters: must be"),
        ("library of effects", None, lambda c: c.append(c[0]), "an effect must stand once; twice stand"),
        (
            "library of effects",
            None,
            lambda c: c[0].update(parameters=["turbo"]),
            "0.parameters: the table of effects has no parameter turbo; there are: pressure_gain",
        ),
        ("library of effects", None, lambda c: c[7].update(matters=0), "7.matters"),
        ("set of decision rules", None, lambda c: c["spike_width"].update(value=2), "spike_width"),
        (
            "calibration procedure",
            "coupled-grown",
            lambda c: c["bounds"]["static_pitch"].update(unit="rad"),
            "bounds: unit of static_pitch must be deg; it is rad",
        ),
        (
            "hazard marking",
            "zebra-yellow-black",
            lambda c: c["paint"].update(value=[0.5, 0.5]),
            "paint: must be red, green and blue; it has 2 values",
        ),
        ("vehicle", "multibody-grown", lambda c: c["wheel_radius"].update(value=9), "frozen"),
    ],
)
def test_a_broken_rule_is_named_with_its_place(
    tmp_path: Path, kind: str, name: str | None, change: Change, words: str
) -> None:
    content = yaml.safe_load(find_entry(kind, name).read_text())
    change(content)
    path = tmp_path / "entry.yaml"
    path.write_text(yaml.safe_dump(content, sort_keys=False))
    with pytest.raises(InputError) as caught:
        load(kind, path)
    assert words in str(caught.value)
    assert all(str(path) in problem for problem in caught.value.problems)


@pytest.mark.parametrize("content", [b"\xff", b"[" * 100_000, b"a: {b: 1, b: 2}", b""])
@pytest.mark.parametrize(
    "read",
    [
        partial(load, "library of effects"),
        load_truths,
        load_sizes,
        partial(load, "vehicle"),
        partial(load, "channel map"),
        load_judges,
    ],
)
def test_what_is_no_document_is_one_sentence(
    tmp_path: Path, read: Callable[[Path], object], content: bytes
) -> None:
    path = tmp_path / "entry.yaml"
    path.write_bytes(content)
    with pytest.raises(InputError) as caught:
        read(path)
    assert len(caught.value.problems) == 1 and len(str(caught.value)) < 500


def test_the_bounds_of_a_frozen_vehicle_are_in_the_unit_of_what_they_bound(tmp_path: Path) -> None:
    content = yaml.safe_load((CATALOGUE / "vehicles" / "multibody-grown.yaml").read_text())
    content["provenance"]["bounds"]["cg_height"]["unit"] = "furlong"
    del content["provenance"]["sha256"]
    path = tmp_path / "resealed.yaml"
    path.write_text(frozen_text(content, content.pop("provenance"), "resealed"))
    with pytest.raises(InputError, match=r"provenance\.bounds: unit of cg_height must be m; it is furlong"):
        load("vehicle", path)


def test_a_frozen_vehicle_keeps_its_seal_with_the_line_ends_of_another_system(tmp_path: Path) -> None:
    path = tmp_path / "multibody-grown.yaml"
    path.write_bytes((CATALOGUE / "vehicles" / path.name).read_bytes().replace(b"\n", b"\r\n"))
    assert load("vehicle", path) == load("vehicle", "multibody-grown")


@pytest.mark.parametrize("count", [0, -1, 101, 2**50])
def test_the_weather_of_a_stranger_asks_for_no_more_size_classes_than_a_frame_can_bear(
    tmp_path: Path, count: int
) -> None:
    for path in WEATHER.folder.glob("*.yaml"):
        (tmp_path / path.name).write_bytes(path.read_bytes())
    rain = yaml.safe_load((tmp_path / "rain.yaml").read_text())
    rain["particles"]["classes"]["value"] = count
    (tmp_path / "rain.yaml").write_text(yaml.safe_dump(rain))
    with pytest.raises(
        InputError, match=rf"classes\.value: must be (greater|less) than or equal to 1(00)?; it is {count}"
    ):
        load_weather(WeatherFolder(tmp_path))


@pytest.mark.parametrize("form", ["text", "table", "archive", "empty"])
def test_features_that_are_no_array_of_floats_are_refused(tmp_path: Path, form: str) -> None:
    torch = pytest.importorskip("torch")
    torch.jit.script(torch.nn.Identity()).save(str(tmp_path / "clip.pt"))
    features = tmp_path / "features.npy"
    if form == "archive":
        with open(features, "wb") as file:
            np.savez(file, a=np.zeros(3))
    elif form == "empty":
        features.touch()
    else:
        np.save(features, np.array(["a", "b", "c"]) if form == "text" else np.zeros((3, 2), dtype=np.int64))
    path = tmp_path / "judges.yaml"
    path.write_text("clip: {checkpoint: clip.pt, text_features: features.npy, source: own}")
    with pytest.raises(InputError, match=r"features\.npy must be"):
        load_judges(path)
