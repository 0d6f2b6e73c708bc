import pytest

from catalogs.entries import load
from tasks.errors import InputError
from tasks.identification.calibration.scalars import list_calibration_scalars, read_scalar, set_scalars


def test_the_paper_s_procedure_moves_its_40_scalars(vehicle):
    procedure, _ = load("calibration procedure", "paper-staged")
    scalars = list_calibration_scalars(vehicle, procedure.groups)
    by_group = {group: sum(s.group == group for s in scalars) for group in procedure.groups}
    # paper, Table frozen_calibration_count
    assert by_group == {
        "coast_deceleration": 1, "slip_stiffness": 8, "efficiency": 8, "static_pitch": 1, "pitch_scale": 8,
        "hold_s": 4, "release_s": 8, "hold_ratio": 1, "coupled_pitch_scale": 1,
    }  # fmt: skip
    assert len(scalars) == len({s.name for s in scalars}) == 40


@pytest.mark.parametrize("name", ["paper-staged", "coupled-retuned", "coupled-grown"])
def test_every_value_that_is_set_is_read_back_and_moves_nothing_else(vehicle, name):
    procedure, _ = load("calibration procedure", name)
    scalars = list_calibration_scalars(vehicle, procedure.groups)
    for scalar in scalars:
        value = read_scalar(vehicle, scalar) + procedure.bounds[scalar.group].step
        moved = set_scalars(vehicle, {scalar: value})
        assert read_scalar(moved, scalar) == value
        for other in scalars:
            if other != scalar:
                assert read_scalar(moved, other) == read_scalar(vehicle, other)


def test_dry_and_rain_share_one_hold_time(vehicle):
    shared = next(
        s for s in list_calibration_scalars(vehicle, ("hold_s",)) if s.name == "hold_s dry and rain"
    )
    moved = set_scalars(vehicle, {shared: 0.3})
    assert moved.families["dry"].hold_s == (0.3,)
    assert moved.families["rain"].hold_s == (0.3,) * 4
    assert moved.families["snow"].hold_s == vehicle.families["snow"].hold_s


def test_moving_the_centre_of_gravity_keeps_the_wheelbase(vehicle):
    (scalar,) = list_calibration_scalars(vehicle, ("cg_to_front_axle",))
    assert set_scalars(vehicle, {scalar: 1.13}).wheelbase == pytest.approx(vehicle.wheelbase, abs=1e-12)


def test_a_group_that_is_none_is_named_and_the_groups_that_exist_are_listed(vehicle):
    with pytest.raises(InputError, match=r"group colour: no such number.*efficiency.*drag_area"):
        list_calibration_scalars(vehicle, ("efficiency", "colour"))
