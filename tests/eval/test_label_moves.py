"""How far labels moved: known shifts of known channels come back in the unit of their name."""

import numpy as np
import pytest

from tasks.eval.label_moves import compare_figures, compare_ticks

N = 1000
CHANNELS = (
    "speed", "pitch", "heave", "station", "braking_slip_f", "braking_slip_r", "axle_load_f", "axle_load_r",
    "brake_torque_f", "brake_torque_r",
)  # fmt: skip


def make_ticks() -> dict[str, np.ndarray]:
    rng = np.random.default_rng(3)
    return {name: rng.standard_normal(N) for name in CHANNELS}


@pytest.mark.parametrize(
    ("channel", "shift", "figure", "value"),
    [
        ("speed", 0.3, "speed_rms_m_s", 0.3),
        ("speed", -0.3, "speed_largest_m_s", 0.3),
        ("pitch", np.radians(0.2), "pitch_rms_deg", 0.2),
        ("heave", 0.004, "heave_rms_mm", 4.0),
        ("axle_load_f", 100.0, "axle_load_largest_n", 100.0),
        ("axle_load_r", 100.0, "axle_load_rms_n", 100.0 / np.sqrt(2)),
        ("station", -1.5, "final_station_change_m", -1.5),
    ],
)
def test_a_shift_of_a_channel_is_its_figure(channel: str, shift: float, figure: str, value: float) -> None:
    moved = make_ticks()
    moved[channel] = moved[channel] + shift
    moves = compare_ticks(make_ticks(), moved)
    assert moves[figure] == pytest.approx(value)
    untouched = {
        k: v for k, v in moves.items() if not k.startswith(channel.rsplit("_", 1)[0]) and "station" not in k
    }
    assert all(v == 0.0 for v in untouched.values())


def test_only_shared_ticks_count_and_a_missing_channel_is_no_number() -> None:
    short = {name: values[:100] for name, values in make_ticks().items()}
    assert compare_ticks(make_ticks(), short)["speed_rms_m_s"] == 0.0
    del short["pitch"]
    assert np.isnan(compare_ticks(make_ticks(), short)["pitch_rms_deg"])


def test_figures_change_from_a_to_b_and_nothing_stays_nothing() -> None:
    a = {"stopping_distance": 30.0, "peak_pitch": 0.05, "stop_time": None}
    b = {"stopping_distance": 33.5, "peak_pitch": 0.04, "stop_time": 4.0}
    moves = compare_figures(a, b)
    assert moves["stopping_distance_change_m"] == pytest.approx(3.5)
    assert moves["peak_pitch_change_deg"] == pytest.approx(np.degrees(-0.01))
    assert np.isnan(moves["stop_time_change_s"]) and np.isnan(moves["tyre_peak_change"])
