"""Rigid bodies of road users: of the size asked for, on the ground, closed, painted and the same each time."""

from dataclasses import replace

import numpy as np
import pytest

from tasks.conventions import SemanticClass
from tasks.scene.bodies import KINDS, VEHICLES, build_body
from tasks.scene.bodies.vehicles import FINISHES, SHAPES, Part
from tasks.scene.gaussians import check_gaussians
from tasks.scene.street.cars.parked import mirror_surroundings

COARSE = 0.09


@pytest.mark.parametrize("kind", KINDS)
def test_a_body_is_sound_stands_on_the_ground_and_has_its_height(kind: str) -> None:
    body = build_body(kind, cell=COARSE if kind in VEHICLES else None)
    check_gaussians(body.gaussians)
    low, high = body.gaussians.means.min(axis=0), body.gaussians.means.max(axis=0)
    assert low[2] == pytest.approx(0, abs=0.025) and high[2] == pytest.approx(body.size[2], abs=0.06)
    assert high[0] - low[0] == pytest.approx(body.size[0], abs=0.12)
    assert high[1] == pytest.approx(-low[1], abs=0.03)
    assert (
        body.albedo.shape == (len(body.gaussians), 3) and (body.albedo > 0).all() and (body.albedo < 1).all()
    )


def test_a_vehicle_has_the_size_and_the_colour_that_are_asked_for() -> None:
    body = build_body("saloon", 4.9, 1.9, 1.4, colour=(0.1, 0.2, 0.3), cell=COARSE)
    means = body.gaussians.means
    assert np.ptp(means[:, 0]) == pytest.approx(4.9, abs=0.05)
    skin = np.abs(means[:, 2] - 0.5) < 0.1
    assert np.ptp(means[skin, 1]) == pytest.approx(1.9, abs=0.06)
    assert means[:, 2].max() == pytest.approx(1.4, abs=0.05)
    assert (np.abs(body.albedo - (0.1, 0.2, 0.3)) < 1e-9).all(axis=1).mean() > 0.3
    assert (body.gaussians.class_id == SemanticClass.VEHICLE).all()


def test_a_car_of_the_usual_spacing_has_ten_thousand_discs_and_every_part() -> None:
    body = build_body("car")
    assert 10_000 < len(body.gaussians) < 25_000
    for part in Part:
        if part != Part.PAINT:
            assert (np.abs(body.albedo - FINISHES[part].albedo) < 1e-9).all(axis=1).any(), part.name


def test_discs_face_outward_and_lamps_and_plates_are_where_they_belong() -> None:
    body = build_body("hatchback", cell=COARSE)
    means, normals = body.gaussians.means, body.gaussians.normals
    out = np.einsum("ij,ij->i", normals, means - [0, 0, 0.6])
    skin = (means[:, 2] > 0.78) & (np.abs(means[:, 1]) < 0.87)  # above the arches, without the mirrors
    assert (out[skin] > 0).mean() > 0.97
    for part, front in ((Part.HEAD_LAMP, True), (Part.TAIL_LAMP, False)):
        own = (np.abs(body.albedo - FINISHES[part].albedo) < 1e-9).all(axis=1)
        assert ((means[own, 0] > 0) == front).all()
        assert (means[own, 1] > 0.3).any() and (means[own, 1] < -0.3).any()


def test_wheel_arches_are_dark_and_glass_mirrors_as_the_eye_faces_it() -> None:
    body, shape = build_body("saloon", cell=COARSE), SHAPES["saloon"]
    means, normals = body.gaussians.means, body.gaussians.normals
    hubs = (np.array(shape.axles) - 0.5) * body.size[0]
    away = np.hypot(means[:, :1] - hubs, means[:, 2:] - shape.wheel).min(axis=1) - shape.wheel
    assert (body.albedo[np.abs(away - 0.04) < 0.03] < 0.025).all()
    pane = np.flatnonzero((body.gloss == FINISHES[Part.GLASS].gloss) & (normals[:, 1] > 0.9))[0]
    for angle, least, most in ((0.0, 0.038, 0.042), (80.0, 0.3, 0.5)):
        way = np.array([np.sin(np.radians(angle)), 0.0, 0.0]) + np.cos(np.radians(angle)) * normals[pane]
        seen = [mirror_surroundings(replace(body, gloss=gloss), means[pane] + 5 * way)[pane]
                for gloss in (body.gloss, np.ones_like(body.gloss))]  # fmt: skip
        assert (least < 0.55 * seen[0] / seen[1]).all() and (0.55 * seen[0] / seen[1] < most).all()


def test_the_same_arguments_give_the_same_bytes_and_the_seed_only_the_plates() -> None:
    first, again, other = (build_body("van", cell=COARSE, seed=seed) for seed in (3, 3, 4))
    assert first.gaussians.means.tobytes() == again.gaussians.means.tobytes()
    plates = [
        (np.abs(b.albedo - FINISHES[Part.LETTER].albedo) < 1e-9).all(axis=1).sum() for b in (first, other)
    ]
    assert plates[0] != plates[1]
