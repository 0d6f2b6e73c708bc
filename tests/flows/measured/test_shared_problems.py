"""One fault that many runs share is told once."""

from pathlib import Path

import pytest

from flows.measured.importing import import_measurements
from flows.measured.readable_recordings import RecordingProblem, join_shared_problems
from tasks.errors import InputError
from tests.campaign.recorded import braking_columns, log_signal
from tests.flows.measured.recordings import map_beside, write_csv


def find_place_problem(number: int, sentence: str) -> RecordingProblem:
    return RecordingProblem(name=f"run-{number:02d}", origin=f"run-{number:02d} (log.csv)", sentence=sentence)


def test_a_shared_fault_is_told_once_with_its_runs_and_the_range_of_its_figures() -> None:
    found = [
        find_place_problem(n, f"channel speed reaches {100.0 + n:.4g} m/s, limit 90 m/s^2")
        for n in range(1, 39)
    ]
    (told,) = join_shared_problems(found, 40, "runs")
    assert told == (
        "in 38 of 40 runs (run-01, run-02, run-03, run-04, run-05, run-06 and 32 more): channel speed reaches 101..138"
        " m/s, limit 90 m/s^2"
    )


def test_faults_of_few_runs_and_other_faults_stand_alone() -> None:
    found = [
        find_place_problem(1, "is late"),
        find_place_problem(2, "is late"),
        *(find_place_problem(n, f"falls to -0.{n}") for n in (1, 2, 3)),
    ]
    assert join_shared_problems(found, 3, "runs") == [
        "run-01 (log.csv): is late",
        "run-02 (log.csv): is late",
        "in 3 of 3 runs (run-01, run-02, run-03): falls to -0.3..-0.1",
    ]


def test_two_faults_of_one_run_stay_two() -> None:
    found = [
        find_place_problem(n, f"channel wheel: frozen at {at} s") for n in (1, 2, 3) for at in (n, 10 * n)
    ]
    first, second = join_shared_problems(found, 3, "runs")
    assert "at 1..3 s" in first and "at 10..30 s" in second


@pytest.mark.parametrize(
    ("signal", "factor", "words"),
    [
        ("p_bar", 100.0, "in 4 of 4 runs (run-0, run-1, run-2, run-3): channel brake_pressure reaches 2"),
        ("w_r", 0.0, "in 4 of 4 files (run-0.csv, run-1.csv, run-2.csv, run-3.csv): signal w_r is missing"),
    ],
)  # fmt: skip
def test_an_import_tells_what_all_its_runs_share_once(
    tmp_path: Path, signal: str, factor: float, words: str
) -> None:
    for n in range(4):
        log = log_signal(braking_columns(3.5 + 0.5 * n))
        log[signal] = factor * log[signal]
        if factor == 0.0:
            del log[signal]
        write_csv(tmp_path / f"run-{n}.csv", log)
    with pytest.raises(InputError) as caught:
        import_measurements(str(tmp_path), map=map_beside(tmp_path), out=str(tmp_path / "campaign"))
    assert [problem[: len(words)] for problem in caught.value.problems].count(words) == 1
    assert not any(problem.startswith("run-") for problem in caught.value.problems)
