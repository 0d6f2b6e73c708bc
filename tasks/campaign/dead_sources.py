"""A dead sensor in a list of sources, of which a channel is the mean: it would pull the channel towards its value."""

from collections.abc import Sequence

import numpy as np

from tasks.campaign.channels import CHANNELS_BY_NAME, UNITS
from tasks.campaign.signals import ChannelRule, Signal

DEAD = 0.01
"""Share of another source's range within which a dead one stays [1]."""
MOVED = 0.04
"""Share of the channel's limit by which another source moves at least: 1 MPa of a brake pressure [1]."""


def find_dead_sources(rule: ChannelRule, signals: Sequence[Signal]) -> list[str]:
    """Return a sentence for each source of a list that holds one value while another one moves.

    Torques are left out, for an axle may drive or brake alone; so are channels that never rest in a moving car, of
    which each source is checked by itself.

    Parameters
    ----------
    rule : of the channel
    signals : of its sources, in the channel's unit, within the run's window
    """
    channel = CHANNELS_BY_NAME[rule.channel]
    if len(signals) < 2 or channel.moves or UNITS[rule.unit][0] == "torque":
        return []
    finite = [signal.values[np.isfinite(signal.values)] for signal in signals]
    ranges = [float(np.ptp(values)) if values.size else np.inf for values in finite]
    moved = [spread if np.isfinite(spread) else 0.0 for spread in ranges]
    most = int(np.argmax(moved))
    if moved[most] < MOVED * channel.limit:
        return []
    return [
        f"its signal {name} is dead: it stays at {float(np.median(values)):.4g} {channel.unit} while"
        f" {rule.sources[most]} moves by {moved[most]:.3g}, and the mean of the list is wrong: take {name} out of"
        " source, or leave the run out"
        for name, values, spread in zip(rule.sources, finite, ranges, strict=True)
        if spread <= DEAD * moved[most]
    ]
