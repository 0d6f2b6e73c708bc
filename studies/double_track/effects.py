"""Truths of the campaigns: which effect, how large, and what a right verdict calls it."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from studies.double_track.declared import find_effect, read_declared
from studies.double_track.draws import keyed_generator

GROUPS = ("null", "standard", "further", "forms")
NULLS = 60


@dataclass(frozen=True, kw_only=True)
class Truth:
    """An undeclared effect, or none, in a campaign.

    Parameters
    ----------
    name : of the campaign
    effect : in effects.yaml; None where nothing is missing
    group : null, standard, further or forms
    library : name that a right verdict gives; None for nothing and for forms
    values : effect's numbers by name
    size : place among the sizes of the effect, 0 the smallest
    sizes : how many sizes there are
    same_form : its number means the same as the library's
    form : port, variable, limits, values and condition of a form
    """

    name: str
    effect: str | None = None
    group: str = "null"
    library: str | None = None
    values: dict[str, float] = field(default_factory=dict)
    size: int = 0
    sizes: int = 1
    same_form: bool = False
    form: dict[str, Any] | None = None


def list_truths(asked: Sequence[str], sizes: int, nulls: int, seed: int) -> Iterator[Truth]:
    """Truths of effects, forms, groups of these, or ``null``; each effect at sizes from small to large.

    Parameters
    ----------
    asked : names in effects.yaml, or of groups
    sizes : of each effect
    nulls : campaigns of the plain car
    seed : of the draws

    Raises
    ------
    ValueError
        For a name that is neither.
    """
    effects = read_declared("effects")
    names = [name for entry in asked for name in (effects[entry] if entry in GROUPS[1:] else (entry,))]
    for name in dict.fromkeys(names):
        if name == "null":
            yield from (Truth(name=f"null-{i + 1:02d}") for i in range(nulls))
        else:
            yield from (draw_truth(name, size, sizes, seed) for size in range(sizes))


def draw_truth(name: str, size: int, sizes: int, seed: int) -> Truth:
    """One size of an effect: each range is cut into as many equal shares, by logarithm, as there are sizes.

    Parameters
    ----------
    name : in effects.yaml
    size, sizes : place of this size, and how many there are
    seed : of the draw
    """
    entry = find_effect(name)
    rng = keyed_generator(seed, "size", name, size, sizes)
    share = (size + rng.random()) / sizes
    sign = -1.0 if entry.get("signs") and rng.random() < 0.5 else 1.0
    common: dict[str, Any] = {
        "name": f"{name.replace('_', '-')}-{size + 1}", "effect": name, "group": entry["group"], "size": size,
        "sizes": sizes,
    }  # fmt: skip
    if entry["group"] == "forms":
        scale = _at(entry["scale"], share)
        form = {key: entry[key] for key in ("port", "variable", "from", "to", "wet_only")}
        return Truth(**common, values={"scale": scale}, form=form | {"at": [scale * x for x in entry["at"]]})
    values = {}
    for i, (key, limits) in enumerate(entry["values"].items()):
        if isinstance(limits, list):
            values[key] = _at(limits, share if i == 0 else float(rng.random())) * (sign if i == 0 else 1.0)
        else:
            values[key] = float(limits)
    return Truth(**common, library=entry["library"], values=values, same_form=entry["same_form"])


def _at(limits: Sequence[float], share: float) -> float:
    low, high = limits
    if low < 0.0:
        return float(-np.exp(np.log(-high) + share * np.log(low / high)))
    return float(low * (high / low) ** share)
