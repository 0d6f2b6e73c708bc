"""The ways to write scenarios down: product, zip, list and Latin hypercube, multiplied with each other."""

from collections.abc import Iterator, Mapping
from itertools import product
from math import prod
from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, model_validator

from catalogs.names import Label, SkyName, WeatherName
from catalogs.road_users import RoadUser
from catalogs.scenario import NUMBERS
from catalogs.sentences import shorten
from catalogs.street_names import SceneName, read_scene_levels

Level = tuple[str, dict[str, Any]]


class Strict(BaseModel):
    """Nothing unknown and nothing infinite."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)


def _refuse_boolean(value: object) -> object:
    if isinstance(value, bool):
        raise ValueError(f"must be a number; it is {value}")
    return value


Number = Annotated[float, BeforeValidator(_refuse_boolean)]
Whole = Annotated[int, BeforeValidator(_refuse_boolean)]


class PartialScenario(Strict):
    """The scenario fields that one level of an axis sets; the rest keep their defaults."""

    weather: WeatherName | None = None
    precipitation_mm_h: Number | None = None
    snow_accumulation_h: Number | None = None
    initial_speed_km_h: Number | None = None
    peak_pressure_mpa: Number | None = None
    ramp_s: Number | None = None
    hold_s: Number | None = None
    release_s: Number | None = None
    brake_onset_s: Number | None = None
    brake_onset_m: Number | None = None
    hold_speed: bool | None = None
    hazard_center_m: Number | None = None
    hazard_length_m: Number | None = None
    hazard_height_m: Number | None = None
    falling: bool | None = None
    sky: SkyName | None = None
    sun_azimuth_deg: Number | None = None
    sun_elevation_deg: Number | None = None
    visual_range_m: Number | None = None
    objects: tuple[RoadUser, ...] | None = Field(
        default=None,
        exclude_if=lambda users: users is None,
        description="Road users beside the ego vehicle.",
    )
    scene: SceneName | None = None


Levels = Annotated[dict[Label, PartialScenario], Field(min_length=1), BeforeValidator(read_scene_levels)]


def _check_lengths(axes: dict[str, Levels]) -> dict[str, Levels]:
    lengths = {name: len(levels) for name, levels in axes.items()}
    if len(set(lengths.values())) > 1:
        found = ", ".join(f"{name} has {count}" for name, count in lengths.items())
        raise ValueError(f"its axes must have as many levels each; {shorten(found)}")
    return axes


class LatinHypercube(Strict):
    """Scenarios drawn so that each field takes one value from each of ``count`` equal strata of its range."""

    count: Whole = Field(ge=1, le=1_000_000)
    seed: Whole = Field(default=2025, ge=0, lt=2**53)
    ranges: Annotated[dict[str, tuple[Number, Number]], Field(min_length=1)]

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
    """Blocks whose product is the grid; there must be at least one."""

    axes: Annotated[
        dict[Label, Levels], Field(description="Product: every level of each axis with every other.")
    ] = {}
    zip: Annotated[
        dict[Label, Levels],
        AfterValidator(_check_lengths),
        Field(description="Axes of equal length, taken in step: first with first, and so on."),
    ] = {}
    scenarios: Annotated[
        dict[Label, PartialScenario], Field(description="A list of scenarios, each with its name.")
    ] = {}
    latin_hypercube: Annotated[
        LatinHypercube | None,
        Field(
            description="count scenarios: each field of ranges takes one value from each of count equal strata."
        ),
    ] = None

    @property
    def has_features(self) -> bool:
        """Whether a scenario may have a hump or a depression."""
        levels = [
            level for axes in (self.axes, self.zip) for rows in axes.values() for level in rows.values()
        ]
        drawn = {} if self.latin_hypercube is None else self.latin_hypercube.ranges
        return "hazard_height_m" in drawn or any(
            level.hazard_height_m for level in (*levels, *self.scenarios.values())
        )

    @model_validator(mode="after")
    def _something_to_make(self) -> "Blocks":
        if not (self.axes or self.zip or self.scenarios or self.latin_hypercube):
            raise ValueError("a grid needs one of axes, zip, scenarios and latin_hypercube; there is none")
        return self


def count_combinations(blocks: Blocks) -> int:
    """How many combinations there are, without making any [1].

    Parameters
    ----------
    blocks : to be multiplied
    """
    counts = [len(levels) for levels in blocks.axes.values()]
    counts += [len(next(iter(blocks.zip.values())))] if blocks.zip else []
    counts += [len(blocks.scenarios)] if blocks.scenarios else []
    counts += [blocks.latin_hypercube.count] if blocks.latin_hypercube else []
    return prod(counts)


def list_combinations(blocks: Blocks, base: PartialScenario, scene: str) -> Iterator[Level]:
    """Yield the label and the fields of every combination of the blocks' levels, in the order as they are written.

    Parameters
    ----------
    blocks : to be multiplied: axes, then zip, then scenarios, then the hypercube; later ones overrule earlier ones
    base : fields that the levels overrule
    scene : of the clips whose levels name none, where others' do
    """
    axes = [*blocks.axes.values(), *blocks.zip.values(), blocks.scenarios]
    several = any(level.scene is not None for levels in axes for level in levels.values())
    default = ({"scene": scene} if several else {}) | fields_set_by(base)
    factors = [[[level] for level in _list_levels(axis)] for axis in blocks.axes.values()]
    if blocks.zip:
        steps = zip(*(_list_levels(axis) for axis in blocks.zip.values()), strict=True)
        factors.append([list(step) for step in steps])
    if blocks.scenarios:
        factors.append([[level] for level in _list_levels(blocks.scenarios)])
    if blocks.latin_hypercube:
        factors.append([[level] for level in _draw_levels(blocks.latin_hypercube)])
    for combination in product(*factors):
        levels = [level for part in combination for level in part]
        fields = dict(default)
        for _, set_by_level in levels:
            fields |= set_by_level
        yield "/".join(name for name, _ in levels), fields


def _list_levels(axis: Mapping[str, PartialScenario]) -> list[Level]:
    return [(name, fields_set_by(partial)) for name, partial in axis.items()]


def fields_set_by(partial: PartialScenario) -> dict[str, Any]:
    """The fields that a level sets, as they are.

    Parameters
    ----------
    partial : the level
    """
    return {name: value for name, value in partial if value is not None}


def _draw_levels(cube: LatinHypercube) -> list[Level]:
    from scipy.stats import qmc  # its import takes longer than most commands

    low, high = zip(*cube.ranges.values(), strict=True)
    unit = qmc.LatinHypercube(len(cube.ranges), rng=cube.seed).random(cube.count)
    width = len(str(cube.count - 1))
    return [
        (f"s{k:0{width}}", dict(zip(cube.ranges, row, strict=True)))
        for k, row in enumerate(qmc.scale(unit, low, high).tolist())
    ]
