"""The paper's twelve selection rules: windows, baselines, thresholds and what each costs."""

from dataclasses import replace

import numpy as np
import pytest

from studies.measured_drives.events import Event, RecordedRun
from studies.measured_drives.plans import load_plan
from studies.measured_drives.selection import QUANTITIES, judge_event, select_events, tabulate_attrition

PROTOCOL = load_plan("protocol", "brake-dive")
INTERVAL = 0.01
T = np.arange(400) * INTERVAL
ONSET = 1.5


def good_columns() -> dict[str, np.ndarray]:
    """An event that keeps every rule: 0.5 MPa within 0.25 s from the onset on, straight and smooth."""
    since = T - ONSET
    pressure = np.where(since >= -1e-9, np.clip(0.13 + 2.0 * since, 0.0, 0.5), 0.0)
    pressure[since > 1.5] = 0.0
    return {
        "brake_pressure": pressure, "speed": 15.0 - 1.0 * np.clip(since, 0, 1.5),
        "longitudinal_acceleration": -1.0 * (since > 0.1), "pitch": 0.3 + 0.4 * np.clip(since - 0.05, 0.0, 0.5),
        "pitch_rate": np.zeros(400), "vertical_acceleration": np.zeros(400), "steering_angle": np.zeros(400),
        "yaw_rate": np.zeros(400), "roll_rate": np.zeros(400),
    }  # fmt: skip


def make_drive(columns: dict[str, np.ndarray], name: str = "one") -> RecordedRun:
    return RecordedRun(name=name, drive=name, interval=INTERVAL, columns=columns)


def only_event(columns: dict[str, np.ndarray]) -> Event:
    (judged,) = select_events([make_drive(columns)], PROTOCOL).judged
    return judged.event


def test_the_catalogue_holds_the_papers_twelve_rules_and_failure_counts() -> None:
    # paper, Appendix C.5, table of event-selection rules
    assert [rule.paper_fails for rule in PROTOCOL.rules] == [45, 47, 44, 41, 71, 48, 64, 11, 45, 8, 40, 51]
    limits = [rule.limit for rule in PROTOCOL.rules]
    assert limits == pytest.approx([0.5, 12 / 3.6, 0.3, 0.4, 10, 1.5, 0.25, 0.07, 0.12, 0.8, 1.5, 0.09])
    assert (PROTOCOL.analysis, PROTOCOL.baseline) == ((-0.8, 1.0), (-0.6, -0.1))
    assert (PROTOCOL.evaluation, PROTOCOL.quality) == ((0.0, 0.5), (-0.2, 0.6))
    assert PROTOCOL.onset_pressure == pytest.approx(0.12)


def test_a_clean_event_is_retained() -> None:
    selection = select_events([make_drive(good_columns())], PROTOCOL)
    assert (selection.episodes, len(selection.judged), len(selection.retained)) == (1, 1, 1)
    assert selection.retained[0].at == pytest.approx(ONSET)


FAULTS = {
    "pressure_duration": {"brake_pressure": lambda x: np.where(T > ONSET + 0.4, 0.0, x)},
    "start_speed": {"speed": lambda x: x - 12.0},
    "pressure_increase": {"brake_pressure": lambda x: 0.25 * x + 0.09 * (x > 0)},
    "deceleration_increase": {"longitudinal_acceleration": lambda x: 0.3 * x},
    "steering_p95": {"steering_angle": lambda x: x + 12.0},
    "yaw_rate_p95": {"yaw_rate": lambda x: x - 2.0},
    "pitch_slope": {"pitch": lambda x: x - 0.3 * (T - ONSET)},
    "pitch_deviation": {
        "pitch": lambda x: x + 0.11 * np.sin(2 * np.pi * (T - ONSET + 0.35) / 0.25 + np.pi / 2)
    },
    "onset_residual": {"pitch": lambda x: x + 0.15 * (T > ONSET - 0.05)},
    "vertical_acceleration_p95": {"vertical_acceleration": lambda x: x + 0.9},
    "roll_rate_p95": {"roll_rate": lambda x: x - 1.6},
    "pressure_before_p95": {"brake_pressure": lambda x: np.where(T < ONSET, 0.1, x)},
}


@pytest.mark.parametrize("rule", FAULTS)
def test_each_rule_refuses_its_own_fault_and_the_attrition_table_counts_it(rule: str) -> None:
    columns = good_columns()
    for channel, damage in FAULTS[rule].items():
        columns[channel] = damage(columns[channel])
    selection = select_events([make_drive(columns), make_drive(good_columns(), "two")], PROTOCOL)
    assert selection.judged[0].failed == (rule,)
    assert len(selection.retained) == 1
    row = next(row for row in tabulate_attrition(selection, PROTOCOL) if row.rule == rule)
    assert (row.fails, row.fails_only_here) == (1, 1)


def test_all_rules_are_tried_and_failures_overlap() -> None:
    columns = good_columns()
    columns["yaw_rate"] = columns["yaw_rate"] + 5.0
    columns["steering_angle"] = columns["steering_angle"] + 50.0
    selection = select_events([make_drive(columns)], PROTOCOL)
    assert selection.judged[0].failed == ("steering_p95", "yaw_rate_p95")
    rows = {row.rule: row for row in tabulate_attrition(selection, PROTOCOL)}
    assert (rows["steering_p95"].fails, rows["steering_p95"].fails_only_here, rows["yaw_rate_p95"].left) == (
        1,
        0,
        0,
    )


def test_a_rule_without_its_channel_is_not_assessed_and_refuses_nothing() -> None:
    columns = good_columns()
    del columns["roll_rate"]
    selection = select_events([make_drive(columns)], PROTOCOL)
    assert selection.unassessed == ("roll_rate_p95",) and len(selection.retained) == 1
    row = next(row for row in tabulate_attrition(selection, PROTOCOL) if row.rule == "roll_rate_p95")
    assert row.fails is None


def test_an_event_without_its_whole_window_is_no_candidate() -> None:
    cut = {name: values[80:] for name, values in good_columns().items()}
    selection = select_events([make_drive(cut)], PROTOCOL)
    assert (selection.episodes, len(selection.judged)) == (1, 0)


def test_the_dive_is_the_change_about_the_line_before_the_event() -> None:
    columns = good_columns()
    expected = columns["pitch"] - 0.3
    columns["pitch"] = columns["pitch"] + 0.2 * T - 1.0
    event = only_event(columns)
    inside = (T >= ONSET - 0.8 - 1e-6) & (T <= ONSET + 1.0 + 1e-6)
    np.testing.assert_allclose(event.dive, expected[inside], atol=1e-9)
    assert event.pitch_baseline[0] == pytest.approx(0.2)


def test_quantities_are_measured_from_the_median_before_the_event() -> None:
    columns = good_columns()
    columns["longitudinal_acceleration"] = columns["longitudinal_acceleration"] - 0.25
    columns["longitudinal_acceleration"][110] = 4.0  # one jolt before the event moves no median
    event = only_event(columns)
    assert QUANTITIES["deceleration_increase"].measure(event) == pytest.approx(1.0)
    assert QUANTITIES["pressure_increase"].measure(event) == pytest.approx(0.5)


def test_no_rule_sees_the_pitch_after_the_onset() -> None:
    event = only_event(good_columns())
    after = event.time > 1e-6
    moved = replace(event, columns={**event.columns, "pitch": event.columns["pitch"] + 5.0 * after})
    assert judge_event(event, PROTOCOL.rules).values == judge_event(moved, PROTOCOL.rules).values
