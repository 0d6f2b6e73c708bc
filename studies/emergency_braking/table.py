"""Emergency brakes, their line, and the protocols that they are held against."""

from functools import cache
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, model_validator

from catalogs.grids.blocks import PartialScenario
from catalogs.quantities import CatalogueEntry, Number, Scalar, Text, require_quantity
from catalogs.road_users import Kind
from studies.plans import load_plan

Seconds = Annotated[Scalar, require_quantity("s", minimum=0)]
Metres = Annotated[Scalar, require_quantity("m", minimum=0)]
Share = Annotated[Scalar, require_quantity("1", above=0)]
Speeds = Annotated[tuple[Number, ...], Field(min_length=1)]


class LineEntry(CatalogueEntry):
    """From a demand to the pressure."""

    delay_s: Seconds
    build_up_s: Seconds
    full_over_lock: Share


class BlindEntry(CatalogueEntry):
    """A brake that knows the time to collision alone."""

    time_to_collision_s: Seconds


class FrictionEntry(CatalogueEntry):
    """A brake that knows the friction of the road."""

    margin_m: Metres
    share: Share


class DriverEntry(CatalogueEntry):
    """A driver who sees a gap close."""

    looming_rad_s: Annotated[Scalar, require_quantity("rad s-1", above=0)]
    reaction_s: Seconds
    build_up_s: Seconds
    deceleration: Annotated[Scalar, require_quantity("g", above=0)]


class BrakesEntry(CatalogueEntry):
    """One of each kind."""

    blind: BlindEntry
    friction: FrictionEntry
    driver: DriverEntry


class TargetEntry(CatalogueEntry):
    """The target of a protocol.

    ``crosses_km_h`` is a speed across the path, from the right, negative from the left; ``overlap`` is the share of the
    car's front that the target has crossed when the unbraked car meets it. ``gaps_m`` and ``decelerations`` multiply.
    """

    kind: Kind
    overlap: Number = 0.5
    speed_km_h: Number = 0.0
    crosses_km_h: Number = 0.0
    brakes_at_s: Number | None = None
    gaps_m: tuple[Number, ...] = ()
    decelerations: tuple[Number, ...] = ()


class ProtocolEntry(CatalogueEntry):
    """Speeds, target and source of one protocol."""

    source: Text
    speeds_km_h: Speeds
    allowed_km_h: tuple[Number, ...] = ()
    begins_s: Number | None = None
    target: TargetEntry

    @model_validator(mode="after")
    def _numbers_fit(self) -> "ProtocolEntry":
        problems = []
        if self.allowed_km_h and len(self.allowed_km_h) != len(self.speeds_km_h):
            problems.append("allowed_km_h must have a number for each of speeds_km_h")
        if (self.begins_s is None) != bool(self.target.gaps_m):
            problems.append("a protocol needs either begins_s or target.gaps_m")
        if bool(self.target.gaps_m) != bool(self.target.decelerations) or bool(self.target.gaps_m) != (
            self.target.brakes_at_s is not None
        ):
            problems.append("target.gaps_m, decelerations and brakes_at_s belong together")
        if problems:
            raise ValueError("; ".join(problems))
        return self


class EmergencyBraking(CatalogueEntry):
    """Content of the file."""

    rate_hz: Annotated[Scalar, require_quantity("Hz", above=0)]
    brake_line: LineEntry
    brakes: BrakesEntry
    weathers: dict[str, PartialScenario]
    protocols: dict[str, ProtocolEntry]

    def list_weathers(self) -> dict[str, dict[str, Any]]:
        """Return the fields of a scenario that each weather sets."""
        return {name: one.model_dump(exclude_none=True) for name, one in self.weathers.items()}


@cache
def load_table() -> EmergencyBraking:
    """Return the content of `emergency_braking.yaml`."""
    table: EmergencyBraking = load_plan(
        EmergencyBraking, Path(__file__).parent, "emergency_braking", "emergency braking"
    )
    return table
