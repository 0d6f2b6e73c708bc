"""Numbers that the file hardly knew and that were fitted with everything else: within its tolerance, or wrong."""

from collections.abc import Mapping, Sequence

import numpy as np

from tasks.campaign.campaign import SESSION, Tolerances
from tasks.identification.decision.answer import NamedEffect, Parameter, is_within_tolerance, make_estimate
from tasks.identification.inference.fit import Fit
from tasks.identification.inference.quantiles import NORMAL_QUANTILE
from tasks.identification.rules import DecisionRules
from tasks.vehicle.effects.library import Effect


def tell_calibrated(
    fitted: Fit,
    effects: Sequence[Effect],
    hardly_known: Mapping[str, tuple[float, float]],
    tolerances: Tolerances,
    rules: DecisionRules,
) -> tuple[tuple[NamedEffect, ...], list[NamedEffect]]:
    """Return the numbers of the session that are within the file's tolerances, and those that are wrong there.

    Parameters
    ----------
    fitted : of what is named, with the session
    effects : library
    hardly_known : first value and sigma by number of the session; one whose sigma is below the file's was held
    tolerances : of the campaign
    rules : they say from how many tolerances a number is wrong
    """
    declared = dict(zip(SESSION, tolerances.session, strict=True))
    limit = rules.joint.wrong_number_tolerances
    within, wrong = list[NamedEffect](), list[NamedEffect]()
    held = float(
        np.linalg.norm([declared[n] for n, (_, sigma) in hardly_known.items() if sigma <= declared[n]])
    )
    free = {name for name, (_, sigma) in hardly_known.items() if sigma > declared[name]}
    for effect in effects:
        row = effect.parameters[0]
        if effect.effect_class != "retune" or row.name not in free:
            continue
        place = SESSION.index(row.name)
        value = float(fitted.session[place])
        # what was held may be off by its own tolerance, and the gain makes up for it
        error = float(np.hypot(fitted.session_error[place], (1.0 + value) * held))
        low, high = value - NORMAL_QUANTILE * error, value + NORMAL_QUANTILE * error
        estimate = Parameter(
            name=row.name,
            value=value,
            ci_low=low,
            ci_high=high,
            lower=row.lower,
            upper=row.upper,
            unit=row.unit,
        )
        told = make_estimate(effect, estimate, error)
        (within if is_within_tolerance(told, declared, limit) else wrong).append(told)
    return tuple(within), wrong
