"""A brake switch that a map takes for a command: it says when the driver brakes, and not how hard."""

from collections.abc import Mapping, Sequence

import numpy as np

from tasks.campaign.segments import find_brake_rule
from tasks.campaign.signals import ChannelRule, Signal


def describe_brake_switch(
    recordings: Sequence[Mapping[str, Signal]], rules: Sequence[ChannelRule]
) -> list[str]:
    """Return a sentence if the best brake signal of a map has two values alone, off and on; else none.

    Parameters
    ----------
    recordings : logged signals by name, of each recording
    rules : the channel map
    """
    brake = find_brake_rule(rules)
    if brake is None:
        return []
    logged = [recording[name].values for recording in recordings for name in brake.sources]
    values = np.unique(np.concatenate(logged))
    values = values[np.isfinite(values)]
    if len(values) != 2:
        return []
    return [
        f"channel {brake.channel} has the values {values[0]:g} and {values[1]:g} alone, as a brake switch has: it says"
        " when the driver brakes and not how hard, so that all stops are taken for equally hard; map a pressure, a"
        " pedal or a torque"
    ]
