"""The verdict and its parts: named effects with their parameters, and errors by channel."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from tasks.identification.decision.correlation import Correlation
from tasks.identification.decision.experiment import Experiment
from tasks.identification.inference.disturbance import Disturbance
from tasks.vehicle.effects.library import Effect
from tasks.vehicle.effects.slots import Slot

VerdictName = Literal["FOUND", "SET", "UNKNOWN_FORM", "RETUNE", "SENSOR", "NOTHING"]


@dataclass(frozen=True, kw_only=True)
class Parameter:
    """An estimated parameter with its 95 % interval and bounds [unit]."""

    name: str
    value: float
    ci_low: float
    ci_high: float
    lower: float
    upper: float
    unit: str


@dataclass(frozen=True, kw_only=True)
class NamedEffect:
    """An effect that the verdict names, or a rival of one.

    Parameters
    ----------
    name, effect_class, port, variable : as in the library, or of the form found
    parameters : estimates
    score : logarithm of the odds of the explanation that it belongs to, against the same without it [1]
    gain : rise of the log likelihood by it [1]
    spread : standard deviation from run to run, over its size [1]
    """

    name: str
    effect_class: str
    port: str
    variable: str
    parameters: tuple[Parameter, ...]
    score: float
    gain: float
    spread: float = 0.0


@dataclass(frozen=True, kw_only=True)
class OpenOdds:
    """An explanation that the runs leave open.

    Parameters
    ----------
    names : what it names
    odds : against the first explanation [1]
    """

    names: tuple[str, ...]
    odds: float


@dataclass(frozen=True, kw_only=True)
class ChannelError:
    """RMSE of one channel or figure over the held-out runs: for the model as delivered, re-tuned, and with the effects.

    Parameters
    ----------
    frozen, retuned, after : RMSE [unit]
    ci_low, ci_high : 95 % bootstrap interval over runs of ``after`` [unit]
    change_low, change_high : 95 % bootstrap interval of after minus frozen, paired by run [unit]
    wins : held-out runs in which ``after`` is below ``frozen``
    worst_run : name of the run with the largest ``after``
    unit : unit of the errors
    """

    frozen: float
    retuned: float
    after: float
    ci_low: float
    ci_high: float
    change_low: float
    change_high: float
    wins: int
    worst_run: str
    unit: str


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """Conclusion about a campaign.

    Parameters
    ----------
    verdict : kind of verdict
    effects : named effects, those that gain most first
    rivals : effects of the other open explanations, each after the name of the effect that it stands in for
    odds : every open explanation with its odds
    tried : best candidates that are not named
    error : errors by channel, on held-out runs
    manoeuvre_error : errors of stopping distance [m] and peak pitch [deg], on held-out runs that brake
    correlation : correlation of each channel's residual with brake pressure, on held-out runs
    session_pulls : session nuisances in prior sigmas, before and after [1]
    noise : AR(1) coefficient and sigma by channel
    disturbance : scales and times of the smooth disturbances
    detectable : smallest first parameter of each library effect that would be named [its unit]
    campaign, content_hash, split_hash : name and hashes of the campaign
    theta : float64 full parameter vector of the effects, without session nuisances
    slots : tables of the forms found
    experiment : planned run that separates the first explanation best from its closest rival
    step_sensitive : names of runs left out because halving the integration step changes their prediction
    reasons : sentences that explain the verdict
    disagreement : why nothing that can be named explains the runs; else empty
    misses : the speed of held-out runs is missed by more than its noise
    """

    verdict: VerdictName
    effects: tuple[NamedEffect, ...]
    rivals: tuple[tuple[str, NamedEffect], ...]
    odds: tuple[OpenOdds, ...]
    tried: tuple[NamedEffect, ...]
    error: dict[str, ChannelError]
    manoeuvre_error: dict[str, ChannelError]
    correlation: dict[str, Correlation]
    session_pulls: dict[str, tuple[float, float]]
    noise: dict[str, tuple[float, float]]
    disturbance: Disturbance
    detectable: dict[str, float]
    campaign: str
    content_hash: str
    split_hash: str
    theta: NDArray[np.float64]
    slots: tuple[Slot, ...]
    experiment: Experiment | None
    step_sensitive: tuple[str, ...]
    reasons: tuple[str, ...]
    disagreement: str = ""
    misses: bool = False


def find_kind(named: Sequence[NamedEffect], rivals: Sequence[tuple[str, NamedEffect]]) -> VerdictName:
    """Return the kind of a verdict.

    Parameters
    ----------
    named : effects that are named
    rivals : what the runs cannot tell from them, each with the name that it stands in for
    """
    if not named:
        return "NOTHING"
    if rivals:
        return "SET"
    classes = {effect.effect_class for effect in named}
    if "form" in classes:
        return "UNKNOWN_FORM"
    return "FOUND" if "effect" in classes else "RETUNE" if "retune" in classes else "SENSOR"


def make_estimate(effect: Effect, parameter: Parameter, error: float) -> NamedEffect:
    """Return a number that was fitted beside others in the form in which the verdict reports an effect.

    Parameters
    ----------
    effect : of the library, whose first number it is
    parameter : its estimate
    error : its standard error [its unit]
    """
    half_square = 0.5 * (parameter.value / error) ** 2
    return NamedEffect(
        name=effect.name, effect_class=effect.effect_class, port=effect.port, variable=effect.variable,
        parameters=(parameter,), score=half_square, gain=half_square,
    )  # fmt: skip
