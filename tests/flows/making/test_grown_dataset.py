"""A dataset made with a grown vehicle differs from that of the same car without what was found in just those clips
that the effect explains.
"""

from pathlib import Path

import pytest

from catalogs.entries import load
from flows.auditing.dataset_diff import compare_datasets
from flows.making.generate import generate_dataset
from tasks.identification.decision.answer import NamedEffect
from tests.flows.measured.findings import found_effect, found_form, grown_file
from tests.toy_street import write_toy_grid

GRID = """
name: toy
scene: {folder}/scene
camera: {folder}/camera.yaml
frames: 16
frame_rate_hz: 10
axes:
  weather:
    dry: {{weather: dry}}
    rain: {{weather: rain, precipitation_mm_h: 25}}
    snow: {{weather: snow, precipitation_mm_h: 1, snow_accumulation_h: 1}}
  drive:
    brakes: {{initial_speed_km_h: 40, peak_pressure_mpa: 2.0, brake_onset_s: 0.2}}
    coasts: {{initial_speed_km_h: 40}}
"""
LIBRARY = {effect.name: effect for effect in load("library of effects")}
BRAKED, COASTED = (
    {f"{weather}/{drive}" for weather in ("dry", "rain", "snow")} for drive in ("brakes", "coasts")
)
EXPLAINED = {
    "engine_braking": ({"engine_torque": 80.0}, BRAKED | COASTED),
    "snow_ploughing": ({"ploughing": 20.0}, {"snow/brakes", "snow/coasts"}),
    "wet_friction_speed": ({"wet_speed": 0.02, "wet_threshold": 2.0}, {"rain/brakes", "rain/coasts"}),
    "bias_pressure": ({"bias_pressure": 0.05}, BRAKED),
    "relaxation_length": ({"relaxation_length": 0.5}, BRAKED | COASTED),
    "tyre_heating": ({"tyre_heating": 1.0}, BRAKED | COASTED),
    "aerodynamic_pitch": ({"aero_pitch": 0.5}, BRAKED | COASTED),
    "aerodynamic_lift": ({"aero_lift": 0.5}, BRAKED | COASTED),
}  # fmt: skip
"""Finding, and the clips that it moves."""


FORM = found_form("brake_torque", "pressure", "a x", 3.6, -0.4)


def made_with(folder: Path, name: str, effect: NamedEffect) -> str:
    """The dataset of a vehicle grown by one effect."""
    car = grown_file(folder / f"{name}.yaml", effect, reached={"pressure": (0.0, 1.8)})
    out = str(folder / name)
    generate_dataset(
        str(folder / "grid.yaml"), out, runner="threads", workers=1, vehicle=str(car), pictures=False
    )
    return out


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("grown")
    write_toy_grid(folder, GRID)
    return folder


@pytest.fixture(scope="module")
def plain(folder: Path) -> str:
    return made_with(folder, "plain", found_effect(LIBRARY["retuned_pressure_gain"], {"pressure_gain": 0.0}))


def moved(plain: str, other: str) -> set[str]:
    return {row["label"] for row in compare_datasets(plain, other)["clips"]}


@pytest.mark.parametrize("name", EXPLAINED)
def test_an_effect_moves_the_clips_that_it_explains_and_no_other(name: str, plain: str, folder: Path) -> None:
    values, clips = EXPLAINED[name]
    assert moved(plain, made_with(folder, name, found_effect(LIBRARY[name], values))) == clips


def test_a_form_moves_the_clips_that_it_explains_and_no_other(plain: str, folder: Path) -> None:
    result = compare_datasets(plain, made_with(folder, "form", FORM))
    rows = {row["label"]: row["labels"] for row in result["clips"]}
    assert set(rows) == BRAKED
    assert rows["dry/brakes"]["speed_rms_m_s"] > 0.1
    assert any(why["path"].startswith("forms") for why in result["why"])
