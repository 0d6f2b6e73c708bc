"""Warnings of an import: one sentence for each fault that recordings may have and that does not stop them."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from catalogs.channel_maps import ChannelMap
from tasks.campaign.brake_switch import describe_brake_switch
from tasks.campaign.held_inputs import describe_held_inputs
from tasks.campaign.resting_pressure import describe_rest, measure_resting_levels
from tasks.campaign.signals import Signal
from tasks.campaign.turning import describe_turning
from tasks.campaign.unmapped_slope import describe_slopes
from tasks.campaign.wheel_validation import describe_km_h

COMPUTED = (
    "channel longitudinal_acceleration is the rate of the speed, not an accelerometer of its own: it is left out, as"
    " under not_measured"
)
"""Warning of an accelerometer that is none."""


def list_warnings(
    channel_map: ChannelMap,
    readable: Mapping[str, Mapping[str, NDArray[np.float64]]],
    recordings: Sequence[Mapping[str, Signal]],
    *,
    computed: bool,
) -> list[str]:
    """Return what may be wrong in all runs together, or was taken another way than logged, one sentence each.

    Parameters
    ----------
    channel_map : as read
    readable : channels of each run by name, each float64 [N], in campaign units
    recordings : logged signals by name, of each recording
    computed : the logger computed the acceleration from the speed
    """
    interval = 1.0 / channel_map.sample_rate_hz
    warnings = describe_km_h(readable, interval, {rule.channel: rule.unit for rule in channel_map.rules})
    if not has_stand_in(channel_map):
        rest = describe_rest(measure_resting_levels(readable, interval))
        warnings += [] if rest is None else [rest]
    warnings += describe_turning(readable, interval)
    warnings += describe_held_inputs(recordings, channel_map.rules)
    warnings += describe_brake_switch(recordings, channel_map.rules)
    return warnings + ([COMPUTED] if computed else describe_slopes(readable, interval))


def has_stand_in(channel_map: ChannelMap) -> bool:
    """Return whether another quantity is mapped to the brake pressure, whose scale nobody knows.

    Parameters
    ----------
    channel_map : as read
    """
    entry = channel_map.channels.get("brake_pressure")
    return entry is not None and entry.gain is not None
