"""Names that users give to runs, grids and levels: they become file names, labels and text."""

from typing import Annotated

from pydantic import AfterValidator, Field, WithJsonSchema

from catalogs.sentences import is_encodable, shorten_value
from tasks.render.weather.named_sky import SKY_NAMES
from tasks.surface.weather import WEATHERS, find_weather_problem

LONGEST_NAME = 100
"""Characters of a name [1]: a label of several names still fits a file name of 255 bytes."""


def find_name_problem(name: str) -> str | None:
    """Why the text cannot be a name, as the rest of a sentence after "must"; None where it can.

    Parameters
    ----------
    name : to become one file name, on any system
    """
    if not 0 < len(name) <= LONGEST_NAME:
        return f"have 1 to {LONGEST_NAME} characters; it has {len(name)}"
    if not name.isprintable() or not is_encodable(name) or name != name.strip():
        return f"be printable characters without blanks at its ends; it is {shorten_value(name)}"
    if name.startswith("-"):
        return f"begin with another character than -, which commands take for an option; it is {shorten_value(name)}"
    if "/" in name or "\\" in name or name in (".", ".."):
        return f"be no path; it is {shorten_value(name)}"
    return None


def find_label_problem(label: str) -> str | None:
    """As `find_name_problem`, for a label: names joined by slashes.

    Parameters
    ----------
    label : such as of a level of an axis
    """
    problems = map(find_name_problem, label.split("/"))
    return next((problem for problem in problems if problem), None)


def _check_name(name: str) -> str:
    if problem := find_name_problem(name):
        raise ValueError(f"a name must {problem}")
    return name


def _check_label(label: str) -> str:
    if problem := find_label_problem(label):
        raise ValueError(f"a label must {problem}")
    return label


def _check_weather(name: str) -> str:
    if problem := find_weather_problem(name):
        raise ValueError(problem)
    return name


def _check_sky(name: str) -> str:
    if name not in SKY_NAMES:
        *others, last = SKY_NAMES
        raise ValueError(f"must be {', '.join(others)} or {last}; it is {shorten_value(name)}")
    return name


Name = Annotated[str, AfterValidator(_check_name)]
Label = Annotated[str, AfterValidator(_check_label)]
WeatherName = Annotated[
    str,
    Field(strict=True),
    AfterValidator(_check_weather),
    WithJsonSchema({"type": "string", "enum": list(WEATHERS)}),
]
"""Name of a kind of weather: of a row of the table."""
SkyName = Annotated[
    str,
    Field(strict=True),
    AfterValidator(_check_sky),
    WithJsonSchema({"type": "string", "enum": list(SKY_NAMES)}),
]
"""Name of a kind of sky."""
