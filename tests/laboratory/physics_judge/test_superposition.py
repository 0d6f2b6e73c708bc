"""A wheel in the air: the sum of two responses keeps the load that the brake's response gives its tyre."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from flows.making.generate import generate_dataset
from studies.physics_judge.audit_physics import clip_columns, clip_facts
from studies.physics_judge.frozen_constants import read_constants
from studies.physics_judge.laws import body
from studies.physics_judge.laws.audit import audit_clip
from studies.physics_judge.laws.body import follow_moment
from studies.physics_judge.laws.constants import Constants
from tests.toy_street import write_toy_grid

GRID = """
name: lifted
scene: {folder}/scene
camera: {folder}/camera.yaml
frames: 16
frame_rate_hz: 10
scenarios: {{bump: {{initial_speed_km_h: 40, hazard_center_m: 6, hazard_length_m: 0.6, hazard_height_m: 0.1}}}}
"""
Clip = tuple[dict[str, Any], dict[str, Any], dict[str, Any], Constants]


@pytest.fixture(scope="module")
def lifted(tmp_path_factory: pytest.TempPathFactory) -> Clip:
    """A coasting car over the paper's video bump, which both axles leave."""
    folder: Path = tmp_path_factory.mktemp("lifted")
    generate_dataset(
        write_toy_grid(folder, GRID), str(folder / "made"), runner="threads", workers=1, pictures=False
    )
    (facts,) = clip_facts(folder / "made")
    ticks, frames = (clip_columns(folder / "made", table, facts) for table in ("ticks", "frames"))
    assert all(np.any(ticks[f"axle_load_{axle}"] == 0) for axle in "fr")
    return ticks, frames, facts, read_constants(folder / "made")


def broken_laws(clip: Clip, **changed: np.ndarray) -> set[str]:
    ticks, frames, facts, constants = clip
    return {law.name for law in audit_clip(ticks | changed, frames, facts, constants).broken}


def test_a_sound_clip_whose_wheels_lift_keeps_every_law(lifted: Clip) -> None:
    assert broken_laws(lifted) == set()


@pytest.fixture
def one_contact(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """The law of one half-car with one contact an axle, which the paper's sum does not keep in the air."""
    monkeypatch.setattr(body, "sum_contact_changes", lambda *given: {})
    yield


def test_one_contact_for_both_responses_is_another_law(lifted: Clip, one_contact: None) -> None:
    assert broken_laws(lifted) == {"axle's own motion, f", "axle's own motion, r"}


@pytest.mark.parametrize("axle", ["f", "r"])
def test_an_axle_that_moves_otherwise_in_the_air_is_caught(lifted: Clip, axle: str) -> None:
    ticks = lifted[0]
    heave, air = ticks[f"unsprung_heave_{axle}"].copy(), np.flatnonzero(ticks[f"axle_load_{axle}"] == 0)
    middle = air[len(air) // 4 : -len(air) // 4]
    heave[middle] += (
        1e-4 * np.sin(np.linspace(0, np.pi, len(middle))) ** 3
    )  # a tenth of a millimetre, smoothly
    assert f"axle's own motion, {axle}" in broken_laws(lifted, **{f"unsprung_heave_{axle}": heave})


def test_a_steady_moment_moves_its_share_of_the_load_and_nothing_before_it_acts(lifted: Clip) -> None:
    constants = lifted[3]
    moment = np.where(np.arange(6000) < 10, 0.0, 1000.0)
    heave = follow_moment(moment, constants)
    for axle, sign in (("f", 1.0), ("r", -1.0)):
        assert np.all(heave[axle][:10] == 0)
        load = -constants.car[f"tyre_stiffness_{axle}"] * heave[axle][-1]
        assert load == pytest.approx(sign * 1000.0 / constants.wheelbase, rel=1e-3)
