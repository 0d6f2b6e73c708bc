"""Candidates: numbers that may explain a residual, each with the sizes that it may have, and forms beside them.

Every number of the table belongs to every explanation. One that is not named stays within a *spike* about the vehicle
file's value: the size that matters to nobody, or the file's own tolerance. One that is named has the *slab*, the sizes
that a car may lack (spike and slab, George and McCulloch 1993, doi:10.1080/01621459.1993.10476353). Small errors
everywhere, which every model of another car has, are therefore no discovery.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import log, nan

import numpy as np
from numpy.typing import NDArray

from tasks.campaign.campaign import FILE_NUMBERS, SESSION
from tasks.identification.decision.forms import FORM_BOUND, FORM_MATTERS, KEYS, KNOTS, PORT_STEP
from tasks.identification.inference.derivatives import list_second_values
from tasks.identification.inference.forward import RunModel
from tasks.identification.inference.tyre_limit import (
    measure_peak_deceleration,
    reaches_limit,
    saturates_tyres,
)
from tasks.identification.rules import DecisionRules
from tasks.vehicle.effects.grown import FAMILY, find_family_tables
from tasks.vehicle.effects.library import Effect
from tasks.vehicle.parameters import Vehicle

CLASSES = 3
"""Classes of what may be lacking: physics, a number of the vehicle's file, an instrument [1]."""
UNKNOWN = ("front_bias", "wet_friction", "snow_friction")
"""Numbers that a file knows no better than the brake's gain: how brakes are shared, and what wet tyres hold."""
BRAKED, FEWEST_STOPS = 1.5, 2
"""Deceleration of a stop, more than an engine's overrun [m/s2], and stops that show the curve of a brake [1]."""


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """One thing that may explain what a model leaves over.

    Parameters
    ----------
    name, effect_class, port, variable : as in the library, or of a form
    effect : of the library; None for a form
    second : value of the effect's second number; NaN where it has none, or its first value
    columns : indices in `Columns` of its derivatives
    base : place of its number among those of every explanation; -1 for a form
    slab : standard deviation of the sizes that a car may lack [unit of the number]
    lower, upper : bounds of the number [its unit]
    matters : smallest size that matters [unit of the number]
    log_prior : logarithm of the odds that it is what is lacking, before any run [1]
    """

    name: str
    effect_class: str
    port: str
    variable: str
    effect: Effect | None
    second: float
    columns: tuple[int, ...]
    base: int
    slab: float
    lower: float
    upper: float
    matters: float
    log_prior: float


@dataclass(frozen=True, kw_only=True)
class Columns:
    """Columns of the derivatives: library, library with other second values, splines, session.

    Parameters
    ----------
    base : int64 [B] columns of the numbers that belong to every explanation
    spike : float64 [B] their standard deviations where they are not named [unit of the number]
    count : number of all columns
    candidates : what may be named
    """

    base: NDArray[np.int64]
    spike: NDArray[np.float64]
    count: int
    candidates: tuple[Candidate, ...]


def can_show(effect: Effect, vehicle: Vehicle, channels: Sequence[str]) -> bool:
    """Return whether runs can show an effect that a vehicle lacks.

    An effect of several parameters that the vehicle has already cannot be found as a change of it. One that depends on
    slip needs a wheel speed: without one it is a lag of the car's force. A moment that pitches the body needs a channel
    of the body.

    Parameters
    ----------
    effect : of the library
    vehicle : the judged vehicle
    channels : that were measured
    """
    has_already = len(effect.parameters) > 1 and any(vehicle.effects.get(p.name) for p in effect.parameters)
    sees_slip = any(name.startswith("wheel_speed") for name in channels)
    sees_pitch = any(name in channels for name in ("pitch", "pitch_rate", "vertical_acceleration"))
    pitches = effect.port == "pitch_moment" or effect.parameters[0].name == "pitch_gain"
    return not has_already and (effect.variable != "slip" or sees_slip) and (not pitches or sees_pitch)


def determines_limit(effect: Effect, models: Sequence[RunModel], gain: float, rules: DecisionRules) -> bool:
    """Return whether runs tell the tyres' limit, if an effect is a number of that: one of its weather must reach it.

    Parameters
    ----------
    effect : of the library
    models : training runs
    gain : of the brakes beside the file's [1]
    rules : when a run reaches the limit of its tyres
    """
    fields = effect.parameters[0].fields
    if not any(field.startswith(FAMILY) and field.endswith("efficiency") for field in fields):
        return True
    own = [m for m in models if any(find_family_tables(field, (m.run.weather,))[0] for field in fields)]
    return any(saturates_tyres(model, rules) or reaches_limit(model, gain, rules) for model in own)


def determines_curve(effect: Effect, models: Sequence[RunModel]) -> bool:
    """Return whether runs tell the curve of the brake, if an effect is one: one stop shows a gain and a delay alone.

    Parameters
    ----------
    effect : of the library
    models : training runs
    """
    braked = sum(measure_peak_deceleration(model) > BRAKED for model in models)
    return effect.variable != "pressure" or braked >= FEWEST_STOPS


def list_columns(
    effects: tuple[Effect, ...],
    retuned: Sequence[Effect],
    session_sigma: NDArray[np.float64],
    rules: DecisionRules,
) -> Columns:
    """Return the columns of the derivatives and what may be named.

    Where a file hardly knows its brakes, `UNKNOWN` numbers are as free without a name as with one.

    Parameters
    ----------
    effects : of the library that the runs are differentiated by
    retuned : effects whose number is one of the session's
    session_sigma : float64 [8] tolerances of the session's numbers
    rules : widths of spike and slab, and the odds of a form
    """
    numbers = list(dict.fromkeys(e.parameters[0].name for e in effects))
    first = {n: next(j for j, e in enumerate(effects) if e.parameters[0].name == n) for n in numbers}
    hardly_known = session_sigma[FILE_NUMBERS.index("pressure_gain")] >= rules.hardly_known_tolerance
    unknown = UNKNOWN if hardly_known else ()
    seconds = list_second_values(effects)
    splines = len(effects) + max(len(seconds), 1)
    session = splines + KNOTS * len(KEYS)
    ways: list[tuple[Effect, float, int, int]] = []
    for j, effect in enumerate(effects):
        index = numbers.index(effect.parameters[0].name)
        if first[effect.parameters[0].name] == j:
            ways.append((effect, nan, j, index))
        ways += [(effect, value, len(effects) + i, index) for i, (at, value) in enumerate(seconds) if at == j]
    for effect in retuned:
        index = SESSION.index(effect.parameters[0].name)
        ways.append((effect, nan, session + index, len(numbers) + index))
    shares = {
        c: len({e.name for e, *_ in ways if e.effect_class == c}) for c in ("effect", "retune", "sensor")
    }
    times = {e.name: sum(other is e for other, *_ in ways) for e, *_ in ways}
    candidates = [
        Candidate(
            name=e.name, effect_class=e.effect_class, port=e.port, variable=e.variable, effect=e, second=second,
            columns=(column,), base=index, slab=rules.slab_width * e.matters, lower=e.parameters[0].lower,
            upper=e.parameters[0].upper, matters=e.matters,
            log_prior=-log(CLASSES * shares[e.effect_class] * times[e.name]),
        )
        for e, second, column, index in ways
    ]  # fmt: skip
    candidates += [
        Candidate(
            name=f"form {port}({variable})", effect_class="form", port=port, variable=variable, effect=None, second=nan,
            columns=tuple(range(splines + KNOTS * i, splines + KNOTS * (i + 1))), base=-1,
            slab=rules.form_width * FORM_MATTERS[port], lower=-FORM_BOUND * PORT_STEP[port],
            upper=FORM_BOUND * PORT_STEP[port], matters=FORM_MATTERS[port],
            log_prior=-log(CLASSES * len(KEYS)) - log(rules.form_odds),
        )
        for i, (port, variable) in enumerate(KEYS)
    ]  # fmt: skip
    small = [
        (rules.slab_width if n in unknown else rules.spike_width) * effects[first[n]].matters for n in numbers
    ]
    return Columns(
        base=np.array([*(first[n] for n in numbers), *range(session, session + len(FILE_NUMBERS))]),
        spike=np.concatenate((small, session_sigma)),
        count=session + len(FILE_NUMBERS),
        candidates=tuple(candidates),
    )
