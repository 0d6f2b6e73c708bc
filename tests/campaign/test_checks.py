"""The table of checks: each row has its function, its numbers and a sentence; the loop tells the worst, once."""

import re
from inspect import Parameter, signature
from string import Formatter

import pytest

from catalogs.campaign_checks import MEASURES, CheckTableEntry
from catalogs.entries import find_entry
from catalogs.quantities import read_entry
from tasks.campaign.channels import CHANNELS_BY_NAME
from tasks.campaign.checks import Check, Figure, apply_checks
from tasks.campaign.measured import BRAKES, Clock

ENTRY = read_entry(CheckTableEntry, find_entry("table of checks"), "table of checks")
ROWS = {name: row for rows in ENTRY.groups.values() for name, row in rows.items()}


def test_every_channel_has_a_span_and_every_function_a_row_with_the_numbers_that_it_needs() -> None:
    assert list(ENTRY.spans) == list(CHANNELS_BY_NAME) and ROWS.keys() == MEASURES.keys()
    assert len(ROWS) == sum(len(rows) for rows in ENTRY.groups.values())
    for name, row in ROWS.items():
        needed = signature(MEASURES[name]).parameters.values()
        named = {one.name for one in needed if one.kind is Parameter.KEYWORD_ONLY}
        open_ended = any(one.kind is Parameter.VAR_KEYWORD for one in needed)
        assert named <= row.conditions.keys() if open_ended else named == row.conditions.keys(), name


@pytest.mark.parametrize("name", ROWS)
def test_a_row_has_a_limit_channels_that_there_are_and_rows_before_it_that_silence_it(name: str) -> None:
    row, names = ROWS[name], list(ROWS)
    assert row.lowest is not None or row.highest is not None
    needed = {channel for one in row.channels for channel in ((one,) if isinstance(one, str) else one)}
    assert needed <= {"time", *CHANNELS_BY_NAME, *BRAKES}
    assert all(names.index(other) < names.index(name) for other in row.unless)
    assert all(re.match(r"\w+$", field) for _, field, _, _ in Formatter().parse(row.sentence) if field)


def check_numbers(*figures: Figure, unless: tuple[str, ...] = (), name: str = "one") -> Check:
    return Check(
        name=name, fault="run", channels=(), measure=lambda view: figures, conditions={}, lowest=-1.0, highest=2.0,
        sentence="{channel} is {value:g} in {places}, beyond {lowest:g} to {highest:g}{more}", unless=unless,
    )  # fmt: skip


def figure(value: float, channel: str, place: str, more: str = "") -> Figure:
    return Figure(value=value, channel=channel, places=(place,), words={"more": more})


def test_of_figures_beyond_a_limit_the_worst_is_told_with_the_places_of_all() -> None:
    view = Clock(time=None)  # type: ignore[arg-type]
    figures = [
        figure(3.0, "a", "r1"),
        figure(2.0, "a", "r2"),
        figure(-9.0, "a", "r3", "!"),
        figure(5.0, "b", "r4"),
    ]
    told = apply_checks([check_numbers(*figures)], view)
    assert [one.sentence for one in told] == [
        "a is -9 in r1, r3, beyond -1 to 2!", "b is 5 in r4, beyond -1 to 2",
    ]  # fmt: skip


def test_a_check_that_another_one_tells_better_is_silent_on_its_channel() -> None:
    better, worse = check_numbers(figure(3.0, "a", "r")), [figure(4.0, "a", "r"), figure(4.0, "b", "r")]
    told = apply_checks([better, check_numbers(*worse, name="two", unless=("one",))], Clock(time=None))  # type: ignore[arg-type]
    assert [(one.check.name, one.channel) for one in told] == [("one", "a"), ("two", "b")]
