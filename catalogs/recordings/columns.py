"""Columns of any type as numbers: text that stands for no value or a number, and clocks of dates or times of day."""

import re
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import pandas as pd
import pyarrow as pa
from numpy.typing import NDArray

from catalogs.channel_maps import TimeEntry
from catalogs.sentences import shorten, shorten_value
from tasks.campaign.clocks import DAY, TIME_OF_DAY, convert_to_seconds, pass_midnight
from tasks.errors import InputError

NO_VALUE = {"", "-", "--", "---", "nan", "-nan", "null", "none", "n/a", "na", "#n/a", "#na", "<na>", "nil"}
"""Text that stands for no value, in small letters."""
SWITCH = {
    "off": 0.0,
    "on": 1.0,
    "false": 0.0,
    "true": 1.0,
    "no": 0.0,
    "yes": 1.0,
    "inactive": 0.0,
    "active": 1.0,
}
"""Text of a switch, in small letters, and its number."""
_TIME = r"(?:(\d+):)?(\d+):(\d+(?:[.,]\d+)?) ?([AaPp])?\.?[Mm]?\.?Z?"
"""A time of day, or minutes and seconds."""
_DATE = r"\d[-./]\d|\d{8}T|\d.*[A-Za-z]{3}|[A-Za-z]{3}.*\d"
"""Part of a date."""
_HOUR = 3600.0
DAY_NS = round(DAY) * 10**9


@dataclass(frozen=True, kw_only=True)
class Spelling:
    """How a column of text writes numbers.

    Parameters
    ----------
    meanings : text, and the number for which it stands; None for no value
    decimal, thousands : marks of numbers; ``thousands`` is empty where there is none
    """

    meanings: Mapping[str, float | None] = field(default_factory=dict)
    decimal: str = "."
    thousands: str = ""


def convert_values(column: pd.Series, spelling: Spelling) -> tuple[NDArray[np.float64], str]:
    """Return a column as numbers, NaN for no value, float64 [N]; and its first text that is none, empty without one.

    Parameters
    ----------
    column : of numbers, truth values or text
    spelling : how text is written
    """
    if pd.api.types.is_numeric_dtype(column.dtype):
        return np.array(column.to_numpy(np.float64, na_value=np.nan)), ""
    if pd.api.types.is_datetime64_any_dtype(column.dtype) or pd.api.types.is_timedelta64_dtype(column.dtype):
        return np.full(len(column), np.nan), f"it is of dates or times ({column.dtype})"
    text = _strip_text(column)
    plain = text.str.replace(spelling.thousands, "") if spelling.thousands else text
    plain = plain if spelling.decimal == "." else plain.str.replace(spelling.decimal, ".")
    values = np.array(pd.to_numeric(plain, errors="coerce"), dtype=np.float64)
    low = text.str.lower()
    known = low.isin(NO_VALUE).to_numpy()
    for word, number in spelling.meanings.items():
        same = (text == word).to_numpy()
        values[same], known = np.nan if number is None else number, known | same
    wrong = np.isnan(values) & ~known
    if not wrong.any():
        return values, ""
    numbers = values[~np.isnan(values)]
    if set(low[wrong].unique()) <= SWITCH.keys() and set(np.unique(numbers)) <= {0.0, 1.0}:
        values[wrong] = low[wrong].map(SWITCH).to_numpy(np.float64)
        return values, ""
    row = int(np.argmax(wrong))
    cell = f"row {text.index[row]} below the names"
    return values, f"{cell} has {shorten_value(text.iloc[row])}: {_advise(text[wrong], wrong, spelling)}"


def replace_numbers(values: NDArray[np.float64], meanings: Mapping[str, float | None]) -> NDArray[np.float64]:
    """Return numbers where some stand for others, or for no value, as -9999 does, float64 [N].

    Parameters
    ----------
    values : float64 [N]
    meanings : number as text, and what it stands for; None for no value
    """
    replaced = values.copy()
    for word, number in meanings.items():
        try:
            replaced[values == float(word)] = np.nan if number is None else number
        except ValueError:
            continue  # of text
    return replaced


def _strip_text(column: pd.Series) -> pd.Series:
    return column.astype(object).where(column.notna(), "").astype(str).str.strip()


def _advise(wrong: pd.Series, where: NDArray[np.bool_], spelling: Spelling) -> str:
    """Return what to do about text among numbers."""
    first, mark = str(wrong.iloc[0]), re.escape("," if spelling.decimal == "." else ".")
    grouped = wrong.str.fullmatch(rf"[+-]?[1-9]\d{{0,2}}({mark}\d{{3}})+([.,]\d+)?")
    broken = wrong.str.fullmatch(rf"[+-]?\d*{mark}\d+([eE][+-]?\d+)?")
    if grouped.all() and not broken.all():
        return f'give csv: {{thousands: "{mark[-1]}"}} in the map'
    if grouped.all():
        # 1,066 is 1066, or 1.066: other numbers of the column show which
        return (
            f'give csv: {{thousands: "{mark[-1]}"}} in the map where the mark parts thousands, and decimal:'
            f" '{mark[-1]}' where it begins a fraction"
        )
    if broken.all():
        return f"give csv: {{decimal: '{mark[-1]}'}} in the map"
    if re.search(_DATE, first) or re.fullmatch(_TIME, first):
        return "a time is read where the map names it as the clock"
    if np.count_nonzero(where) == 1 and where[0]:
        return "if this is a row of units, give csv: {units_row: true} in the map; else correct it"
    words = shorten(", ".join(f'"{word}": 1' for word in list(dict.fromkeys(wrong))[:3]), 80)
    return (
        f"correct it, or leave it empty; or say what it stands for, as values: {{{words}}} of its channel, null for"
        " none"
    )


def read_clock(
    recording: str, clock: TimeEntry, column: pd.Series, spelling: Spelling
) -> NDArray[np.float64]:
    """Return the times of a clock's column, NaN where a row holds none, float64 [N] [s].

    Dates count from midnight (UTC where they name a zone) before the first of them, exact to the nanosecond.

    Parameters
    ----------
    recording : name of the recording, for the sentence
    clock : from the channel map
    column : of numbers in the clock's unit, of dates, of durations, or of text
    spelling : how text is written

    Raises
    ------
    InputError
        If a text is no time, or dates have a unit in the map.
    """
    values, note = convert_values(column, spelling)
    if not note:
        return convert_to_seconds(values, clock.unit)
    if clock.unit not in ("s", TIME_OF_DAY):
        raise InputError(
            f"{recording}: clock {clock.source} is of dates or times, which have no unit; {note}: leave unit:"
            f" {clock.unit} away"
        )
    if pd.api.types.is_timedelta64_dtype(column.dtype):
        return pass_midnight(column.dt.total_seconds().to_numpy(np.float64))
    if pd.api.types.is_datetime64_any_dtype(column.dtype):
        return _count_from_midnight(column)
    text = _strip_text(column)
    text = text.mask(text.str.lower().isin(NO_VALUE), "")
    given = text[text != ""]
    if given.str.fullmatch(_TIME).all():
        return _read_times_of_day(text)
    try:
        if given.str.contains(_DATE).all():
            return _count_from_midnight(_parse_dates(text.mask(text == "")))
    except (ValueError, OverflowError):
        pass
    odd = given[~(given.str.contains(_DATE) | given.str.fullmatch(_TIME))]
    row = (odd if len(odd) else given).index[0]
    raise InputError(
        f"{recording}: signal {clock.source} must be of numbers, dates or times of day; row {row} below the names has"
        f" {shorten_value(text[row])}: write times as a number of seconds, 2026-08-04 13:16:03.05 or 13:16:03.05"
    )


def _parse_dates(text: pd.Series) -> pd.Series:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of the order of day and month, which a day's log does not show
        try:
            return pd.to_datetime(text, utc=True, format="ISO8601")
        except ValueError:
            return pd.to_datetime(text, utc=True)


def _count_from_midnight(dates: pd.Series) -> NDArray[np.float64]:
    """Return the time since the midnight before the first date, NaN where there is none, float64 [N] [s]."""
    index = pd.DatetimeIndex(dates).as_unit("ns")
    known = np.asarray(index.notna())
    stamps = index.asi8.copy()
    midnight = stamps[known][:1] // DAY_NS * DAY_NS
    time = np.full(len(stamps), np.nan)
    time[known] = (stamps[known] - midnight) / 1e9
    return time


def _read_times_of_day(text: pd.Series) -> NDArray[np.float64]:
    """Return the seconds of hh:mm:ss or mm:ss, which go on after midnight or the full hour, float64 [N] [s]."""
    hours, minutes, seconds, half = (part for _, part in text.str.extract(f"^{_TIME}$").items())
    time = 60.0 * pd.to_numeric(minutes) + pd.to_numeric(seconds.str.replace(",", "."))
    if not hours.notna().any():
        return pass_midnight(time.to_numpy(np.float64), _HOUR)
    clock = pd.to_numeric(hours)
    if half.notna().any():  # 12 AM is the first hour of a day
        clock = clock % 12 + 12 * half.str.lower().eq("p")
    return pass_midnight((time + _HOUR * clock).to_numpy(np.float64))


def make_series(column: pa.ChunkedArray) -> pd.Series | None:
    """Return a column of Parquet as numbers, truth values, text, dates or durations; None for other things.

    Parameters
    ----------
    column : of any type
    """
    kind = column.type
    if pa.types.is_dictionary(kind):
        return make_series(column.cast(kind.value_type))
    if pa.types.is_temporal(kind):
        zone = getattr(kind, "tz", None)
        of_day = pa.types.is_time(kind)
        if of_day:
            column = column.cast(pa.time64("ns")).cast(pa.int64())
        span = of_day or pa.types.is_duration(kind)
        return column.cast(
            pa.duration("ns") if span else pa.timestamp("ns", "UTC" if zone else None)
        ).to_pandas()
    if pa.types.is_decimal(kind):
        return column.cast(pa.float64()).to_pandas()
    text = pa.types.is_string(kind) or pa.types.is_large_string(kind) or pa.types.is_null(kind)
    plain = text or pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_boolean(kind)
    return column.to_pandas() if plain else None
