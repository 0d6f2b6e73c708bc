"""Catalogue values at the file edge: each is written as value, unit and source, and is checked when read."""

from collections.abc import Callable, Hashable
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any, TypeVar

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, RootModel, ValidationError

from catalogs.documents import LARGEST_YAML, parse_yaml, parse_yaml_value, read_content
from catalogs.sentences import cap_problems, describe_rules
from tasks.errors import InputError

Number = Annotated[float, Field(strict=True)]
Text = Annotated[str, Field(strict=True, min_length=1)]
Entry = TypeVar("Entry", bound=BaseModel)
Content = TypeVar("Content")


class CatalogueEntry(BaseModel):
    """Base of what a catalogue file holds: nothing unknown, nothing missing, nothing infinite."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    def build(self) -> Any:
        """Return what the entry is for those who ask for it: itself, where a kind has no other value."""
        return self

    def numbers(self) -> dict[str, Any]:
        """Return the numbers of its quantities, by their names [their own units]."""
        return {name: one.value for name, one in self if isinstance(one, Scalar | Table)}


class CatalogueList(RootModel[Content]):
    """Base of a file that is a list of entries, or a table of names that it chooses itself."""

    model_config = ConfigDict(frozen=True)

    def build(self) -> Any:
        """Return the entries."""
        return self.root


class Scalar(CatalogueEntry):
    """One number with its unit and source."""

    value: Number
    unit: Text
    source: Text


class Bounded(Scalar):
    """One number with the declared range of a study around it."""

    bounds: tuple[Number, Number]


class Table(CatalogueEntry):
    """A list of numbers with their unit and source."""

    value: Annotated[tuple[Number, ...], Field(min_length=1)]
    unit: Text
    source: Text


Value = TypeVar("Value", Scalar, Bounded, Table)


def require_quantity(
    unit: str,
    *,
    above: float | None = None,
    minimum: float | None = None,
    maximum: float | None = None,
    below: float | None = None,
) -> AfterValidator:
    """A rule for an annotation: the unit, and limits that every number of the entry keeps."""

    def check(entry: Value) -> Value:
        problems = [] if entry.unit == unit else [f"unit must be {unit}; it is {entry.unit}"]
        numbers: tuple[float, ...] = entry.value if isinstance(entry.value, tuple) else (entry.value,)
        if isinstance(entry, Bounded):
            low, high = entry.bounds
            numbers += entry.bounds
            if not low <= entry.value <= high:
                problems.append(
                    f"value must lie within its bounds {low:g} to {high:g}; it is {entry.value:g}"
                )
        rules: tuple[tuple[float | None, str, Callable[[float, float], bool]], ...] = (
            (above, "above", lambda number, limit: number > limit),
            (minimum, "at least", lambda number, limit: number >= limit),
            (maximum, "at most", lambda number, limit: number <= limit),
            (below, "below", lambda number, limit: number < limit),
        )
        for limit, words, holds in rules:
            problems += [
                f"must be {words} {limit:g}; it is {number:g}"
                for number in numbers
                if limit is not None and not holds(number, limit)
            ]
        if problems:
            raise ValueError("; ".join(problems))
        return entry

    return AfterValidator(check)


def read_entry(model: type[Entry], path: Path, kind: str) -> Entry:
    """Read and check one YAML file.

    Parameters
    ----------
    model : what the file must hold
    path : the file
    kind : what it is called in the sentences

    Raises
    ------
    InputError
        One sentence per problem, all of them at once.
    """
    return parse_entry(model, read_content(path, kind, LARGEST_YAML), path, kind)


@lru_cache(maxsize=64)
def parse_entry(model: type[Entry], content: bytes, origin: Hashable, kind: str) -> Entry:
    """Check the content of one YAML file; the same content of the same origin is checked once.

    Parameters
    ----------
    model : what it must hold
    content : of the file
    origin, kind : where it comes from and what it is called in the sentences

    Raises
    ------
    InputError
        One sentence per problem, all of them at once.
    """
    parse = parse_yaml_value if issubclass(model, RootModel) else parse_yaml
    try:
        return model.model_validate(parse(content, origin, kind, finite=False))
    except ValidationError as error:
        raise InputError(cap_problems(describe_rules(error, origin))) from None
