"""Stops that no fit has seen and that the model misses by more than their noise, whatever is named."""

from collections.abc import Mapping
from dataclasses import replace
from math import inf

from tasks.campaign.campaign import CHANNELS, Campaign
from tasks.errors import InputError
from tasks.identification.decision.answer import ChannelError, Verdict
from tasks.identification.inference.noise import estimate_channel_noise


def compare_with_noise(campaign: Campaign, error: Mapping[str, ChannelError], follows: float = inf) -> float:
    """Return the error of the speed on held-out runs over its sensor's noise; 0 where runs are too short for it [1].

    Parameters
    ----------
    campaign : measured runs
    error : by channel, on held-out runs
    follows : most that the noise can be, because a fit follows other runs so closely [m/s]
    """
    try:
        noise = float(estimate_channel_noise(campaign)[1][CHANNELS.index("speed")])
    except InputError:
        return 0.0
    return error["speed"].after / min(noise, follows)


def tell_miss(verdict: Verdict, campaign: Campaign, limit: float, follows: float = inf) -> Verdict:
    """Return a verdict that says by how much the speed of held-out runs is missed, where that is more than noise.

    Parameters
    ----------
    verdict : the answer
    campaign : measured runs
    limit : error over noise from which a run is missed [1]
    follows : size of the speed's residuals on the training runs, which noise cannot exceed [m/s]
    """
    ratio = compare_with_noise(campaign, verdict.error, follows)
    # a disagreement says that nothing could be named, and not that what is named is not all
    if ratio <= limit or (verdict.disagreement and not verdict.effects):
        return verdict
    missed = (
        f"the speed of the held-out runs is missed by {verdict.error['speed'].after:.3g} m/s, {ratio:.3g} times its"
        f" noise (at most {limit:g})"
    )
    if not verdict.effects:
        return replace(verdict, misses=True, disagreement=missed, reasons=(missed, *verdict.reasons))
    return replace(
        verdict,
        misses=True,
        reasons=(*verdict.reasons, f"{missed}: what is named is not all that the model lacks"),
    )
