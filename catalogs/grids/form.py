"""The form of a grid file, and limits on the size of one grid."""

from math import ceil
from typing import Annotated, Literal

from pydantic import BeforeValidator, Field, ValidationInfo, field_validator, model_validator

from catalogs.entries import load
from catalogs.grids.blocks import Blocks, PartialScenario, Whole, count_combinations
from catalogs.grids.blocks import Number as LaxNumber
from catalogs.grids.selection import Condition
from catalogs.names import Name
from catalogs.physical_limits import find_limit_problem
from catalogs.road_users import RoadUser
from catalogs.street_names import SceneName
from catalogs.variants import Variant

LIMITS = load("table of physical limits")
TICK_RATE_HZ = 1000
MOST_CLIPS = 100_000
"""Clips of one grid [1]: a manifest takes 2 kB a clip and every command reads it whole, 200 MB of JSON here."""
Reference = Annotated[str, Field(min_length=1, max_length=4096)]
"""Name or file of an entry; 4096 characters are the longest path."""

BEFORE = {
    "composition": "linear",
    "low_speed": "literal",
    "duration_s": None,
    "variant": "full",
    "hazard_marking": None,
    "wet_friction": "paper",
}
"""Value of a setting that a record lacks, and that an id leaves out, so that older clips keep theirs; for ``low_speed``
and ``wet_friction`` grid files mean another default."""


def _read_plain(value: object) -> object:
    return None if value == "plain" else value


class GridFile(Blocks):
    """A grid as written in YAML."""

    name: Name = Field(description="Name of the dataset.")
    scene: SceneName = Field(
        default="street",
        description="Built-in street (hill climbs by 8 % from station 40 m on), {street: {kind: town, seed: 7}}, or"
        " folder of a scene of your own. A level may name another: the clips of a grid drive in many scenes.",
    )
    vehicle: Reference = Field(default="paper-reference", description="Vehicle: name, or file of your own.")
    surface: Reference = Field(default="dense-asphalt", description="Pavement: name, or file of your own.")
    camera: Reference = Field(default="dashcam-480x320", description="Camera: name, or file of your own.")
    hazard_marking: Annotated[Reference | None, BeforeValidator(_read_plain)] = Field(
        default="zebra-yellow-black",
        description="Finish of road features: marking of humps, patch of depressions, joints; plain leaves them bare.",
    )
    vehicle_mode: Literal["paper", "coupled"] = Field(
        default="paper",
        description="Model of the motion; a vehicle that was fitted brings its own mode.",
    )
    frames: Whole = Field(
        default=81,
        ge=2,
        le=int(LIMITS.frames.value),
        description="Pictures of a clip, the one at 0 s among them.",
    )
    frame_rate_hz: LaxNumber = Field(
        default=10.0,
        gt=0,
        le=LIMITS.frame_rate.value,
        validate_default=True,
        description="Pictures a second [Hz]",
    )
    duration_s: LaxNumber | None = Field(
        default=None,
        gt=0,
        description="Length of the telemetry from the first frame on; without it, it ends with the last frame [s]",
    )
    low_speed: Literal["steady", "literal"] = Field(
        default="steady",
        description="End of a stop in paper mode: steady rests on no one sample; literal is Appendix B word by word.",
    )
    wet_friction: Literal["by-speed", "paper"] = Field(
        default="by-speed",
        exclude_if=lambda law: law == "paper",
        description="Friction of wet roads in coupled mode: by-speed knows film and speed, paper the film alone"
        " (Eq. 5). Paper mode takes the paper's.",
    )
    variant: Variant = Field(
        default="full",
        exclude_if=lambda variant: variant == "full",
        description="Coupling that is cut on purpose (the paper's ablation): the picture stays that of the scenario,"
        " the motion is the variant's. full cuts none.",
    )
    seed: Whole = Field(
        default=2025,
        ge=0,
        lt=2**53,
        description="First visual seed: places of drops, flakes and patches of snow.",
    )
    visual_seeds: Whole = Field(
        default=1, ge=1, le=1000, description="Clips of each scenario, with visual seeds from seed upward."
    )
    composition: Literal["linear", "paper"] = Field(
        default="linear",
        description="linear adds up light; paper adds drops and flakes as 8-bit differences (Appendix A.4).",
    )
    labels: bool = Field(
        default=False, description="Stores normal, road position, flow and marks of each pixel too."
    )
    compression: Literal["zstd", "lz4"] = Field(
        default="zstd",
        exclude_if=lambda compression: compression == "zstd",
        description="Of stored frames, without loss; lz4 is written more slowly and read more quickly, for training.",
    )
    pictures: bool | Literal["later"] = Field(
        default=True,
        description="later makes frames when they are read, as --frames later does; false makes telemetry alone.",
    )
    base: PartialScenario = Field(default=PartialScenario(), description="Fields of every scenario.")
    exclude: list[Condition] = Field(
        default=[], description="Combinations to leave out: those that meet any of these conditions."
    )
    splits: dict[Name, Condition] = Field(
        default={}, description="Name to condition; a clip belongs to the first that it keeps."
    )

    @field_validator("frame_rate_hz")
    @classmethod
    def _clips_are_short_enough(cls, rate: float, info: ValidationInfo) -> float:
        frames = info.data.get("frames", 2)
        if problem := find_limit_problem(
            "(frames - 1) / frame_rate_hz", (frames - 1) / rate, LIMITS.duration
        ):
            raise ValueError(problem)
        return rate

    @field_validator("duration_s")
    @classmethod
    def _telemetry_covers_the_frames(cls, duration: float | None, info: ValidationInfo) -> float | None:
        if duration is None or not {"frames", "frame_rate_hz"} <= info.data.keys():
            return duration
        if problem := find_limit_problem("duration_s", duration, LIMITS.duration):
            raise ValueError(problem)
        if abs(duration * 1000 - round(duration * 1000)) > 1e-6:
            raise ValueError(f"must be whole milliseconds; it is {duration} s")
        shown = (info.data["frames"] - 1) / info.data["frame_rate_hz"]
        if duration < shown:
            raise ValueError(
                f"must reach the last frame, at (frames - 1) / frame_rate_hz = {shown:g} s; it is {duration:g} s"
            )
        return duration

    @property
    def telemetry_s(self) -> float:
        """Length of the telemetry of every clip, whole milliseconds: it reaches the last frame if none is given [s]."""
        if self.duration_s is not None:
            return self.duration_s
        shown_ms = 1000.0 * (self.frames - 1) / self.frame_rate_hz
        return ceil(shown_ms - 1e-6) / 1000.0

    @property
    def rows_per_clip(self) -> dict[str, int]:
        """Rows of every clip in each table of telemetry, the first frame's tick among them [1]."""
        return {"ticks": round(self.telemetry_s * TICK_RATE_HZ) + 1, "frames": self.frames}

    @property
    def road_users(self) -> list[RoadUser]:
        """Road users of all levels."""
        levels = [self.base, *self.scenarios.values()]
        levels += [
            level for axes in (self.axes, self.zip) for axis in axes.values() for level in axis.values()
        ]
        return [user for level in levels for user in level.objects or ()]

    @property
    def stores_frames(self) -> bool:
        """Whether frames are made with the telemetry; ``pictures`` alone says whether there are any to be seen."""
        return self.pictures is True

    @property
    def has_objects(self) -> bool:
        """Whether there are road users: then all clips have an array of instances and a table of objects."""
        return bool(self.road_users)

    @property
    def keeps_stops_steady(self) -> bool:
        """Whether the numbers of ``catalogs/low_speed.yaml`` reach the motion; coupled mode has no such rule."""
        return self.vehicle_mode == "paper" and self.low_speed == "steady"

    @property
    def marked_features(self) -> bool:
        """Whether clips may show a road feature with a finish."""
        return self.hazard_marking is not None and bool(self.has_features or self.base.hazard_height_m)

    @property
    def grips_by_speed(self) -> bool:
        """Whether the numbers of ``catalogs/wet_friction.yaml`` reach the motion; paper mode keeps the paper's law."""
        return self.vehicle_mode == "coupled" and self.wet_friction == "by-speed"

    @model_validator(mode="after")
    def _clips_are_few_enough(self) -> "GridFile":
        count = count_combinations(self) * self.visual_seeds
        if count > MOST_CLIPS:
            raise ValueError(
                f"a grid must ask for at most {MOST_CLIPS:,} clips; levels and visual_seeds multiply to {count:,}:"
                " make several grids of it"
            )
        return self
