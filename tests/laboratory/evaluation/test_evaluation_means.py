"""Means of figures over clips and visual seeds, by hand."""

from types import SimpleNamespace
from typing import Any

import pytest

from studies.evaluation.means import mean_rows
from studies.evaluation.paper_metrics import load_printed_figures
from studies.evaluation.rows import figure_row, find_control, group_weather_families

RATES = {"dry": 0.0, "rain-10": 10.0, "rain-50": 50.0}
DRIVES: dict[str, dict[str, float]] = {
    "stop": {"peak_pressure_mpa": 2.3, "hazard_height_m": 0.0},
    "flat": {"peak_pressure_mpa": 0.0, "hazard_height_m": 0.0},
    "hump": {"peak_pressure_mpa": 2.3, "hazard_height_m": 0.1},
}


def clips(*seeds: int) -> list[Any]:
    return [
        SimpleNamespace(facts=drive | {
            "clip_id": f"{sky}/{name}/{seed}", "label": f"{sky}/{name}/seed-{seed}", "weather": sky.partition("-")[0],
            "precipitation_mm_h": rate, "initial_speed_km_h": 60.0,
        }, statistics={})
        for sky, rate in RATES.items() for name, drive in DRIVES.items() for seed in seeds
    ]  # fmt: skip


def figures(metric: str, values: dict[str, float | None], **more: Any) -> list[dict[str, Any]]:
    return [figure_row(metric, "m", label, value, "1", note="why", **more) for label, value in values.items()]


def test_a_mean_is_taken_within_each_seed_and_then_over_seeds() -> None:
    rows = figures("e_weather", {
        "rain-10/stop/seed-1": 1.0, "rain-50/stop/seed-1": 2.0, "rain-10/stop/seed-2": 4.0, "rain-50/stop/seed-2": None,
        "rain-50/hump/seed-1": 99.0, "rain-50/flat/seed-1": 88.0,
    }, floor=0.5)  # fmt: skip
    found = {row["condition"]: row for row in mean_rows(rows, clips(1, 2))}
    paper = found["paper/stops"]
    # 1.5 in the first seed and 4 in the second, half the difference times the root of two
    assert paper["value"] == pytest.approx(2.75) and paper["seed_std"] == pytest.approx(2.5 / 2**0.5)
    assert (paper["paper"], paper["averaged"], paper["floor"]) == (0.00424, 3, 0.5)
    assert paper["note"] == "mean of 3; 1 more without a value; why"
    assert (
        found["rain-50/all"]["value"] == pytest.approx((2 + 99 + 88) / 3)
        and found["rain-50/all"]["paper"] is None
    )
    assert found["rain-10/all"]["value"] == pytest.approx(2.5) and found["all"]["averaged"] == 5


def test_one_seed_has_no_spread_and_a_mean_of_nothing_says_so() -> None:
    rows = figures("pitch_rmse", {"dry/stop/seed-1": None, "rain-10/stop/seed-1": None})
    (row,) = mean_rows(rows, clips(1))
    assert (row["condition"], row["value"], row["seed_std"]) == ("all", None, None)
    assert row["note"].startswith("mean of 0; 2 more without a value")


def test_windows_and_methods_are_never_mixed() -> None:
    rows = figures("e_path", {"rain-10/stop/seed-1": 1.0}, window=5) + figures(
        "e_path", {"rain-10/stop/seed-1": 3.0}
    )
    means = [row for row in mean_rows(rows, clips(1)) if row["condition"] == "all"]
    assert [(row["window"], row["value"]) for row in means] == [(5, 1.0), (0, 3.0)]


def test_a_family_of_weathers_is_of_its_kind_and_drive() -> None:
    made = clips(1, 2)
    conditions = [condition for _, condition, _ in group_weather_families(made)]
    assert conditions == [f"rain: {drive}/seed-{seed}" for drive in DRIVES for seed in (1, 2)]
    rows = figures(
        "clip_adjacent_accuracy", dict(zip(conditions, (1.0, 0.5, 0.0, 0.0, 0.0, 0.0), strict=True))
    )
    found = {row["condition"]: row for row in mean_rows(rows, made)}
    assert set(found) == {"all", "paper/rain-stops"}
    assert found["paper/rain-stops"]["value"] == 0.75 and found["paper/rain-stops"]["paper"] == 1.0


def test_a_clip_is_held_against_the_control_of_its_own_seed() -> None:
    made = clips(1, 2)
    for clip in made:
        for weather in (True, False):
            control = find_control(clip, made, weather=weather)
            assert control is None or control.facts["label"][-1] == clip.facts["label"][-1]
    assert sum(find_control(clip, made, weather=True) is not None for clip in made) == 12


def test_every_figure_of_the_paper_is_at_hand() -> None:
    assert load_printed_figures()["temporal_lpips_excess"] == {
        "rain-stops": 0.0510,
        "snow-stops": 0.1258,
    }
    assert load_printed_figures()["clip_adjacent_accuracy"] == {
        "rain-stops": 1.0,
        "snow-stops": 1.0,
    }
