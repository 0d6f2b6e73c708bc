"""The page of a verdict says how often such verdicts are right, by the benchmark that ships."""

import pytest

from flows.measured import closing_error_rates
from flows.measured.closing_error_rates import describe_error_rates, load_error_rates
from studies.closing_benchmark.summary import summarise_benchmark
from studies.closing_benchmark.truths import load_truths


def row(kind: str, truth: str | None, outcome: str, named: list[str], seed: int) -> dict[str, object]:
    return {
        "kind": kind, "truth": truth, "values": {}, "seed": seed, "verdict": "FOUND", "outcome": outcome,
        "named": named, "rivals": [], "covered": None, "cpu_s": 1.0,
    }  # fmt: skip


def test_it_names_what_was_right_and_what_was_taken_for_the_effect(monkeypatch: pytest.MonkeyPatch) -> None:
    rows = [
        row("null", None, "right", [], 1),
        row("null", None, "false discovery", ["brake_lag"], 2),
        row("library", "brake_lag", "right", ["brake_lag"], 3),
        row("library", "brake_lag", "refused", [], 4),
        row("library", "brake_dead_time", "wrong", ["brake_lag"], 5),
    ]
    rates = summarise_benchmark(rows) | {"engine_sha256": "e" * 64}
    monkeypatch.setattr(closing_error_rates, "load_error_rates", lambda: rates)
    monkeypatch.setattr(closing_error_rates, "engine_hash", lambda: "f" * 64)
    page = "; ".join(describe_error_rates(["brake_lag", "headwind"]))
    assert "nothing is missing: something named in 1 of 2 (95 % interval 1.3 to 98.7 %)" in page
    assert "named exactly in 1 of 3" in page
    assert "brake_lag in the data: 1 refused, 1 right" in page
    assert "named where the data held something else: brake_dead_time (1), nothing (1)" in page
    assert "headwind: not among the effects that were tried" in page
    assert page.endswith("counted with engine eeeeeeeeeeee; this verdict is of ffffffffffff")
    rates["repeated_by"] = {"engine_sha256": "f" * 64, "campaigns": 57}
    page = "; ".join(describe_error_rates(["brake_lag"]))
    assert page.endswith("which judged 57 of those campaigns again, with the same digits")
    monkeypatch.setattr(closing_error_rates, "engine_hash", lambda: "e" * 64)
    assert "engine" not in "; ".join(describe_error_rates(["brake_lag"]))


def test_the_counts_that_ship_have_nulls_and_every_truth_as_often() -> None:
    rates = load_error_rates()
    assert rates["false_discoveries"]["of"] == 55
    assert {truth: sum(outcomes.values()) for truth, outcomes in rates["confusion"].items()} == {
        truth.name: 5 if truth.in_library else 2 for truth in load_truths()
    }
    assert sum(share["of"] for share in rates["summary"] if share["figure"].startswith("refused")) == 140
