"""The paper's conditions and its surface study, as the catalogue holds them."""

from decimal import Decimal

import pytest

from catalogs.entries import load
from catalogs.references import ReferenceCase
from catalogs.studies.agreement import find_printed_name, put_beside_print


def test_held_out_conditions_change_one_control_each():
    held_out = {c.name: c.scenario for c in load("list of conditions") if c.split == "held-out"}
    assert held_out["pressure-1.6mpa"].peak_pressure_mpa == 1.6
    assert held_out["ramp-0.2s"].ramp_s == 0.2
    assert held_out["onset-12m"].brake_onset_m == 12.0 and held_out["onset-12m"].brake_onset_s is None
    assert held_out["depression-80x3000"].hazard_height_m == -0.08
    rates = {c.precipitation_mm_h for c in held_out.values() if c.weather == "rain"}
    assert rates == {5, 15, 35}


def test_the_study_samples_the_published_parameters():
    protocol, printed = load("sensitivity study")
    assert (
        protocol.weathers["rain"].parameters[0] == protocol.weathers["snow"].parameters[0] == "dry_friction"
    )
    assert (len(protocol.weathers["rain"].parameters), len(protocol.weathers["snow"].parameters)) == (6, 5)
    assert (protocol.samples, protocol.weathers["rain"].seed) == (128, 20260725)
    assert sum(figure.unit == "m" for figure in printed) == 7


def test_the_printed_groups_add_up_to_the_printed_means():
    printed = load("table of printed agreement")
    for split, parts in (
        ("held-out", ("weather", "brake", "road")),
        ("development", ("flat", "hump", "depression")),
    ):
        groups, whole = [printed[split][name] for name in parts], printed[split]["all"]
        assert sum(group.count for group in groups) == whole.count
        for figure, mean in whole.mean.items():
            total = sum(group.count * group.mean[figure] for group in groups) / whole.count
            assert total == pytest.approx(mean, rel=0.03), f"{split} {figure}"


def test_the_printed_cases_are_the_held_out_conditions_and_add_up_to_their_groups():
    """Table carsim_ood_per_case_supp beside Table carsim_validation: means and maxima to the printed digits."""
    printed = load("table of printed agreement")["held-out"]
    conditions = {one.name: one.scenario for one in load("list of conditions") if one.split == "held-out"}
    assert set(conditions) == set(printed) - {"weather", "brake", "road", "all"}

    def half_digit(value: float) -> float:
        return 0.51 * 10.0 ** int(Decimal(str(value)).as_tuple().exponent)

    def group_of(name: str) -> str:
        scenario = conditions[name]
        return "road" if scenario.hazard_height_m else "weather" if scenario.weather != "dry" else "brake"

    for group in ("weather", "brake", "road", "all"):
        cases = [printed[name].mean for name in conditions if group in ("all", group_of(name))]
        for figure, mean in printed[group].mean.items():
            values = [case[figure] for case in cases]
            assert sum(values) / len(values) == pytest.approx(mean, abs=half_digit(mean)), f"{group} {figure}"
            if group != "all":
                assert max(values) == pytest.approx(printed[group].maximum[figure], rel=0.04), (
                    f"{group} {figure}"
                )


def test_a_group_stands_beside_the_figure_of_its_split_alone():
    group = {
        "split": "held_out",
        "group": "brake",
        "count": 2,
        "speed_rmse_m_s": 0.01,
        "maximum": {"speed_rmse_m_s": 0.02},
        "road_cases_brake": True,
    }
    rows = {row["figure"]: row for row in put_beside_print([group, group | {"split": "mine"}])}
    assert len(rows) == 5 and rows["slip_rmse"]["mean"] is None
    found = rows["speed_rmse_m_s"]
    assert (found["mean"], found["maximum"], found["paper_mean"], found["paper_maximum"]) == (
        0.01,
        0.02,
        0.021,
        0.024,
    )
    assert not found["note"]
    (check, *_) = put_beside_print([group | {"split": "speed_check", "group": "all"}])
    assert check["note"] == "the cases here brake, the paper's coast by their slip"


def test_a_case_stands_beside_the_printed_case_with_its_conditions_whatever_its_name():
    braked = {"surface_coefficient": 0.82, "initial_speed_km_h": 60, "ramp_s": 0.5, "weather": "dry"}
    for row, printed in (
        ({"peak_pressure_mpa": 1.6, "brake_onset_s": 1.0}, "pressure-1.6mpa"),
        ({"peak_pressure_mpa": 2.3, "brake_onset_m": 12.0}, "onset-12m"),
        ({"peak_pressure_mpa": 1.7, "brake_onset_s": 1.0}, "brake-1.6MPa"),
    ):
        case = ReferenceCase.model_validate({"case": "brake-1.6MPa", "split": "held-out", **braked, **row})
        assert find_printed_name(case) == printed
