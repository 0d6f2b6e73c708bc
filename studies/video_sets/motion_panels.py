"""The conditions of a set of edited videos whose recovered motion is drawn, a curve a model and pose method."""

from collections.abc import Callable

import numpy as np

from studies.evaluation.metrics.video_motion import (
    MotionProtocol,
    compare_progress,
    isolate_event,
    reference_progress,
    smooth_signal,
)
from studies.evaluation.motion_curves import PITCH, PROGRESS, Floats, MotionPanel, make_event_panel
from studies.video_sets.compared_motion import pair_with_control, sample_claimed_pitch
from studies.video_sets.motion import JudgedSet, SetMotion
from tasks.errors import InputError

Curves = tuple[Floats, Floats, Floats]
"""Times [s], what the claim means, and what was recovered."""


def list_set_panels(judged: JudgedSet, window: int | None) -> list[MotionPanel]:
    """Return a panel for the heaviest of each kind of weather and for each road feature that a model made.

    Parameters
    ----------
    judged : set
    window : of the smoothing [frames]
    """
    protocol = judged.protocol
    levels = protocol.weather_levels
    kinds = dict.fromkeys(level.weather for level in levels.values())
    heaviest = [
        max(
            (name for name in levels if levels[name].weather == kind),
            key=lambda one: levels[one].precipitation_mm_h,
        )
        for kind in kinds
    ]

    def compare_weather(seen: SetMotion) -> Curves:
        pair = pair_with_control(judged, seen)
        meant = reference_progress(pair.station) - reference_progress(pair.dry_station)
        return pair.grid, meant, compare_progress(pair.way, pair.dry_way, window)

    def compare_event(seen: SetMotion) -> Curves:
        chosen, opening = MotionProtocol(), float(protocol.event_opening.value)
        pitches = sample_claimed_pitch(judged, seen), smooth_signal(seen.motion.pitch, window)
        meant, found = (np.rad2deg(isolate_event(seen.times, p, opening, chosen)[0]) for p in pitches)
        return seen.times, meant, found

    wanted: list[tuple[str, str, Callable[[SetMotion], Curves]]] = [
        *((f"weather/{name}", PROGRESS, compare_weather) for name in heaviest),
        *((f"geometry/{name}", PITCH, compare_event) for name in protocol.geometry_features),
    ]
    panels = (_show_clip(judged, *one) for one in wanted)
    return [panel for panel in panels if panel is not None]


def _show_clip(
    judged: JudgedSet, clip: str, quantity: str, compare: Callable[[SetMotion], Curves]
) -> MotionPanel | None:
    """Return the panel of a clip of the protocol, seeds on the times of the first; None if no model has it."""
    base: tuple[Floats, Floats] | None = None
    found: dict[str, list[Floats]] = {}
    for seen in judged.motions.values():
        if seen.clip.clip != clip or seen.clip.model not in judged.files.models:
            continue
        try:
            times, meant, recovered = compare(seen)
        except InputError:
            continue
        base = base or (times, meant)
        curve = np.interp(base[0], times, recovered)
        found.setdefault(f"{seen.clip.model}, {seen.clip.method}", []).append(curve)
    if base is None:
        return None
    shown = {name: np.array(curves) for name, curves in found.items()}
    if quantity == PITCH:
        return make_event_panel(clip, *base, shown, float(judged.protocol.event_opening.value))
    return MotionPanel(title=clip, quantity=quantity, times=base[0], meant=base[1], recovered=shown)
