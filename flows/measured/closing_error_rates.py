"""How often close-loop itself is right, for the page of a verdict: from the benchmark that ships."""

from typing import Any

from catalogs.studies.closing import load_error_rates
from flows.measured.closing_benchmark import engine_hash


def tell_error_rates(named: list[str]) -> list[str]:
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
        told = ", ".join(f"{count} {outcome}" for outcome, count in outcomes.items())
        others = {
            truth: of[name] for truth, of in rates["named_instead"].items() if truth != name and name in of
        }
        wrong = ", ".join(f"{truth} ({count})" for truth, count in others.items()) or "none"
        lines.append(f"{name} in the data: {told}; named where the data held something else: {wrong}")
    return lines + _tell_engine(rates, engine_hash())


def _tell_engine(rates: dict[str, Any], engine: str) -> list[str]:
    """Return a sentence where the counts are not of the engine of this verdict."""
    if rates["engine_sha256"] == engine:
        return []
    told = f"counted with engine {rates['engine_sha256'][:12]}; this verdict is of {engine[:12]}"
    again = rates.get("repeated_by", {})
    if again.get("engine_sha256") == engine:
        told += f", which judged {again['campaigns']} of those campaigns again, with the same digits"
    return [told]


def _share(share: dict[str, Any]) -> str:
    return f"{share['hits']} of {share['of']} (95 % interval {100 * share['low']:.1f} to {100 * share['high']:.1f} %)"
