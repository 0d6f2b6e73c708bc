"""How often close-loop itself is right, for the page of a verdict: from the benchmark that ships."""

from typing import Any

from catalogs.documents import read_json_document
from catalogs.entries import CATALOGUE
from manifests.canonical import sha256_of
from manifests.provenance import source_hashes

ERROR_RATES = CATALOGUE / "studies" / "closing_error_rates.json"
"""Counts of `musync lab close-loop-benchmark`, without the campaigns one by one."""
JUDGES = (
    "tasks/campaign/",
    "tasks/conventions",
    "tasks/identification/",
    "tasks/vehicle/",
    "tasks/surface/",
    "catalogs/effects/",
    "catalogs/decision_rules",
    "catalogs/surfaces",
    "catalogs/tyre_families",
    "catalogs/tyres.",
    "catalogs/vehicles/__init__",
    "catalogs/vehicles/inherited",
    "catalogs/vehicles/numbers",
    "catalogs/vehicles/paper",
    "catalogs/weather/",
)
"""Sources that a verdict depends on: campaigns judged by the same ones belong to one table."""


def engine_hash() -> str:
    """SHA-256 over the sources that a verdict depends on."""
    judging = {path: digest for path, digest in source_hashes().items() if path.startswith(JUDGES)}
    return sha256_of(f"{path} {digest}\n".encode() for path, digest in sorted(judging.items()))


def load_error_rates() -> dict[str, Any]:
    """Counts of the benchmark that ships, with the hash of the engine that was judged."""
    rates: dict[str, Any] = read_json_document(ERROR_RATES, "table of error rates")
    return rates


def describe_error_rates(named: list[str]) -> list[str]:
    """Return the benchmark's error rates in sentences: for nulls, library effects, and what this verdict names.

    Parameters
    ----------
    named : effects of the verdict
    """
    rates = load_error_rates()
    nulls, exact = rates["false_discoveries"], rates["summary"][0]
    lines = [
        f"campaigns where nothing is missing: something named in {_share(nulls)}",
        f"campaigns with one library effect: named exactly in {_share(exact)}",
    ]
    for name in named:
        outcomes = rates["confusion"].get(name)
        if outcomes is None:
            lines.append(f"{name}: not among the effects that were tried")
            continue
        counted = ", ".join(f"{count} {outcome}" for outcome, count in outcomes.items())
        others = {
            truth: of[name] for truth, of in rates["named_instead"].items() if truth != name and name in of
        }
        wrong = ", ".join(f"{truth} ({count})" for truth, count in others.items()) or "none"
        lines.append(f"{name} in the data: {counted}; named where the data held something else: {wrong}")
    return lines + _describe_engine(rates, engine_hash())


def _describe_engine(rates: dict[str, Any], engine: str) -> list[str]:
    """Return a sentence where the counts are not of the engine of this verdict."""
    if rates["engine_sha256"] == engine:
        return []
    sentence = f"counted with engine {rates['engine_sha256'][:12]}; this verdict is of {engine[:12]}"
    again = rates.get("repeated_by", {})
    if again.get("engine_sha256") == engine:
        sentence += f", which judged {again['campaigns']} of those campaigns again, with the same digits"
    return [sentence]


def _share(share: dict[str, Any]) -> str:
    return f"{share['hits']} of {share['of']} (95 % interval {100 * share['low']:.1f} to {100 * share['high']:.1f} %)"
