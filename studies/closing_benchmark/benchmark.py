"""The close-loop's own error rates: campaigns with a known truth, judged one by one, counted with exact intervals."""

import time
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from catalogs.entries import load
from flows.measured.closing_error_rates import engine_hash
from flows.store.journal import append_line, read_lines
from flows.store.outputs import Outputs
from manifests.provenance import code_version
from studies.closing_benchmark.harder import load_harder
from studies.closing_benchmark.summary import (
    classify_outcome,
    measure_interval_miss,
    pair_outcome,
    summarise_benchmark,
)
from studies.closing_benchmark.synthetic import RICH, make_synthetic_campaign
from studies.closing_benchmark.tables import benchmark_tables
from studies.closing_benchmark.truths import Truth, load_sizes, load_truths
from tasks.campaign.planned_runs import RunPlan
from tasks.identification.decision.answer import Verdict
from tasks.identification.decision.verdict import judge_runs

FILE, TABLES, LOG = "closing-benchmark.json", "closing-benchmark.md", "campaigns.jsonl"
RATES = "closing_error_rates.json"
FIRST_NULL, FIRST_TRUTH, FIRST_SIZE = 200_000, 300_000, 400_000
FIRST_PAIR, FIRST_POOR, FIRST_POOR_NULL = 500_000, 600_000, 700_000
"""Seeds: of the first null, of the first campaign of the first truth, size and pair; 100 apart from one truth, size or
pair to the next. Seeds 0 to 4 of each served to set rules; a table of error rates begins behind them."""
SIZE_SEEDS = 5
"""Campaigns of each size of the power table."""


@dataclass(frozen=True, kw_only=True)
class Planned:
    """A campaign to be judged: its kind, the effects in its data (none, one or two), its seed and its runs."""

    kind: str
    truths: tuple[Truth, ...] = ()
    seed: int
    design: tuple[RunPlan, ...] = RICH

    @property
    def name(self) -> str | None:
        """Of its truths; None where there is none."""
        return " + ".join(truth.name for truth in self.truths) or None

    @property
    def values(self) -> dict[str, float]:
        """Effect parameters of all its truths."""
        return {name: value for truth in self.truths for name, value in truth.values.items()}


def close_loop_benchmark(
    *,
    out: str,
    seeds: int = 10,
    first_seed: int = 0,
    nulls: int = 100,
    harder: int = 1,
    minutes: float = 1e9,
    vehicle: str = "paper-reference",
) -> dict[str, Any]:
    """Judge synthetic campaigns with known truths; what an earlier call with the same engine made is kept.

    Every campaign is a line of ``campaigns.jsonl`` as soon as it is judged, so a stop at any time loses nothing. Seeds
    go round by round over all truths, so that whatever time there is covers them evenly.

    Parameters
    ----------
    out : folder for ``closing-benchmark.json``, its tables in Markdown, ``campaigns.jsonl``, and the counts alone, as
        they ship in ``catalogs/studies/closing_error_rates.json``
    seeds : campaigns of each truth
    first_seed : of each truth; rules were made on some of the seeds 0 to 4, on none after them
    nulls : campaigns of a model that lacks nothing
    harder : campaigns of each pair of effects, and of each truth on a poor design
    minutes : no campaign is begun after so long
    vehicle : catalogue name or file
    """
    results = Outputs(out, "lab close-loop-benchmark", FILE, RATES, TABLES)
    log, engine = results.path(FILE).with_name(LOG), engine_hash()
    rows = [row for row in read_lines(log, {"engine", "truth", "seed"}) if row["engine"] == engine]
    done = {(row["truth"], row["seed"]) for row in rows}
    model, surface, effects = (
        load("vehicle", vehicle),
        load("surface", "dense-asphalt"),
        load("library of effects"),
    )
    started = time.monotonic()
    for planned in _plan(seeds, first_seed, nulls, harder):
        if (planned.name, planned.seed) in done:
            continue
        if time.monotonic() - started > 60.0 * minutes:
            break
        left_out = {name for truth in planned.truths for name in truth.left_out}
        before = time.process_time()
        campaign = make_synthetic_campaign(
            model, surface, planned.values, planned.seed,
            slots=tuple(slot for truth in planned.truths for slot in truth.slots), design=planned.design,
        )  # fmt: skip
        made = time.process_time()
        library = tuple(effect for effect in effects if effect.name not in left_out)
        verdict = judge_runs(campaign, model, surface, library, load("set of decision rules")).verdict
        miss = measure_interval_miss(verdict, planned.name, planned.values) if planned.name else None
        row = {
            "kind": planned.kind,
            "truth": planned.name,
            "values": planned.values,
            "seed": planned.seed,
            "verdict": verdict.verdict,
            "outcome": _outcome(verdict, planned.truths),
            "named": [effect.name for effect in verdict.effects],
            "rivals": [rival.name for _, rival in verdict.rivals],
            "ports": [[effect.port, effect.variable] for effect in verdict.effects],
            "tried": [[effect.name, effect.score, effect.gain] for effect in verdict.tried[:3]],
            "half_widths_off": miss,
            "covered": None if miss is None else miss <= 1.0,
            "reasons": list(verdict.reasons),
            "cpu_s": time.process_time() - made,
            "made_cpu_s": made - before,
            "engine": engine,
        }
        rows.append(row)
        append_line(log, row)
    result = summarise_benchmark(rows) | {
        "campaigns": rows,
        "engine_sha256": engine,
        "made_with": code_version(),
    }
    results.write_json(FILE, result)
    results.write_json(RATES, {key: value for key, value in result.items() if key != "campaigns"})
    results.write(TABLES, benchmark_tables(result))
    return result


def _outcome(verdict: Verdict, truths: tuple[Truth, ...]) -> str:
    if len(truths) < 2:
        return classify_outcome(
            verdict, truths[0].name if truths else None, truths[0].form if truths else None
        )
    named, rivals = [e.name for e in verdict.effects], [rival.name for _, rival in verdict.rivals]
    return pair_outcome(verdict.verdict, named, rivals, [truth.name for truth in truths])


def _plan(seeds: int, first_seed: int, nulls: int, harder: int) -> Iterator[Planned]:
    """Every campaign, round by round over all truths, nulls and sizes spread over them; then the harder ones."""
    truths, sizes, study = load_truths(), load_sizes(), load_harder()
    library = tuple(truth for truth in truths if truth.in_library)
    rounds = max(seeds, 1)
    for i in range(rounds):
        seed = first_seed + i
        for n in range(i * nulls // rounds, (i + 1) * nulls // rounds):
            yield Planned(kind="null", seed=FIRST_NULL + n)
        for j, truth in enumerate(truths if i < seeds else ()):
            kind = "library" if truth.in_library else "outside"
            yield Planned(kind=kind, truths=(truth,), seed=FIRST_TRUTH + 100 * j + seed)
        for j, size in enumerate(sizes if i < min(seeds, SIZE_SEEDS) else ()):
            yield Planned(kind="size", truths=(size,), seed=FIRST_SIZE + 100 * j + seed)
    poor = study.drives()
    for i in range(harder):
        for j, pair in enumerate(study.pairs(library)):
            yield Planned(kind="pair", truths=pair, seed=FIRST_PAIR + 100 * j + i)
        for j, truth in enumerate(library):
            yield Planned(kind="poor", truths=(truth,), seed=FIRST_POOR + 100 * j + i, design=poor)
            yield Planned(kind="poor null", seed=FIRST_POOR_NULL + 100 * j + i, design=poor)
