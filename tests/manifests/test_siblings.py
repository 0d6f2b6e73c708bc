"""Which clips are siblings, and what the one control in which they differ changes."""

from itertools import product
from math import isnan

import pytest

from catalogs.scenario import OPTIONAL_FIELDS, SCENARIO_FIELDS, Scenario
from manifests.siblings import ALL_PAIRS_UP_TO, CONTROLS, iterate_pairs
from tasks.conventions import PAIR_CHANNELS


def clip(name: str, figures: dict | None = None, **scenario) -> dict:
    known = {"surface_friction": 0.8, "tyre_peak": 0.75, "stopping_distance": 20.0, "peak_pitch": 0.03}
    row = Scenario(**scenario).as_row()
    return {"clip_id": name, "label": name, "scenario": row, "figures": known | (figures or {})}


RAIN = {"weather": "rain", "precipitation_mm_h": 50.0}


def test_every_field_of_a_scenario_belongs_to_exactly_one_control():
    held = sorted(name for names in CONTROLS.values() for name in names)
    assert held == sorted((*SCENARIO_FIELDS, *OPTIONAL_FIELDS, "objects"))


def test_a_pair_differs_in_one_control_and_carries_b_minus_a():
    dry = clip("dry", initial_speed_km_h=60)
    wet = clip("wet", {"surface_friction": 0.5, "stopping_distance": 33.5}, initial_speed_km_h=60, **RAIN)
    (pair,) = iterate_pairs([dry, wet])
    assert pair.keys() == {channel.name for channel in PAIR_CHANNELS}
    assert (pair["clip_id_a"], pair["clip_id_b"], pair["control"]) == ("dry", "wet", "weather")
    assert pair["differs"] == "weather, precipitation_mm_h"
    assert pair["surface_friction_change"] == pytest.approx(-0.3)
    assert pair["stopping_distance_change"] == pytest.approx(13.5)
    assert pair["peak_pitch_change"] == 0


def test_clips_that_differ_in_two_controls_are_no_pair():
    assert not list(
        iterate_pairs([clip("a", initial_speed_km_h=40), clip("b", initial_speed_km_h=60, **RAIN)])
    )


def test_a_change_of_what_one_sibling_lacks_is_not_represented():
    (pair,) = iterate_pairs([clip("a"), clip("b", {"stopping_distance": None}, **RAIN)])
    assert isnan(pair["stopping_distance_change"])


def test_a_product_of_axes_has_a_pair_for_every_two_levels_of_every_axis():
    """Against counting by definition: all pairs of clips, controls compared one by one."""
    clips = [
        clip(f"{w}{s}{h}", initial_speed_km_h=s, hazard_height_m=h, hazard_length_m=2.0, **w)
        for w, s, h in product(({}, RAIN), (40.0, 50.0, 60.0), (0.0, 0.05))
    ]

    def controls_apart(a, b):
        return sum(
            any(a["scenario"].get(n) != b["scenario"].get(n) for n in names) for names in CONTROLS.values()
        )

    expected = [
        (a["clip_id"], b["clip_id"])
        for i, a in enumerate(clips)
        for b in clips[i + 1 :]
        if controls_apart(a, b) == 1
    ]
    assert [(p["clip_id_a"], p["clip_id_b"]) for p in iterate_pairs(clips)] == expected


def test_a_long_sweep_has_about_as_many_pairs_as_clips():
    count = 40 * ALL_PAIRS_UP_TO
    clips = [clip(f"{i:05d}", initial_speed_km_h=20 + 0.01 * i) for i in range(count)]
    assert len(list(iterate_pairs(clips))) == 2 * (count - 1) - 1


def test_clips_that_differ_in_nothing_but_what_is_seen_make_no_pair():
    assert not list(iterate_pairs([clip("a"), clip("b")]))
