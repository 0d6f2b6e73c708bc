"""The sign of a road feature: where its entry says, facing who comes, in the light there, and all else as it was."""

from dataclasses import replace

import numpy as np
import pytest

from catalogs.entries import load
from tasks.conventions import SemanticClass
from tasks.render.feature_sign import add_sign
from tasks.scene.gaussians import check_gaussians
from tasks.surface.road_profile import RoadHazard
from tests.render.test_road_edit import relief_of
from tests.render.weather.scenes import ASPHALT, road

HAZARD = RoadHazard(center_m=8.1, length_m=2.0, height_m=0.1)
SIGN = load("hazard marking", "zebra-yellow-black").sign
COLOURS = {name: np.array(getattr(SIGN, name)) for name in ("border", "field", "symbol", "metal")}


def sign_beside(hazard, street):
    out = add_sign(street, relief_of(hazard), SIGN, -3.0, ASPHALT)
    check_gaussians(out)
    return out, slice(len(street), None)


def parts_of(out, new):
    """Which part each disc of the sign is, by its hue and brightness relative to the lit field."""
    colour = out.sh[new, 0] * 0.28209479 + 0.5
    return {
        name: (np.abs(colour / 0.8 - value) < 0.1 * value + 2e-3).all(axis=1)
        for name, value in COLOURS.items()
    }


def test_the_sign_stands_right_of_the_road_before_the_feature_and_faces_who_comes():
    street = road()
    out, new = sign_beside(HAZARD, street)
    means, face = out.means[new], out.normals[new][:, 0] < -0.9
    front = face & (means[:, 2] > SIGN.foot)
    middle = means[front].mean(axis=0)
    assert middle[0] == pytest.approx(7.1 - SIGN.before, abs=0.05)
    assert middle[1] == pytest.approx(-3.0 - SIGN.offset, abs=0.02)
    assert np.ptp(means[front, 1]) == pytest.approx(SIGN.side, abs=0.1)
    assert means[:, 2].min() < 0.1 and (out.class_id[new] == SemanticClass.POLE).all()
    np.testing.assert_array_equal(out.sh[: len(street)], street.sh)


def test_a_hump_is_drawn_upward_and_a_dip_downward():
    peaks = []
    for hazard in (HAZARD, replace(HAZARD, height_m=-0.08)):
        out, new = sign_beside(hazard, road())
        drawn = parts_of(out, new)["symbol"]
        y, z = out.means[new][drawn, 1] + 3.0 + SIGN.offset, out.means[new][drawn, 2] - SIGN.foot
        peaks.append([z[near].max() for near in (np.abs(y) < 0.03, (np.abs(y) > 0.08) & (np.abs(y) < 0.11))])
    (hump, beside), (dip, about) = peaks
    assert hump > beside + 0.04 and dip < about - 0.03


def test_its_colours_are_those_of_the_entry_in_the_light_of_its_place():
    street = road()
    out, new = sign_beside(HAZARD, street)
    found = parts_of(out, new)
    assert all(own.any() for own in found.values())
    assert sum(own.sum() for own in found.values()) > 0.95 * (len(out) - len(street))
    dark = replace(street, sh=((0.4 * (street.sh * 0.28209479 + 0.5) - 0.5) / 0.28209479).astype(np.float32))
    shaded, _ = sign_beside(HAZARD, dark)
    ratio = (shaded.sh[new] * 0.28209479 + 0.5) / (out.sh[new] * 0.28209479 + 0.5)
    np.testing.assert_allclose(ratio, 0.4, rtol=0.05)
