"""The ablation of the paper's Section 4.4: each variant loses what its name says, and nothing else."""

from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from catalogs.scenario import Scenario
from catalogs.studies.ablation import cut_coupling
from studies.paper.ablation import COUPLINGS, run_ablation


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, Any], Path]:
    out = tmp_path_factory.mktemp("ablation")
    return run_ablation(out=str(out)), out


def stops(result: dict[str, Any], variant: str, weather: str) -> dict[float, float]:
    return {
        round(row["precipitation_mm_h"], 6): row["stopping_distance_m"]
        for row in result["stops"]
        if (row["variant"], row["weather"]) == (variant, weather)
    }


@pytest.mark.parametrize("weather", ["rain", "snow"])
def test_appearance_only_stops_as_on_the_dry_road_at_every_rate(
    made: tuple[dict[str, Any], Path], weather: str
) -> None:
    assert len(set(stops(made[0], "appearance-only", weather).values())) == 1


@pytest.mark.parametrize(("weather", "level"), [("rain", 10.0), ("snow", 1.0)])
def test_fixed_mu_jumps_from_dry_to_one_stop_that_is_the_full_models_at_the_familys_rate(
    made: tuple[dict[str, Any], Path], weather: str, level: float
) -> None:
    fixed, full = (stops(made[0], variant, weather) for variant in ("fixed-mu", "full"))
    assert fixed[0.0] == full[0.0]
    assert {value for rate, value in fixed.items() if rate > 0} == {full[level]}


@pytest.mark.parametrize("weather", ["rain", "snow"])
def test_the_full_models_stop_grows_with_the_rate_without_a_jump(
    made: tuple[dict[str, Any], Path], weather: str
) -> None:
    curve = list(stops(made[0], "full", weather).values())
    steps = [later - earlier for earlier, later in pairwise(curve)]
    assert min(steps) > -0.02  # the ABS limit cycle moves a stop by a centimetre
    assert max(steps) < 0.15 * (curve[-1] - curve[0])


def test_full_snow_cover_saturates(made: tuple[dict[str, Any], Path]) -> None:
    curve = stops(made[0], "full", "snow")
    assert curve[2.0] == curve[2.5] == curve[3.0] > curve[1.9]


def test_only_the_coupled_car_dives_before_the_hump_and_reaches_it_late(
    made: tuple[dict[str, Any], Path],
) -> None:
    rows = {row["variant"]: row for row in made[0]["pitch"]}
    still, full = rows["vertical-only"], rows["full"]
    assert still["brake_onset_s"] is None and still["stop_time_s"] is None
    assert full["front_axle_meets_hump_s"] > still["front_axle_meets_hump_s"]
    assert full["pitch_before_hump_deg"] > still["pitch_before_hump_deg"] + 1.5
    # the drier the road is taken to be, the harder the car brakes before it
    order = ("full", "fixed-mu", "appearance-only")
    dives = [rows[name]["pitch_before_hump_deg"] for name in order]
    assert dives == sorted(dives)


def test_the_full_model_follows_the_reference_and_no_cut_one_does(outside_data: Path, tmp_path: Path) -> None:
    traces = outside_data / "reference" / "multibody"
    if not traces.is_dir():
        pytest.skip(f"no reference traces at {traces}")
    figures = run_ablation(out=str(tmp_path), vehicle="multibody-grown", traces=str(traces))["reference"]
    assert figures["full_pitch_rmse_deg"] < 0.05
    assert all(figures[f"{name}_pitch_rmse_deg"] > 0.4 for name in COUPLINGS if name != "full")


def test_a_cut_changes_weather_or_brake_and_nothing_else() -> None:
    seen = Scenario(
        weather="snow", precipitation_mm_h=3.0, snow_accumulation_h=2.0, peak_pressure_mpa=2.0,
        brake_onset_s=1.0, hazard_height_m=0.1, hazard_length_m=3.0,
    )  # fmt: skip
    assert cut_coupling(seen, "full") == seen
    assert cut_coupling(seen, "appearance-only").weather == "dry"
    assert cut_coupling(seen, "appearance-only").peak_pressure_mpa == 2.0
    assert cut_coupling(seen, "vertical-only").peak_pressure_mpa == 0.0
    assert cut_coupling(seen, "vertical-only").hazard_height_m == 0.1
    assert cut_coupling(seen, "fixed-mu").precipitation_mm_h == 1.0
    assert cut_coupling(cut_coupling(seen, "appearance-only"), "fixed-mu") == cut_coupling(
        seen, "appearance-only"
    )
