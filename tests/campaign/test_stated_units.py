"""Units in files, rows and names are read in their many spellings, and no other word is taken for one."""

import numpy as np
import pytest

from tasks.campaign.signals import ChannelRule, Signal
from tasks.campaign.stated_units import choose_unit, find_unit_problems, parse_unit, read_unit_of_name


@pytest.mark.parametrize(
    ("text", "unit"),
    [("KM/H", "km/h"), ("[mph]", "mph"), ("m/s²", "m/s^2"), ("G", "g"), ("kN", "kN"), ("kn", "kn"), ("KN", None),
     ("Unit_Bar", "bar"), ("mpa", "MPa"), ("furlong", None), ("", "")],
)  # fmt: skip
def test_spellings_of_a_unit(text: str, unit: str | None) -> None:
    assert parse_unit(text) == unit


@pytest.mark.parametrize(
    ("name", "unit"),
    [("Speed (km/h)", "km/h"), ("speed_kmh", "km/h"), ("Speed [mph]", "mph"), ("SpeedKPH", "km/h"), ("v_m_s", "m/s"),
     ("initial_speed_km_h", "km/h"), ("Speed (OBD)(km/h)", "km/h"), ("VehSpd_kmh#2", "km/h"), ("speed", ""),
     ("v(:,2)", ""), ("/car.v[1]", ""), ("wheel_s", ""), ("speed_g", "")],
)  # fmt: skip
def test_a_name_states_a_unit_of_speed_or_none(name: str, unit: str) -> None:
    assert read_unit_of_name(name, "speed") == unit


def rule(source: str, unit: str) -> ChannelRule:
    return ChannelRule(channel="speed", sources=(source,), unit=unit)


def signal(unit: str = "") -> Signal:
    return Signal(time=np.arange(3.0), values=np.arange(3.0), unit=unit)


def test_a_unit_of_the_name_or_the_file_must_be_the_maps() -> None:
    assert find_unit_problems([rule("v_kmh", "km/h")], {"v_kmh": signal()}) == []
    (told,) = find_unit_problems([rule("Speed (km/h)", "mph")], {"Speed (km/h)": signal()})
    assert "channel speed: is in km/h by its file, in mph by the map" in told
    assert len(find_unit_problems([rule("v_kmh", "m/s")], {"v_kmh": signal("mph")})) == 2


def test_without_a_unit_in_the_map_the_stated_one_is_taken_or_asked_for() -> None:
    assert choose_unit(rule("v_kmh", ""), [{"v_kmh": signal()}, {"v_kmh": signal("KM/H")}]) == "km/h"
    assert "states none for v: give its unit" in choose_unit(rule("v", ""), [{"v": signal()}])[0]
    assert "state km/h and mph" in choose_unit(rule("v", ""), [{"v": signal("kmh")}, {"v": signal("mph")}])[0]
