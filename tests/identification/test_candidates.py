"""What may be named in a campaign, how likely it is before any run, and how large it may be."""

from dataclasses import replace
from math import exp, isfinite

import numpy as np
import pytest

from catalogs.entries import load
from tasks.campaign.campaign import CHANNELS, FILE_NUMBERS, SESSION
from tasks.identification.decision.candidates import CLASSES, can_show, determines_limit, list_columns
from tasks.identification.inference.forward import prepare_run
from tests.identification.synthetic import SURFACE, TOLERANCES, VEHICLE, plain_run

RULES = load("set of decision rules")
EFFECTS = load("library of effects")
OWN = tuple(e for e in EFFECTS if e.parameters[0].name not in SESSION)
RETUNED = [e for e in EFFECTS if e.parameters[0].name in SESSION]
COLUMNS = list_columns(OWN, RETUNED, np.array(TOLERANCES.file_numbers), RULES)


def test_each_class_is_as_likely_as_another_and_its_effects_share_that_however_they_are_tried() -> None:
    shares = {
        kind: sum(exp(c.log_prior) for c in COLUMNS.candidates if c.effect_class == kind)
        for kind in ("effect", "retune", "sensor")
    }
    assert shares == dict.fromkeys(shares, pytest.approx(1.0 / CLASSES))
    forms = sum(exp(c.log_prior) for c in COLUMNS.candidates if c.effect is None)
    assert forms == pytest.approx(1.0 / (CLASSES * RULES.form_odds))
    # an effect that is tried with several second values is as likely as one that is tried once
    each = {e.name: sum(exp(c.log_prior) for c in COLUMNS.candidates if c.name == e.name) for e in EFFECTS}
    assert each["headwind"] == pytest.approx(each["brake_lag"])
    assert sum(c.name == "headwind" for c in COLUMNS.candidates) > 1


def test_what_is_not_named_stays_within_a_tenth_of_what_matters_or_the_tolerance_of_the_file() -> None:
    named = {c.name: c for c in COLUMNS.candidates if not isfinite(c.second)}
    lag, gain = named["brake_lag"], named["retuned_pressure_gain"]
    matters = next(e.matters for e in OWN if e.name == "brake_lag")
    assert (lag.slab, COLUMNS.spike[lag.base]) == (RULES.slab_width * matters, RULES.spike_width * matters)
    assert COLUMNS.spike[gain.base] == TOLERANCES.session[SESSION.index("pressure_gain")]
    assert COLUMNS.base[gain.base] == COLUMNS.count - len(FILE_NUMBERS) + SESSION.index("pressure_gain")
    assert all(COLUMNS.base[c.base] == c.columns[0] for c in named.values() if c.base >= 0)


def test_every_column_is_of_one_candidate_and_one_number_stands_once_in_the_base() -> None:
    used = [place for c in COLUMNS.candidates for place in c.columns]
    assert len(used) == len(set(used)) and max(used) < COLUMNS.count
    assert len(set(COLUMNS.base.tolist())) == len(COLUMNS.base) == len(COLUMNS.spike)
    drag, wind = (
        next(c for c in COLUMNS.candidates if c.name == n) for n in ("aerodynamic_drag", "headwind")
    )
    assert drag.base == wind.base, "both are a drag area, which an explanation has once"


@pytest.mark.parametrize(
    ("channels", "unseen"),
    [
        (CHANNELS, set()),
        (("speed", "wheel_speed_front", "vertical_acceleration"), set()),
        (("speed", "wheel_speed_front"), {"aerodynamic_pitch", "retuned_pitch_gain"}),
        (("speed", "pitch"), {"relaxation_length"}),
    ],
)
def test_an_effect_by_slip_needs_a_wheel_speed_and_a_pitch_moment_a_channel_of_the_body(
    channels: tuple[str, ...], unseen: set[str]
) -> None:
    """A wheel radius 3 % off was named as a pitch moment, with no channel that shows pitch."""
    found = {effect.name for effect in EFFECTS if can_show(effect, VEHICLE, channels)}
    assert found == {e.name for e in EFFECTS} - unseen


def test_an_effect_of_two_numbers_that_the_vehicle_has_is_no_change_of_it() -> None:
    windy = replace(VEHICLE, effects={"drag_area": 0.5, "wind_speed": 4.0, "lag": 0.05})
    hidden = {e.name for e in EFFECTS if not can_show(e, windy, CHANNELS)}
    assert hidden == {"headwind"}, "more lag or drag area is a change that runs can show"


@pytest.mark.parametrize(
    ("weather", "peak", "shown"), [("rain", 6.0, True), ("rain", 0.5, False), ("dry", 6.0, False)]
)
def test_the_friction_of_a_weather_is_told_by_a_run_of_it_that_reaches_the_limit(
    weather: str, peak: float, shown: bool
) -> None:
    wet, lag = (next(e for e in EFFECTS if e.name == n) for n in ("retuned_wet_friction", "brake_lag"))
    run = plain_run(25.0, peak, seconds=2.5)
    rain = {"weather": weather, "precipitation_mm_h": 8.0 if weather == "rain" else 0.0}
    model = prepare_run(replace(run, **rain), VEHICLE, SURFACE)
    assert determines_limit(wet, [model], 0.0, RULES) is shown
    assert determines_limit(lag, [model], 0.0, RULES)
