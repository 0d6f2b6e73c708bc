"""What runs would say of a few candidates, made from their derivatives alone: what the tests of odds start from."""

from collections.abc import Sequence
from dataclasses import replace
from math import nan

import numpy as np
from numpy.typing import NDArray

from catalogs.entries import load
from tasks.identification.decision.candidates import Candidate, Columns
from tasks.identification.decision.odds import RunGrams

EFFECTS = {effect.name: effect for effect in load("library of effects")}
SESSION = 8
"""Numbers of the session, which stand last among the columns."""


def effect_of(name: str, place: int, **changed: float) -> Candidate:
    """An effect of the library whose number has the column of its place; without changes its sizes are of order one."""
    effect = EFFECTS[name]
    plain = Candidate(
        name=name, effect_class=effect.effect_class, port=effect.port, variable=effect.variable, effect=effect,
        second=nan, columns=(place,), base=place, slab=10.0, lower=-100.0, upper=100.0, matters=1.0, log_prior=0.0,
    )  # fmt: skip
    return replace(plain, **changed)


def form_of(port: str, variable: str, places: Sequence[int], **changed: float) -> Candidate:
    """A form outside the library with a column for each knot."""
    plain = Candidate(
        name=f"form {port}({variable})", effect_class="form", port=port, variable=variable, effect=None, second=nan,
        columns=tuple(places), base=-1, slab=10.0, lower=-100.0, upper=100.0, matters=1.0, log_prior=0.0,
    )  # fmt: skip
    return replace(plain, **changed)


def grams_of(
    candidates: Sequence[Candidate],
    designs: Sequence[NDArray[np.float64]],
    residuals: Sequence[NDArray[np.float64]],
    spike: float = 0.01,
) -> RunGrams:
    """What runs say whose whitened residuals, float64 [M] each, have these derivatives, float64 [M, C] each."""
    numbers = sum(candidate.base >= 0 for candidate in candidates)
    whole = [np.column_stack((design, np.zeros((len(design), SESSION)))) for design in designs]
    count = whole[0].shape[1]
    columns = Columns(
        base=np.array([*range(numbers), *range(count - SESSION, count)]),
        spike=np.array([*[spike] * numbers, *[1.0] * SESSION]),
        count=count,
        candidates=tuple(candidates),
    )
    return RunGrams(
        information=np.array([x.T @ x for x in whole]),
        score=np.array([x.T @ r for x, r in zip(whole, residuals, strict=True)]),
        centre=np.zeros(count), columns=columns,
    )  # fmt: skip
