"""The conditions of a dataset whose recovered motion is drawn: the heaviest rain and snow, a hump and a depression."""

from collections.abc import Callable, Iterable, Sequence

import numpy as np

from studies.evaluation.judged_clip import JudgedClip
from studies.evaluation.metrics.video_motion import (
    MotionProtocol,
    compare_progress,
    isolate_event,
    reference_progress,
)
from studies.evaluation.motion_curves import PROGRESS, Floats, MotionPanel, make_event_panel
from studies.evaluation.motion_rows import EventWindow, find_opening
from studies.evaluation.rows import find_control, read_visual_seed
from studies.evaluation.standards import MeantMotion, Standard, require_whole_way
from tasks.errors import InputError
from tasks.eval.poses.motion import RecoveredMotion
from tasks.surface.weather import DRY, WEATHERS

Family = list[JudgedClip]
"""Clips of one condition, which differ by their visual seed alone."""


def list_motion_panels(
    clips: Sequence[JudgedClip], standard: Standard, event_window: EventWindow = "contact"
) -> list[MotionPanel]:
    """Return a panel for each kind of weather and each kind of road feature that the standard can judge.

    Of each kind of weather it shows the heaviest, on a flat road where there is one; of each kind of feature the first.

    Parameters
    ----------
    clips : as their judges saw them
    standard : what their motion is compared with
    event_window : of E_geometry
    """
    families = _group_seeds([clip for clip in clips if clip.facts["clip_id"] in standard.motions])
    panels = []
    for kind in (kind for kind in WEATHERS if kind != DRY):
        found = [family for family in families if family[0].facts["weather"] == kind]
        found.sort(
            key=lambda family: (
                family[0].facts["hazard_height_m"] != 0,
                -family[0].facts["precipitation_mm_h"],
            )
        )
        panels += _draw_first(found, lambda family: _show_weather(family, list(clips), standard))
    for sign in (1, -1):
        found = [family for family in families if sign * family[0].facts["hazard_height_m"] > 0]
        panels += _draw_first(found, lambda family: _show_event(family, standard, event_window))
    return panels


def _group_seeds(clips: Iterable[JudgedClip]) -> list[Family]:
    families: dict[str, Family] = {}
    for clip in clips:
        families.setdefault(_name_condition(clip), []).append(clip)
    return list(families.values())


def _draw_first(families: Sequence[Family], draw: Callable[[Family], MotionPanel]) -> list[MotionPanel]:
    """Return the panel of the first family of which one can be made."""
    for family in families:
        try:
            return [draw(family)]
        except InputError:
            continue
    return []


def _show_weather(family: Family, clips: list[JudgedClip], standard: Standard) -> MotionPanel:
    pairs = [
        (clip, control) for clip in family if (control := find_control(clip, clips, weather=True)) is not None
    ]
    if not pairs:
        raise InputError("no dry clip of the same drive")
    stations = []
    for clip in pairs[0]:
        meant = _find_meant(clip, standard)
        require_whole_way(meant)
        stations.append(reference_progress(meant.station))
    recovered = {}
    for method in pairs[0][0].motions:
        found = [[clip.motions[method] for clip in pair if _is_whole(clip, method)] for pair in pairs]
        changes = [
            compare_progress(both[0].normalised_path[:, 0], both[1].normalised_path[:, 0], None)
            for both in found
            if len(both) == 2
        ]
        if changes:
            recovered[method] = np.array(changes)
    return MotionPanel(
        title=f"{_name_condition(family[0])}, less dry",
        quantity=PROGRESS,
        times=pairs[0][0].times,
        meant=stations[0] - stations[1],
        recovered=recovered,
    )


def _show_event(family: Family, standard: Standard, event_window: EventWindow) -> MotionPanel:
    clip, chosen = family[0], MotionProtocol()
    meant = _find_meant(clip, standard)
    opening = find_opening(clip, meant, event_window)

    def isolate(pitch: Floats) -> Floats:
        return np.rad2deg(isolate_event(clip.times, pitch, opening, chosen)[0])

    recovered = {}
    for method in clip.motions:
        found = [isolate(one.motions[method].pitch) for one in family if _is_whole(one, method)]
        if found:
            recovered[method] = np.array(found)
    return make_event_panel(_name_condition(family[0]), clip.times, isolate(meant.pitch), recovered, opening)


def _is_whole(clip: JudgedClip, method: str) -> bool:
    motion: RecoveredMotion | None = clip.motions.get(method)
    return motion is not None and not motion.failed.any() and bool(np.isfinite(motion.normalised_path).all())


def _find_meant(clip: JudgedClip, standard: Standard) -> MeantMotion:
    if (meant := standard.motions.get(clip.facts["clip_id"])) is None:
        raise InputError(f"{clip.facts['label']}: the standard has no motion")
    return meant


def _name_condition(clip: JudgedClip) -> str:
    """Return a clip's label without its visual seed."""
    label: str = clip.facts["label"]
    return label.removesuffix(f"seed-{read_visual_seed(label)}").rstrip("/")
