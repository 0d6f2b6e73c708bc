"""The figure of recovered motion: which conditions it shows, and what it subtracts."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from studies.evaluation.dataset_motion import list_motion_panels
from studies.evaluation.judged_clip import JudgedClip
from studies.evaluation.motion_curves import PITCH, PROGRESS, MotionPanel, draw_motion
from studies.evaluation.motion_rows import motion_of_telemetry
from studies.evaluation.standards import MeantMotion, Standard

TIMES = np.arange(81) / 10
FLAT = {"hazard_center_m": 0.0, "hazard_length_m": 0.0, "hazard_height_m": 0.0}
HUMP = {"hazard_center_m": 30.0, "hazard_length_m": 2.0, "hazard_height_m": 0.08}


def way_of(deceleration: float) -> np.ndarray:
    stop = 16.0 / deceleration
    t = np.minimum(TIMES, stop)
    return 16.0 * t - deceleration * t**2 / 2


def make_clip(
    label: str,
    deceleration: float,
    seen: float,
    road: dict[str, float] = FLAT,
    *,
    lost: bool = False,
    **weather: Any,
) -> JudgedClip:
    """A clip whose car brakes at one rate and whose picture shows another, over a pitch of 1 deg at 2.5 to 3.5 s."""
    facts = {"clip_id": label, "label": label, "weather": "dry", "precipitation_mm_h": 0.0} | weather | road
    pitch = 0.02 * TIMES + np.deg2rad(np.where((TIMES > 2.5) & (TIMES < 3.5), 1.0, 0.0)) * (road is HUMP)
    way = way_of(seen)
    motion = replace(
        motion_of_telemetry(1.5 * pitch, way), method="pnp",
        failed=np.arange(81) < (3 if lost else 0), failures=("lost",) * 3 * lost,
    )  # fmt: skip
    frames = {"pitch": pitch, "station": way_of(deceleration), "t_ns": TIMES * 1e9}
    return JudgedClip(
        facts=facts,
        frames=frames,
        motions={"pnp": motion},
        statistics={},
        thumbnails=np.zeros((0, 1, 1, 3), np.uint8),
        quality={},
    )


def list_panels(clips: list[JudgedClip], known: int = 81) -> dict[str, MotionPanel]:
    def cut(values: np.ndarray) -> np.ndarray:
        return np.where(np.arange(81) < known, values, np.nan)

    motions = {
        clip.facts["label"]: MeantMotion(
            pitch=cut(clip.frames["pitch"]), station=cut(clip.frames["station"]), name="case"
        )
        for clip in clips
    }
    panels = list_motion_panels(clips, Standard(suffix="", motions=motions, absent={}), "paper")
    return {panel.title: panel for panel in panels}


SNOW = {"weather": "snow", "snow_accumulation_h": 1.0}
STREET = [
    *(make_clip(f"dry/seed-{seed}", 7.0, 7.0) for seed in (1, 2)),
    *(make_clip(f"snow-1/seed-{seed}", 5.0, 5.0, precipitation_mm_h=1.0, **SNOW) for seed in (1, 2)),
    make_clip("snow-3/seed-1", 3.0, 3.2, precipitation_mm_h=3.0, **SNOW),
    make_clip("snow-3/seed-2", 3.0, 2.8, precipitation_mm_h=3.0, **SNOW),
    make_clip("dry/hump/seed-1", 3.0, 3.0, HUMP),
]  # fmt: skip


def share_of(deceleration: float) -> np.ndarray:
    return way_of(deceleration) / way_of(deceleration)[-1]


def test_the_heaviest_of_a_kind_is_shown_less_its_dry_twin_a_row_a_seed():
    panel = list_panels(STREET)["snow-3, less dry"]
    assert panel.quantity == PROGRESS and panel.shaded is None
    np.testing.assert_allclose(panel.meant, share_of(3.0) - share_of(7.0), atol=1e-12)
    wanted = [share_of(seen) - share_of(7.0) for seen in (3.2, 2.8)]
    np.testing.assert_allclose(panel.recovered["pnp"], wanted, atol=1e-12)


def test_a_road_feature_is_shown_less_the_line_through_the_flanks_in_degrees():
    panel = list_panels(STREET)["dry/hump"]
    assert panel.quantity == PITCH and panel.shaded == pytest.approx((2.2, 3.8))
    assert panel.times[[0, -1]] == pytest.approx([1.7, 4.3]), "from the first flank to the end of the second"
    inside = (panel.times > 2.5) & (panel.times < 3.5)
    np.testing.assert_allclose(panel.meant, 1.0 * inside, atol=1e-9)
    np.testing.assert_allclose(panel.recovered["pnp"], [1.5 * inside], atol=1e-9)


def test_a_motion_known_in_part_gives_no_panel_where_it_is_needed():
    assert list(list_panels(STREET, known=70)) == ["dry/hump"], (
        "progress is over the whole way, the event is not"
    )
    assert not list_panels(STREET, known=30)


def test_a_clip_with_a_lost_frame_has_no_curve():
    lost = make_clip("snow-3/seed-2", 3.0, 3.0, lost=True, precipitation_mm_h=3.0, **SNOW)
    panel = list_panels([clip if clip.facts["label"] != "snow-3/seed-2" else lost for clip in STREET])[
        "snow-3, less dry"
    ]
    assert panel.recovered["pnp"].shape == (1, 81)


def test_one_seed_has_no_band_and_two_have_one():
    panels = list_panels(STREET)
    figure = draw_motion(list(panels.values()), "telemetry")
    bands = {panel.title: sum(line.low is not None for line in panel.lines) for panel in figure.panels}
    assert bands == {"snow-3, less dry": 1, "dry/hump": 0}
    assert [line.name for line in figure.key] == ["telemetry", "pnp"]
