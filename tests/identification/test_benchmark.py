"""The generator of known truths, and the interval that its counts are given with."""

import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import binom

from catalogs.entries import load
from flows.measured.closing_error_rates import JUDGES
from manifests.provenance import source_hashes
from studies.closing_benchmark import benchmark as closing_benchmark
from studies.closing_benchmark.summary import (
    classify_outcome,
    compute_exact_interval,
    measure_interval_miss,
    pair_outcome,
    summarise_benchmark,
)
from studies.closing_benchmark.synthetic import TRAINING, make_synthetic_campaign
from studies.closing_benchmark.truths import load_sizes, load_truths

ROOT = Path(closing_benchmark.__file__).parents[2]
VEHICLE, SURFACE = load("vehicle", "paper-reference"), load("surface", "dense-asphalt")


def test_the_same_seed_gives_the_same_campaign_and_another_does_not() -> None:
    first, again, other = (
        make_synthetic_campaign(VEHICLE, SURFACE, {"fade": 0.05}, seed) for seed in (3, 3, 4)
    )
    assert all(np.array_equal(a.response, b.response) for a, b in zip(first.runs, again.runs, strict=True))
    assert not np.array_equal(first.runs[0].response, other.runs[0].response)
    assert len(first.train) == TRAINING and len(first.held_out) == len(first.runs) - TRAINING


def test_the_truth_shows_in_the_runs_that_feel_it() -> None:
    plain, faded = (make_synthetic_campaign(VEHICLE, SURFACE, truth, 5) for truth in ({}, {"fade": 0.06}))
    hot = next(i for i, run in enumerate(plain.runs) if run.disc_rise == 350.0)
    assert faded.runs[hot].response[-1, 0] - plain.runs[hot].response[-1, 0] > 1.0
    coasting = next(i for i, run in enumerate(plain.runs) if run.pressure.max() == 0.0)
    assert np.array_equal(faded.runs[coasting].response, plain.runs[coasting].response)


def test_the_exact_interval_is_clopper_and_pearsons() -> None:
    assert compute_exact_interval(0, 100) == pytest.approx((0.0, 1.0 - 0.025**0.01))
    low, high = compute_exact_interval(3, 40)
    assert binom.sf(2, 40, low) == pytest.approx(0.025) and binom.cdf(3, 40, high) == pytest.approx(0.025)


@pytest.mark.parametrize(("truth", "miss"), [(0.06, 0.0), (0.08, 1.0), (0.1, 2.0), (0.05, 1.0), (0.045, 1.5)])
def test_a_miss_is_measured_by_the_half_of_the_interval_on_its_side(truth: float, miss: float) -> None:
    value = SimpleNamespace(name="fade", value=0.06, ci_low=0.05, ci_high=0.08)
    verdict = SimpleNamespace(effects=(SimpleNamespace(name="brake_fade", parameters=(value,)),))
    assert measure_interval_miss(verdict, "brake_fade", {"fade": truth}) == pytest.approx(miss)
    assert measure_interval_miss(verdict, "brake_lag", {"lag": 0.1}) is None


def answer(name: str) -> SimpleNamespace:
    effect = SimpleNamespace(name=name, port="brake_torque", variable="pressure", parameters=())
    verdict = SimpleNamespace(verdict="FOUND", effects=(effect,), rivals=(), odds=(), tried=(), reasons=())
    return SimpleNamespace(verdict=verdict)


def test_a_benchmark_goes_on_where_it_was_stopped_and_starts_anew_with_another_engine(
    tmp_path, monkeypatch
) -> None:
    judged: list[int] = []

    def judge(seed: int, *_: object) -> SimpleNamespace:
        judged.append(seed)
        if len(judged) == 20:
            raise KeyboardInterrupt
        return answer("brake_fade")

    monkeypatch.setattr(
        closing_benchmark, "make_synthetic_campaign", lambda model, road, truth, seed, slots, design: seed
    )
    monkeypatch.setattr(closing_benchmark, "judge_runs", judge)
    monkeypatch.setattr(closing_benchmark, "measure_interval_miss", lambda *_: None)
    with pytest.raises(KeyboardInterrupt):
        closing_benchmark.close_loop_benchmark(out=str(tmp_path), seeds=2, nulls=4, harder=1)
    result = closing_benchmark.close_loop_benchmark(out=str(tmp_path), seeds=2, nulls=4, harder=1)
    seeds = [row["seed"] for row in result["campaigns"]]
    assert len(judged) == len(seeds) + 1 and len(set(seeds)) == len(seeds)
    library = [truth for truth in load_truths() if truth.in_library]
    harder = 3 * len(library)  # as many pairs as truths, and each truth and a null on the poor design
    assert len(seeds) == 4 + 2 * len(load_truths()) + 2 * len(load_sizes()) + harder
    # round by round: no truth has its second campaign before all have their first
    order = [row["truth"] for row in result["campaigns"] if row["kind"] in ("library", "outside")]
    assert order[: len(load_truths())] == [t.name for t in load_truths()]
    tables = (tmp_path / "closing-benchmark.md").read_text()
    assert "| false discoveries on nulls | 0 | 4 of 4 |" in tables
    assert "| brake_fade | fade 0.005 | 2 of 2 | 1.00 |" in tables
    monkeypatch.setattr(closing_benchmark, "engine_hash", lambda: "another")
    again = closing_benchmark.close_loop_benchmark(out=str(tmp_path), seeds=0, nulls=1, harder=0)
    assert [row["truth"] for row in again["campaigns"]] == [None]


WRONG = {"wrong", "false discovery"}


def row(truth: str | None, outcome: str, *, in_library: bool = True, covered: bool | None = None) -> dict:
    kind = "null" if truth is None else "library" if in_library else "outside"
    named = [truth] if outcome == "right" and truth else ["brake_dead_time"] if outcome in WRONG else []
    return {
        "kind": kind, "truth": truth, "outcome": outcome, "values": {}, "covered": covered, "cpu_s": 1.0,
        "named": named,
    }  # fmt: skip


@pytest.mark.parametrize(
    ("verdict", "named", "rivals", "expected"),
    [
        ("NOTHING", [], [], "refused"),
        ("FOUND", ["drag", "lag"], [], "both"),
        ("FOUND", ["lag"], [], "one"),
        ("FOUND", ["lag", "fade"], [], "wrong"),
        ("SET", ["fade"], ["lag"], "set with truth"),
        ("SET", ["fade"], ["push-out"], "set without truth"),
        ("UNKNOWN_FORM", ["brake_torque ~ const"], [], "form"),
    ],
)
def test_two_effects_at_once_are_counted_by_what_is_named(verdict, named, rivals, expected) -> None:
    assert pair_outcome(verdict, named, rivals, ["lag", "drag"]) == expected


HUMP = ("brake_torque", "pressure")


@pytest.mark.parametrize(
    ("verdict", "named", "rivals", "form", "expected"),
    [
        ("UNKNOWN_FORM", [("form", *HUMP)], [], HUMP, "right form"),
        ("UNKNOWN_FORM", [("form", "friction", "speed")], [], HUMP, "wrong form"),
        ("SET", [("form", *HUMP)], ["lag"], HUMP, "set with truth"),
        ("SET", [("effect", *HUMP)], ["lag"], HUMP, "set without truth"),
        ("SET", [("form", *HUMP)], ["lag"], None, "set with truth"),
        ("SET", [("form", *HUMP)], ["fade"], None, "set without truth"),
        ("UNKNOWN_FORM", [("form", *HUMP)], [], None, "form"),
    ],
)
def test_a_form_counts_by_its_port_and_variable_and_a_set_by_the_truth_in_it(
    verdict, named, rivals, form, expected
) -> None:
    effects = [
        SimpleNamespace(name="named", effect_class=kind, port=port, variable=x) for kind, port, x in named
    ]
    others = [("named", SimpleNamespace(name=name)) for name in rivals]
    found = SimpleNamespace(verdict=verdict, effects=effects, rivals=others)
    assert classify_outcome(found, "lag" if form is None else "hump", form) == expected


def test_the_summary_counts_each_kind_once() -> None:
    rows = [
        row(None, "right"), row(None, "false discovery"), row("brake_lag", "right", covered=True),
        row("brake_lag", "wrong"), row("brake_fade", "set with truth"), row("hump", "right form", in_library=False),
        row("brake_lag", "refused") | {"kind": "size"}, row("brake_lag", "refused") | {"kind": "poor"},
        row("brake_lag + brake_fade", "one") | {"kind": "pair"},
    ]  # fmt: skip
    result = summarise_benchmark(rows)
    assert (result["false_discoveries"]["hits"], result["false_discoveries"]["of"]) == (1, 2)
    shares = {entry["figure"]: (entry["hits"], entry["of"]) for entry in result["summary"]}
    assert shares["library effect named exactly"] == (1, 3) and shares["wrong single label"] == (1, 3)
    assert shares["truth within the 95 % interval"] == (1, 1)
    assert shares["outside the library: form with right port and variable"] == (1, 1)
    assert shares["two effects at once: one of them named, nothing else"] == (1, 1)
    assert shares["poor design: refused"] == (1, 1)
    # sizes and poor designs have shares of their own
    assert result["confusion"]["brake_lag"] == {"right": 1, "wrong": 1}
    assert result["named_instead"] == {"brake_lag": {"brake_dead_time": 1}, "nothing": {"brake_dead_time": 1}}


NO_JUDGE = (
    "catalogs/__init__", "catalogs/documents", "catalogs/entries", "catalogs/names",
    "catalogs/physical_limits", "catalogs/quantities", "catalogs/sentences", "catalogs/studies/__init__",
    "catalogs/variants", "catalogs/vehicles/added", "catalogs/vehicles/frozen", "catalogs/yaml_text", "flows/__init__",
    "flows/measured/__init__", "manifests/", "tasks/__init__", "tasks/errors", "tasks/kernel_cache",
    "tasks/render/__init__", "tasks/render/weather/__init__", "tasks/render/weather/named_sky",
)  # fmt: skip
"""Sources that a verdict imports and that decide nothing in it: reading, checking, naming and writing of files."""


def test_every_source_that_a_verdict_imports_counts_in_its_hash_or_is_known_to_decide_nothing() -> None:
    """Readers of the rules and of the grip in the weather stood in no hash: two engines shared one table."""
    program = (
        "import sys, catalogs.decision_rules, catalogs.vehicles, catalogs.surfaces, catalogs.effects\n"
        "import tasks.identification.decision.verdict\n"
        "print(*(module.__file__ for module in list(sys.modules.values()) if getattr(module, '__file__', None)))"
    )
    out = subprocess.run(
        [sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=True
    )
    own = [file[len(f"{ROOT}/") :] for file in out.stdout.split() if file.startswith(f"{ROOT}/")]
    own = [file for file in own if "site-packages" not in file]
    assert len(own) > 100
    untold = [file for file in own if not file.startswith((*JUDGES, *NO_JUDGE))]
    assert untold == []
    assert all(any(file.startswith(place) for file in source_hashes()) for place in JUDGES)
