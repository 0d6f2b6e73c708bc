"""The ways to write scenarios down: product, zip, list and Latin hypercube, multiplied with each other."""

from collections.abc import Iterator, Mapping
from itertools import product
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

Level = tuple[str, dict[str, Any]]


class Strict(BaseModel):
    """Nothing unknown and nothing infinite."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)


class PartialScenario(Strict):
    """The scenario fields that one level of an axis sets; the rest keep their defaults."""

    weather: Literal["dry", "rain", "snow"] | None = None
    precipitation_mm_h: float | None = None
    snow_accumulation_h: float | None = None
    initial_speed_km_h: float | None = None
    peak_pressure_mpa: float | None = None
    ramp_s: float | None = None
    hold_s: float | None = None
    release_s: float | None = None
    brake_onset_s: float | None = None
    brake_onset_m: float | None = None
    hold_speed: bool | None = None
    hazard_center_m: float | None = None
    hazard_length_m: float | None = None
    hazard_height_m: float | None = None


NUMBERS = tuple(name for name in PartialScenario.model_fields if name not in {"weather", "hold_speed"})
Levels = Annotated[dict[str, PartialScenario], Field(min_length=1)]


class LatinHypercube(Strict):
    """Scenarios drawn so that each field takes one value from each of ``count`` equal strata of its range."""

    count: int = Field(ge=1, le=1_000_000)
    seed: int = Field(default=2025, ge=0, lt=2**53)
    ranges: Annotated[dict[str, tuple[float, float]], Field(min_length=1)]

    @model_validator(mode="after")
    def _ranges_are_of_numbers(self) -> "LatinHypercube":
        problems = [f"{name}: no such number of a scenario; there are {', '.join(NUMBERS)}"
                    for name in self.ranges if name not in NUMBERS]  # fmt: skip
        problems += [f"{name}: the range must ascend; it is {low:g} to {high:g}"
                     for name, (low, high) in self.ranges.items() if not low < high]  # fmt: skip
        if problems:
            raise ValueError("; ".join(problems))
        return self


class Blocks(Strict):
    """What a grid multiplies; at least one block has to be there."""

    axes: Annotated[
        dict[str, Levels], Field(description="Product: every level of each axis with every other.")
    ] = {}
    zip: Annotated[
        dict[str, Levels],
        Field(description="Axes of equal length, taken in step: first with first, and so on."),
    ] = {}
    scenarios: Annotated[
        dict[str, PartialScenario], Field(description="A list of scenarios, each with its name.")
    ] = {}
    latin_hypercube: Annotated[
        LatinHypercube | None, Field(description="Scenarios drawn evenly from ranges of numbers.")
    ] = None

    @model_validator(mode="after")
    def _something_to_make(self) -> "Blocks":
        if not (self.axes or self.zip or self.scenarios or self.latin_hypercube):
            raise ValueError("a grid needs one of axes, zip, scenarios and latin_hypercube; there is none")
        lengths = {name: len(levels) for name, levels in self.zip.items()}
        if len(set(lengths.values())) > 1:
            found = ", ".join(f"{name} has {count}" for name, count in lengths.items())
            raise ValueError(f"zip: its axes must have as many levels each; {found}")
        return self


def combinations(blocks: Blocks) -> Iterator[list[Level]]:
    """Every combination of the blocks' levels, each a list of (name, fields), in the order in which they are written.

    Parameters
    ----------
    blocks : to be multiplied: axes, then zip, then scenarios, then the hypercube
    """
    factors = [[[level] for level in _levels(axis)] for axis in blocks.axes.values()]
    if blocks.zip:
        steps = zip(*(_levels(axis) for axis in blocks.zip.values()), strict=True)
        factors.append([list(step) for step in steps])
    if blocks.scenarios:
        factors.append([[level] for level in _levels(blocks.scenarios)])
    if blocks.latin_hypercube:
        factors.append([[level] for level in _drawn(blocks.latin_hypercube)])
    for combination in product(*factors):
        yield [level for part in combination for level in part]


def _levels(axis: Mapping[str, PartialScenario]) -> list[Level]:
    return [(name, partial.model_dump(exclude_none=True)) for name, partial in axis.items()]


def _drawn(cube: LatinHypercube) -> list[Level]:
    from scipy.stats import qmc  # its import takes longer than most commands

    low, high = zip(*cube.ranges.values(), strict=True)
    unit = qmc.LatinHypercube(len(cube.ranges), rng=cube.seed).random(cube.count)
    width = len(str(cube.count - 1))
    return [
        (f"s{k:0{width}}", dict(zip(cube.ranges, row, strict=True)))
        for k, row in enumerate(qmc.scale(unit, low, high).tolist())
    ]
