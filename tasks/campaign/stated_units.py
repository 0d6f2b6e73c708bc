"""Units that a file states, in its metadata, a row below the names or a name itself, beside those of the map."""

import re
from collections.abc import Mapping, Sequence

from tasks.campaign.channels import ALIASES, CHANNELS_BY_NAME, UNITS
from tasks.campaign.signals import ChannelRule, Signal

_BRACKETS = re.compile(r"[(\[]([^()\[\]]+)[)\]]")
_HUMP = re.compile(r"[A-Z][a-z]+$|(?<=[a-z])[A-Z]+$")
_INDEX = {"1", "-"}
"""In brackets an index or nothing, and in a row of units a number without a unit."""


def _compact(text: str) -> str:
    return re.sub(r"[\s^.*·]", "", text.strip().strip("[]()").replace("²", "2").replace("_", "/")).lower()


_KNOWN = {
    _compact(spelling): unit for spelling, unit in (*ALIASES.items(), *((unit, unit) for unit in UNITS))
}
_KNOWN.pop("kn")  # in other letters it may be knots or kilonewtons
_KNOWN |= {"": "", "-": "1"}


def parse_unit(text: str) -> str | None:
    """Return a unit of this project by its name in a file, empty for no text; None if it is not known.

    Parameters
    ----------
    text : as the file has it, such as KM/H
    """
    plain = text.strip().strip("[]()").strip()
    if plain in UNITS:
        return plain
    return ALIASES.get(plain) or _KNOWN.get(_compact(plain))


def read_unit_of_name(name: str, dimension: str = "") -> str:
    """Return the unit that the name of a signal states: Speed (km/h), speed_kmh, SpeedKmh; empty if it states none.

    Parameters
    ----------
    name : of the signal
    dimension : that a unit at the end of a name must have, for ``_s`` or ``_g`` may mean another thing; empty for any
    """
    for part in reversed(name.split("#")[0].split(".")):
        for inner in reversed(_BRACKETS.findall(part)):
            if inner.strip() not in _INDEX and (unit := parse_unit(inner)):
                return unit
        words = re.split(r"[\s_-]+", part)
        endings = ["/".join(words[-count:]) for count in (3, 2, 1) if len(words) > count]
        for ending in (*endings, *_HUMP.findall(words[-1])):
            unit = None if ending in _INDEX else parse_unit(ending)
            if unit and dimension in ("", UNITS[unit][0]):
                return unit
    return ""


def list_stated_units(name: str, signal: Signal, dimension: str = "") -> list[str]:
    """Return the known units that a signal's file and its name state, each once.

    Parameters
    ----------
    name, dimension : as of `read_unit_of_name`
    signal : as read
    """
    stated = (parse_unit(signal.unit), read_unit_of_name(name, dimension))
    return list(dict.fromkeys(unit for unit in stated if unit))


def find_unit_problems(rules: Sequence[ChannelRule], signals: Mapping[str, Signal]) -> list[str]:
    """Return a sentence for each channel whose file states another unit than the map.

    Parameters
    ----------
    rules : the channel map
    signals : of one recording by name
    """
    return [
        f"channel {rule.channel}: {_describe_stated_unit(stated, rule.unit)}"
        for rule in rules
        for stated in dict.fromkeys(
            unit
            for name in rule.sources
            for unit in list_stated_units(name, signals[name], UNITS[rule.unit][0])
        )
        if stated != rule.unit
    ]


def find_unknown_units(rules: Sequence[ChannelRule], signals: Mapping[str, Signal]) -> list[str]:
    """Return a sentence for each signal whose file states a unit that this project does not know.

    Parameters
    ----------
    rules, signals : as of `find_unit_problems`
    """
    return [
        f"signal {name} is in {signals[name].unit} by its file, a unit that is not known here: it is taken to be in"
        f" {rule.unit}, as the map says"
        for rule in rules
        for name in rule.sources
        if parse_unit(signals[name].unit) is None
    ]


def choose_unit(rule: ChannelRule, recordings: Sequence[Mapping[str, Signal]]) -> str | list[str]:
    """Return the one unit that all recordings state for a channel to which the map gives none, or what is wrong.

    Parameters
    ----------
    rule : of the channel
    recordings : signals of each by name
    """
    wanted = UNITS[CHANNELS_BY_NAME[rule.channel].unit][0]
    found = [
        (name, list_stated_units(name, signals[name])) for signals in recordings for name in rule.sources
    ]
    # of a unit in the file and another word at the end of the name, that which the channel can have
    found = [(name, [u for u in units if UNITS[u][0] == wanted] or units) for name, units in found]
    if missing := dict.fromkeys(name for name, units in found if not units):
        return [
            f"channel {rule.channel}: the map gives no unit, and the file states none for {', '.join(missing)}: give"
            " its unit in the map"
        ]
    stated = list(dict.fromkeys(unit for _, units in found for unit in units))
    if len(stated) == 1:
        return stated[0]
    return [f"channel {rule.channel}: the files state {' and '.join(stated)}: give its unit in the map"]


def _describe_stated_unit(stated: str, mapped: str) -> str:
    """Return the problem of a unit of the map that is not the file's, and what to do where the file's is wrong."""
    (dimension, size), (wanted, wanted_size) = UNITS[stated], UNITS[mapped]
    wrong = f"; where the file is wrong, keep its unit and give scale: {wanted_size / size:.6g}"
    return (
        f"is in {stated} by its file, in {mapped} by the map: give the file's unit"
        f"{wrong if dimension == wanted else ''}"
    )
