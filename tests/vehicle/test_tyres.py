"""The Magic Formula against two libraries and its book, and as a tyre under the contract."""

from math import atan
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from catalogs.entries import load
from tasks.vehicle.tyres.contract import compute_tyre_friction, compute_tyre_slope
from tasks.vehicle.tyres.magic_formula import (
    compute_lateral_friction,
    compute_longitudinal_friction,
    compute_tyre_forces,
)
from tasks.vehicle.tyres.magic_formula_tyre import scale_magic_formula
from tasks.vehicle.tyres.scaling import fold_scaling

FILES = Path(__file__).parent / "tyre_files"
LOAD = 4000.0


@pytest.fixture(scope="module")
def book():
    return load("tyre", "pacejka-205-60r15")


def coefficients(name: str) -> dict[str, float]:
    lines = (line.split("=") for line in (FILES / name).read_text().splitlines() if "=" in line)
    numbers = {}
    for key, value in lines:
        try:
            numbers[key.strip()] = float(value)
        except ValueError:
            continue
    return numbers


@pytest.mark.parametrize(
    ("load", "slip", "angle", "camber", "pressure", "fx", "fy"),
    [
        (11467.336565736936, -0.003474120845512968, -0.1308848743268327, 0.0, 244866.79844084816,
         -406.9555777074839, 10719.221444551993),
        (2082.3226804889105, 0.0, 0.04802435192221938, 0.0, 285616.9675133527, 18.406726837146476, -1687.8405026083572),
        (10308.211431929805, 0.15696248163805213, 0.0, -0.04337187183606246, 227770.37883826345,
         10957.944875355643, 134.6844280969632),
        (10028.661167645569, -0.3240601939090312, -0.044206132214613184, 0.013933371547829587, 268719.1234516478,
         -8932.680148068985, 1915.1120816611387),
        (6618.9109566382795, -0.12920491108431875, -0.12949876726104184, 0.09163058720140974, 231912.70408183994,
         -4076.1005414641195, 3277.792427495051),
        (5146.747745266275, 0.0, -0.3296546766109882, 0.0, 238740.52990943505, 3.027997543885756, 4776.866982986204),
        (5712.722774154574, 0.2938382295024104, 0.2612852215047355, -0.051512135042984845, 251924.83961255327,
         3991.1721848677344, -3090.2281681567824),
    ],
)  # fmt: skip
def test_mf61_agrees_with_mfeval_in_combined_slip_camber_and_pressure(
    load, slip, angle, camber, pressure, fx, fy
):
    """MFeval.jl, useMode 221, by the fixtures of github.com/robertscholz22/autonomousim (commit a14080a)."""
    values = coefficients("mf61-mfeval-sample.tir") | {"INFLPRES": pressure}
    forces = compute_tyre_forces(slip, angle, camber, load, fold_scaling(values, "MF 6.1"))
    np.testing.assert_allclose(forces, (fx, fy), rtol=1e-8)


@pytest.mark.parametrize(
    ("wheel_load", "slip", "angle", "camber", "fx", "fy"),
    [
        (6672.012988521558, -0.003474120845512968, -0.1308848743268327, 0.0, -340.18069636995875, 5991.585287879309),
        (6001.484634631965, 0.0, 0.0, 0.08263053012883335, 220.68668609516195, -594.6294246600282),
        (2424.860302979504, 0.35806664815244565, 0.09156144762219706, 0.0, 2723.4213386871143, -2447.1025245497494),
        (4221.851064276587, -0.14262671653865577, 0.0, -0.061962666707637705, -4902.4781450805, 201.13714329822628),
        (1276.1321237318818, -0.001959360741548577, 0.06574504407219375, 0.09375084161826384,
         -24.83236207040457, -1259.2901660456994),
    ],
)  # fmt: skip
def test_mf52_agrees_with_mfeval_under_camber_and_a_scaled_nominal_load(
    wheel_load, slip, angle, camber, fx, fy
):
    """MFeval.jl, useMode 221, by the fixtures of github.com/robertscholz22/autonomousim (commit a14080a)."""
    tyre = load("tyre", FILES / "mf52-chrono-sedan.tir")
    np.testing.assert_allclose(
        compute_tyre_forces(slip, angle, camber, wheel_load, tyre), (fx, fy), rtol=1e-8
    )


@pytest.mark.parametrize(
    ("slip", "angle", "load", "fx"),
    [
        (-0.25, -0.17, 4000, -3563.509474), (-0.2, 0.034, 4000, -4606.723698), (-0.1, 0.068, 4000, -3831.83815),
        (0.0, 0.0, 4000, -172.0094611), (0.05, 0.17, 4000, 1240.16233), (0.2, -0.17, 4000, 3394.360544),
        (0.3, 0.0, 2000, 2277.776872), (-0.12, 0.0, 6000, -7140.913258), (0.03, 0.0, 8000, 5666.752293),
    ],
)  # fmt: skip
def test_the_books_tyre_brakes_as_a_second_library_says(book, slip, angle, load, fx):
    """teasit/magic-formula-tyre-library e9f0354 on Table A3.1, by the golden files of github.com/KMoula30/outlap."""
    assert compute_tyre_forces(slip, angle, 0.0, load, book)[0] == pytest.approx(fx, rel=1e-9)


@pytest.mark.parametrize(
    ("angle", "camber", "load", "fy"),
    [
        (-0.21, 0.0, 2000, 2228.79166), (0.042, 0.0, 2000, -1007.626856), (-0.105, 0.0, 4000, 3593.292118),
        (-0.105, -0.06981317008, 4000, 3954.589519), (0.042, 0.06981317008, 2000, -1136.575571),
    ],
)  # fmt: skip
def test_the_books_tyre_corners_as_a_second_library_says(book, angle, camber, load, fy):
    """As above; in pure lateral slip that library takes the slip angle itself where the book has its tangent."""
    assert compute_tyre_forces(0.0, atan(angle), camber, load, book)[1] == pytest.approx(fy, rel=1e-9)


def test_the_curve_has_the_slope_peak_and_shifts_that_its_coefficients_say(book):
    """K_x at the centre, D_x at the top, S_V and S_H away from it (Pacejka 2012, section 4.3.2)."""
    c = book.longitudinal._replace(pvx1=0.02)
    centre = -c.phx1
    assert compute_longitudinal_friction(centre, 0.0, 0.0, c) == pytest.approx(0.02, abs=1e-12)
    rise = compute_longitudinal_friction(centre + 1e-7, 0.0, 0.0, c) - compute_longitudinal_friction(
        centre - 1e-7, 0.0, 0.0, c
    )
    assert rise / 2e-7 == pytest.approx(21.51, rel=1e-6)
    slips = np.linspace(0, 1, 20_001)
    assert max(compute_longitudinal_friction(k, 0.0, 0.0, c) for k in slips) == pytest.approx(
        1.21 + 0.02, rel=1e-7
    )
    assert max(compute_longitudinal_friction(k, 0.5, 0.0, c) for k in slips) == pytest.approx(
        1.21 - 0.037 / 2 + 0.02, rel=1e-7
    )
    side = book.lateral._replace(phy1=0.0, phy2=0.0, pvy1=0.0, pvy2=0.0)
    assert compute_lateral_friction(0.0, 0.0, 0.0, side) == 0.0
    assert (
        compute_lateral_friction(0.05, 0.0, 0.0, side) < 0.0 < compute_lateral_friction(-0.05, 0.0, 0.0, side)
    )


def test_without_the_other_slip_combined_forces_are_the_pure_ones(book):
    for slip in (-0.3, -0.04, 0.0, 0.1):
        pure = LOAD * compute_longitudinal_friction(slip, 0.0, 0.0, book.longitudinal)
        assert compute_tyre_forces(slip, 0.0, 0.0, LOAD, book)[0] == pytest.approx(pure, rel=1e-12)
    for angle in (-0.2, 0.0, 0.05):
        pure = LOAD * compute_lateral_friction(np.tan(angle), 0.0, 0.0, book.lateral)
        assert compute_tyre_forces(0.0, angle, 0.0, LOAD, book)[1] == pytest.approx(pure, rel=1e-12)
    assert compute_tyre_forces(-0.1, 0.1, 0.0, 0.0, book) == (0.0, 0.0)


def test_either_slip_takes_grip_from_the_other_force(book):
    braking = [abs(compute_tyre_forces(-0.1, angle, 0.0, LOAD, book)[0]) for angle in (0.01, 0.05, 0.1, 0.2)]
    cornering = [
        abs(compute_tyre_forces(slip, 0.1, 0.0, LOAD, book)[1]) for slip in (-0.02, -0.1, -0.2, -0.4)
    ]
    assert braking == sorted(braking, reverse=True) and cornering == sorted(cornering, reverse=True)
    slips, angles = np.linspace(-0.5, 0.5, 41), np.linspace(-0.4, 0.4, 41)
    used = max(np.hypot(*compute_tyre_forces(k, a, 0.0, LOAD, book)) / LOAD for k in slips for a in angles)
    assert used < 1.03 * 1.21


def test_a_mirrored_tyre_is_the_mirror_image(book):
    lateral = book.lateral._replace(phy1=0.0, phy2=0.0, pey3=0.0, pvy1=0.0, pvy2=0.0)
    combined = book.combined._replace(rhx1=0.0, rby3=0.0, rvy1=0.0, rvy2=0.0)
    tyre = book._replace(lateral=lateral, combined=combined)
    for slip, angle, camber in [(-0.1, 0.1, 0.03), (0.0, 0.2, 0.0), (0.2, -0.05, 0.06)]:
        fx, fy = compute_tyre_forces(slip, angle, camber, LOAD, tyre)
        assert compute_tyre_forces(slip, -angle, -camber, LOAD, tyre) == (
            pytest.approx(fx, rel=1e-12),
            pytest.approx(-fy, rel=1e-12),
        )


@pytest.mark.parametrize(
    ("factor", "group", "scaled"),
    [
        ("LCX", "longitudinal", {"pcx1": 0.5}), ("LMUX", "longitudinal", {"pdx1": 0.5, "pdx2": 0.5, "pvx1": 10 / 11}),
        ("LEX", "longitudinal", {"pex1": 0.5, "pex2": 0.5, "pex3": 0.5}),
        ("LKX", "longitudinal", {"pkx1": 0.5, "pkx2": 0.5}), ("LHX", "longitudinal", {"phx1": 0.5, "phx2": 0.5}),
        ("LVX", "longitudinal", {"pvx1": 0.5, "pvx2": 0.5}), ("LXAL", "combined", {"rbx1": 0.5, "rbx3": 0.5}),
        ("LCY", "lateral", {"pcy1": 0.5}),
        ("LMUY", "lateral", {"pdy1": 0.5, "pdy2": 0.5, "pvy1": 10 / 11, "pvy4": 10 / 11}),
        ("LEY", "lateral", {"pey1": 0.5, "pey2": 0.5, "pey3": 1.0}), ("LKY", "lateral", {"pky1": 0.5, "pky6": 1.0}),
        ("LHY", "lateral", {"phy1": 0.5, "phy2": 0.5}), ("LVY", "lateral", {"pvy1": 0.5, "pvy2": 0.5, "pvy3": 1.0}),
        ("LKYC", "lateral", {"pky6": 0.5, "pky7": 0.5, "pvy3": 0.5, "pvy4": 0.5}),
        ("LYKA", "combined", {"rby1": 0.5, "rby4": 0.5, "rby2": 1.0}),
        ("LVYKA", "combined", {"rvy1": 0.5, "rvy2": 0.5, "rvy3": 0.5, "rvy4": 1.0}),
    ],
)  # fmt: skip
def test_a_scaling_factor_scales_what_the_book_multiplies_by_it(factor, group, scaled):
    """Factors stand at 4.E11 to 4.E67; a halved friction takes 1/11 of the vertical shifts (4.E8, A_mu = 10)."""
    values = coefficients("mf61-mfeval-sample.tir")
    plain, half = (getattr(fold_scaling(values | {factor: f}, "MF 6.1"), group) for f in (1.0, 0.5))
    for name, ratio in scaled.items():
        assert getattr(half, name) == pytest.approx(ratio * getattr(plain, name), rel=1e-12), name
    older = coefficients("mf52-chrono-sedan.tir")
    leant = fold_scaling(older | {"LGAY": 0.5, "LMUY": 0.5}, "MF 5.2").lateral
    assert leant.phy3 == 0.5 * older["PHY3"] and leant.pdy3 == 0.25 * older["PDY3"]
    assert leant.pvy1 == 0.5 * older["PVY1"]


def test_a_loaded_tyre_grips_less_of_its_load_and_is_stiffer(book):
    """PDX2 of -0.037 on 1.21, PKX3 of 0.245; nothing changes beyond three times the nominal load."""
    tyre = scale_magic_formula(book, 1.21, 1.0)
    assert compute_tyre_friction(0.15, 16_000, tyre) < compute_tyre_friction(0.15, 8_000, tyre)
    stiffness = (21.51 - 0.163) * np.exp(0.245)
    assert compute_tyre_slope(0.0, 16_000, tyre) == pytest.approx(stiffness, rel=1e-12)
    assert compute_tyre_friction(0.1, 24_000, tyre) == compute_tyre_friction(0.1, 90_000, tyre)


@given(slip=st.floats(0.0, 1.0), load=st.floats(0.0, 40_000.0))
def test_the_slope_is_the_derivative_under_any_load(book, slip, load):
    tyre = scale_magic_formula(book, 0.6, 1.3)
    step = 1e-6
    numeric = (
        compute_tyre_friction(slip + step, load, tyre)
        - compute_tyre_friction(max(slip - step, 0.0), load, tyre)
    ) / (step + min(slip, step))
    assert compute_tyre_slope(slip, load, tyre) == pytest.approx(numeric, rel=1e-4, abs=1e-4)


def test_a_curve_without_a_top_below_full_slip_is_used_to_full_slip(book):
    flat = book._replace(longitudinal=book.longitudinal._replace(pkx1=1.0, pkx2=0.0))
    tyre = scale_magic_formula(flat, 1.0, 1.0)
    assert tyre.target_slip == 1.0
    assert tyre.peak == compute_tyre_friction(1.0, 2 * LOAD, tyre) < 1.0
