"""The protocol of the paper's Appendix A.2."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from tasks.conventions import TICK_CHANNELS
from tasks.errors import InputError
from tasks.eval.state_agreement import (
    FIGURES,
    MODEL_COLUMNS,
    CaseFacts,
    case_agreement,
    summarise_groups,
)
from tasks.eval.stop_agreement import stop_agreement

Columns = dict[str, NDArray[np.float64]]
FLAT = CaseFacts(
    case="flat", hazard_height=0.0, hazard_length=3.7, hazard_center=20.0, wheelbase=2.7, brake_onset=1.0
)
HUMP = replace(FLAT, case="hump", hazard_height=0.075, brake_onset=None)
STATIC = np.deg2rad(0.154150)


def make_drive(
    deceleration: float = 5.0, speed: float = 10.0, duration: float = 6.0, rate: float = 1000.0
) -> Columns:
    """A model's record: constant speed, braking from 1 s, standing."""
    t = np.arange(round(duration * rate) + 1) / rate
    braking = np.clip(t - 1.0, 0.0, speed / deceleration) if deceleration > 0 else 0 * t
    v = speed - deceleration * braking
    s = (
        speed * t
        if deceleration == 0
        else speed * np.minimum(t, 1.0) + speed * braking - deceleration * braking**2 / 2
    )
    return {
        "t_ns": t * 1e9, "station": s, "speed": v, "pitch": 0.01 * np.sin(3 * t),
        "braking_slip_f": 0.04 * (v > 0), "braking_slip_r": 0.03 * (v > 0),
        "axle_load_f": 7000 + 500 * np.sin(t), "axle_load_r": 5800 - 500 * np.sin(t),
    }  # fmt: skip


def as_reference(model: Columns, until: float = np.inf) -> Columns:
    """Return an exact reference of that model, in the reference's names and units."""
    kept = model["t_ns"] * 1e-9 <= until + 1e-9
    columns = {
        "time": model["t_ns"] * 1e-9, "station": model["station"], "speed": model["speed"],
        "pitch": np.rad2deg(model["pitch"] + STATIC),
    }  # fmt: skip
    for wheel, axle in (("fl", "f"), ("fr", "f"), ("rl", "r"), ("rr", "r")):
        columns[f"slip_{wheel}"] = model[f"braking_slip_{axle}"]
        columns[f"wheel_load_{wheel}"] = model[f"axle_load_{axle}"] / 2
    return {name: values[kept] for name, values in columns.items()}


def test_the_model_s_columns_are_those_of_the_conventions() -> None:
    assert set(MODEL_COLUMNS) <= {channel.name for channel in TICK_CHANNELS}


@pytest.mark.parametrize("facts", [FLAT, HUMP])
def test_a_model_that_is_the_reference_scores_zero(facts: CaseFacts) -> None:
    model = make_drive(5.0 if facts is FLAT else 0.0)
    scored = case_agreement(as_reference(model), model, facts, STATIC)
    assert [getattr(scored, name) for name in FIGURES] == pytest.approx([0.0] * 5, abs=1e-9)
    assert scored.note == "" and scored.kind == facts.case


def test_a_flat_window_runs_from_onset_to_one_second_after_the_reference_stops() -> None:
    model = make_drive()
    scored = case_agreement(as_reference(model), model, FLAT, STATIC)
    # 10 m/s at 5 m/s2 from 1 s: at .05 m/s after 1.99 s
    assert scored.window == pytest.approx((1.0, 3.99), abs=1.5e-3)
    late = dict(model, speed=np.where(model["t_ns"] > 4.0e9, 3.0, model["speed"]))
    assert case_agreement(as_reference(model), late, FLAT, STATIC).speed_rmse_m_s == 0.0
    within = dict(model, speed=np.where(model["t_ns"] > 3.9e9, 3.0, model["speed"]))
    assert case_agreement(as_reference(model), within, FLAT, STATIC).speed_rmse_m_s > 0.1


def test_a_reference_that_ends_at_its_stop_is_scored_to_there_and_says_so() -> None:
    model = make_drive()
    scored = case_agreement(as_reference(model, until=2.99), model, FLAT, STATIC)
    assert scored.window == pytest.approx((1.0, 2.99))
    assert "one second after the stop" in scored.note and "2.990 s" in scored.note


def test_a_road_window_runs_from_half_a_metre_before_the_front_to_half_a_metre_behind_the_rear_axle() -> None:
    model = make_drive(0.0)
    scored = case_agreement(as_reference(model), model, HUMP, STATIC)
    assert scored.window == pytest.approx(((20 - 1.85 - 0.5) / 10, (20 + 1.85 + 2.7 + 0.5) / 10))
    outside = dict(model, pitch=np.where(np.abs(model["t_ns"] * 1e-9 - 2.0) > 0.6, 1.0, model["pitch"]))
    assert case_agreement(as_reference(model), outside, HUMP, STATIC).pitch_rmse_deg < 1e-9


def test_the_static_pitch_counts() -> None:
    model = make_drive()
    scored = case_agreement(as_reference(model), model, FLAT, STATIC + np.deg2rad(0.1))
    assert scored.pitch_rmse_deg == pytest.approx(0.1)


def test_constant_errors_come_out_as_they_went_in() -> None:
    model = make_drive()
    off = dict(
        model,
        speed=model["speed"] + 0.02,
        axle_load_f=model["axle_load_f"] + 60,
        axle_load_r=model["axle_load_r"] - 20,
    )
    off["braking_slip_f"] = model["braking_slip_f"] + 0.01
    scored = case_agreement(as_reference(model), off, replace(FLAT, stopping_distance=19.0), STATIC)
    assert scored.speed_rmse_m_s == pytest.approx(0.02)
    assert scored.wheel_load_rmse_n == pytest.approx((30 + 30 + 10 + 10) / 4)
    assert scored.slip_rmse == pytest.approx((0.01 + 0.01) / 4)


def test_slip_is_scored_only_above_half_a_metre_per_second_of_the_reference() -> None:
    model = make_drive()
    wild = dict(model, braking_slip_f=np.where(model["speed"] <= 0.5, 1.0, model["braking_slip_f"]))
    assert case_agreement(as_reference(model), wild, FLAT, STATIC).slip_rmse == 0.0
    wild = dict(model, braking_slip_f=np.where(model["speed"] <= 0.6, 1.0, model["braking_slip_f"]))
    assert case_agreement(as_reference(model), wild, FLAT, STATIC).slip_rmse > 0.01


def test_the_model_is_interpolated_at_the_reference_s_own_times() -> None:
    coarse, fine = make_drive(0.0, rate=100.0), make_drive(0.0, rate=1000.0)
    coarse["pitch"], fine["pitch"] = 0.01 * coarse["t_ns"] * 1e-9, 0.01 * fine["t_ns"] * 1e-9
    assert case_agreement(as_reference(fine), coarse, HUMP, STATIC).pitch_rmse_deg < 1e-9


def test_nothing_is_aligned_in_time() -> None:
    model = make_drive(0.0)
    late = dict(model, pitch=np.interp(model["t_ns"] - 0.05e9, model["t_ns"], model["pitch"]))
    error = np.rad2deg(
        0.01
        * (np.sin(3 * np.linspace(1.765, 2.505, 741)) - np.sin(3 * (np.linspace(1.765, 2.505, 741) - 0.05)))
    )
    scored = case_agreement(as_reference(model), late, HUMP, STATIC)
    assert scored.pitch_rmse_deg == pytest.approx(np.sqrt(np.mean(error**2)), rel=1e-3)


def test_the_flat_event_is_the_stopping_distance_from_each_onset() -> None:
    reference, model = as_reference(make_drive(5.0)), make_drive(4.0)
    scored = case_agreement(reference, model, FLAT, STATIC)
    assert scored.event_unit == "m"
    assert scored.event_error == pytest.approx(100 / 8 - 100 / 10, abs=2e-3)
    told = case_agreement(reference, model, replace(FLAT, stopping_distance=12.0), STATIC)
    assert told.event_error == pytest.approx(0.5, abs=2e-3)


def test_the_road_event_is_the_speed_over_the_feature_in_km_h() -> None:
    scored = case_agreement(as_reference(make_drive(0.0)), make_drive(0.0, speed=9.5), HUMP, STATIC)
    assert scored.event_unit == "km/h" and scored.event_error == pytest.approx(0.5 * 3.6)
    short = case_agreement(as_reference(make_drive(0.0)), make_drive(8.0), HUMP, STATIC)
    assert short.event_error == pytest.approx(10 * 3.6)  # stood before it got there


def test_a_brake_triggered_on_the_route_starts_at_each_vehicle_s_own_time() -> None:
    facts = replace(FLAT, brake_onset=None, brake_onset_station=10.0)
    scored = case_agreement(as_reference(make_drive()), make_drive(), facts, STATIC)
    assert scored.window[0] == pytest.approx(1.0) and scored.event_error == pytest.approx(0.0, abs=1e-9)


def test_groups_are_the_paper_s() -> None:
    flat, hump = make_drive(), make_drive(0.0)
    rows = [
        case_agreement(
            as_reference(flat),
            dict(flat, speed=flat["speed"] + e),
            replace(FLAT, stopping_distance=9.0),
            STATIC,
        )
        for e in (0.01, 0.03)
    ]
    rows.append(case_agreement(as_reference(hump), dict(hump, speed=hump["speed"] + 0.05), HUMP, STATIC))
    groups = summarise_groups(rows, {"flat": "weather", "hump": "road"})
    counts = {name: group["cases"] for name, group in groups.items()}
    assert counts == {"flat": 2, "hump": 1, "all": 3, "weather": 2, "road": 1}
    assert groups["flat"]["mean"]["speed_rmse_m_s"] == pytest.approx(0.02)
    assert groups["flat"]["maximum"]["speed_rmse_m_s"] == pytest.approx(0.03)
    assert groups["all"]["mean"]["speed_rmse_m_s"] == pytest.approx(0.03)
    assert groups["flat"]["event_unit"] == "m" and groups["hump"]["event_unit"] == "km/h"
    assert groups["all"]["event_unit"] == "" and groups["all"]["mean"]["event_error"] is None
    assert groups["weather"]["maximum"] == groups["flat"]["maximum"]
    assert groups["road"]["maximum"]["speed_rmse_m_s"] == pytest.approx(0.05)


def test_a_stop_s_duration_and_slip_distance_are_those_of_each_trace() -> None:
    reference, model = as_reference(make_drive(5.0)), make_drive(4.0)
    found = stop_agreement(reference, model, FLAT)
    # 10 m/s to .05 m/s; the slip is .04 and .03 on the way of v2 / 2a
    assert found is not None and found["braking_time_error_s"] == pytest.approx(9.95 / 4 - 9.95 / 5, abs=2e-3)
    assert found["slip_distance_error_m"] == pytest.approx(0.035 * (100 / 8 - 100 / 10), abs=2e-3)
    ended = as_reference(make_drive(5.0), until=2.985)  # at .075 m/s, ticks before it stands
    late = stop_agreement(ended, make_drive(5.0), FLAT)
    assert late is not None and late["braking_time_error_s"] == pytest.approx(0.005, abs=1.1e-3)
    # triggered at 10 m: the slower car, which brakes from 1 s all the same, is there at 1.2735 s and stands at 2.59 s
    at_place = replace(FLAT, brake_onset=None, brake_onset_station=10.0)
    slower = stop_agreement(reference, make_drive(5.0, speed=8.0), at_place)
    assert slower is not None and slower["braking_time_error_s"] == pytest.approx(
        1.99 - (2.59 - 1.2735), abs=3e-3
    )
    assert stop_agreement(reference, make_drive(0.0), FLAT) is None
    assert stop_agreement(as_reference(make_drive(0.0)), make_drive(0.0), HUMP) is None


def test_what_cannot_be_scored_is_refused_with_its_reason() -> None:
    model = make_drive()
    reference = as_reference(model)
    with pytest.raises(InputError) as caught:
        case_agreement({"time": reference["time"]}, {}, replace(FLAT, brake_onset=None), STATIC)
    assert len(caught.value.problems) == 3
    with pytest.raises(InputError, match="simulate that long"):
        case_agreement(reference, {k: v[:3000] for k, v in model.items()}, FLAT, STATIC)
    with pytest.raises(InputError, match="simulate longer"):
        case_agreement(reference, dict(model, speed=model["speed"] + 0.2), FLAT, STATIC)
    with pytest.raises(InputError, match="never reaches"):
        case_agreement(as_reference(make_drive(8.0)), model, HUMP, STATIC)


def test_every_reference_trace_agrees_with_itself_over_the_window_it_has(outside_data: Path) -> None:
    folder = outside_data / "reference" / "multibody"
    parquet = pytest.importorskip("pyarrow.parquet")
    for case in json.loads((folder / "cases.json").read_text()):
        table = parquet.read_table(folder / case["split"] / f"{case['case']}.parquet")
        reference = {name: table[name].to_numpy() for name in table.column_names}
        model = {
            "t_ns": reference["time"] * 1e9, "station": reference["station"], "speed": reference["speed"],
            "pitch": np.deg2rad(reference["pitch"]),
            "braking_slip_f": reference["slip_fl"], "braking_slip_r": reference["slip_rl"],
            "axle_load_f": 2 * reference["wheel_load_fl"], "axle_load_r": 2 * reference["wheel_load_rl"],
        }  # fmt: skip
        # the trace ends within a sample of the stop: give the model that sample
        model = {
            k: np.append(v, 0.0 if k == "speed" else v[-1] + (1e6 if k == "t_ns" else 0))
            for k, v in model.items()
        }
        facts = CaseFacts(
            case=case["case"], hazard_height=case["hazard_height_m"], hazard_length=case["hazard_length_m"],
            hazard_center=case["hazard_center_m"], wheelbase=2.7, brake_onset=case["brake_onset_s"],
            stopping_distance=case["stopping_distance_m"],
        )  # fmt: skip
        scored = case_agreement(reference, model, facts, 0.0)
        assert scored.speed_rmse_m_s < 1e-9 and scored.pitch_rmse_deg < 1e-6
        assert scored.event_error < 1e-3, case["case"]
        assert scored.kind == case["case"].split("-")[0]
        assert bool(scored.note) == (
            scored.kind == "flat" or case["case"] in ("hump-35kmh", "depression-35kmh")
        )
