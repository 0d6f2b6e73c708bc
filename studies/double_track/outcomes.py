"""How a verdict stands to the truth of a double-track campaign."""

from collections.abc import Mapping
from typing import Any

OUTCOMES = ("exact", "set with the truth", "form instead", "nothing", "refused", "wrong")
"""From best to worst; `wrong` is a confident name that is not the truth, or any name where nothing is missing."""


def judge_verdict(label: Mapping[str, Any], verdict: Mapping[str, Any]) -> str:
    """One of `OUTCOMES`.

    Exact is the truth and nothing else. A set counts where the truth is one of its members. A form in place of a
    library's effect is no name, but not right either; for a form in the data port and variable must be right.

    Parameters
    ----------
    label : of the campaign, from labels.json
    verdict : content of verdict.json
    """
    named = [effect["name"] for effect in verdict["effects"]]
    if not named:
        return "exact" if label["group"] == "null" else "nothing"
    if label["group"] == "null":
        return "wrong"
    forms = {
        (effect["port"], effect["variable"]) for effect in verdict["effects"] if effect["class"] == "form"
    }
    rivals = verdict["rivals"]
    if label["form"] is not None:
        truth = (label["form"]["port"], label["form"]["variable"])
        if truth in forms:
            return "exact" if len(named) == 1 else "wrong"
        told = {(rival["port"], rival["variable"]) for rival in rivals if rival["class"] == "form"}
        return "set with the truth" if truth in told else "wrong"
    names = {*named, *(rival["name"] for rival in rivals)}
    if verdict["verdict"] == "SET":
        return "set with the truth" if label["library"] in names else "wrong"
    if named == [label["library"]]:
        return "exact"
    only_forms = all(effect["class"] == "form" for effect in verdict["effects"])
    return "form instead" if only_forms else "wrong"


def estimate_of(label: Mapping[str, Any], verdict: Mapping[str, Any]) -> dict[str, float] | None:
    """Estimate of the effect's first number beside its truth and interval; None unless the truth alone is named.

    Parameters
    ----------
    label : of the campaign
    verdict : content of verdict.json
    """
    if label["library"] is None or [effect["name"] for effect in verdict["effects"]] != [label["library"]]:
        return None
    name, truth = next(iter(label["values"].items()))
    found = verdict["effects"][0]["parameters"][name]
    return {"truth": truth, "value": found["value"], "low": found["ci_low"], "high": found["ci_high"]}
