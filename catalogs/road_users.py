"""Road users of a scenario: their kinds with the sizes of their bodies, and the form of one in a grid."""

from collections.abc import Mapping
from math import cos, inf, radians, sin
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, field_serializer, model_validator

from catalogs.entries import load
from catalogs.physical_limits import find_limit_problem
from catalogs.quantities import CatalogueEntry, Number, Table, require_quantity
from tasks.scene.road_users.track import Track

ROAD_USERS = "road_users.yaml"
"""Name among a dataset's kept inputs, where its grid has road users."""
EGO = "ego"
"""What is ahead of the front axle and behind the rear one, and the width of the ego vehicle, beside the sizes [m]."""
Kind = Literal["car", "van", "truck", "adult", "child", "bicycle"]
LONGEST_M = 30.0
"""Greatest side of a body [m]: longer than any road train of Council Directive 96/53/EC."""
BODIES = "bodies"
"""Folder of users' own bodies among a dataset's kept inputs."""


def _check_size(table: Table) -> Table:
    if len(table.value) != 3:
        raise ValueError(f"must be length, width and height; it has {len(table.value)} values")
    return table


def _check_ego(table: Table) -> Table:
    if len(table.value) != 2:
        raise ValueError(f"must be overhang and width; it has {len(table.value)} values")
    return table


Ego = Annotated[Table, require_quantity("m", above=0.0), AfterValidator(_check_ego)]
Size = Annotated[Table, require_quantity("m", above=0.0), AfterValidator(_check_size)]


class RoadUserSizes(CatalogueEntry):
    """Content of the file: the box of the body of each kind, and what the ego vehicle takes."""

    car: Size
    van: Size
    truck: Size
    adult: Size
    child: Size
    bicycle: Size
    ego: Ego

    def build(self) -> dict[str, tuple[float, ...]]:
        """Kind to length, width and height [m], and `EGO`."""
        return {kind: getattr(self, kind).value for kind in type(self).model_fields}


class _Form(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class TrackForm(_Form):
    """The motion of a road user as a grid has it: a line, a speed, and at most one change of speed."""

    station_m: Number | None = Field(
        default=None, description="Station of the body's middle at the start of the clip [m]"
    )
    gap_m: Number | None = Field(
        default=None,
        description="In place of station_m: from the ego's front axle at its start to the body's nearer end [m]",
    )
    world_m: tuple[Number, Number] | None = Field(
        default=None, description="In place of both: x and y of the body's middle in the world [m]"
    )
    lateral_m: Number = Field(
        default=0.0, description="To the left of the route, at the start of the clip [m]"
    )
    heading_deg: Number = Field(
        default=0.0,
        description="Of body and motion: 0 along the road, 90 across it to the left, 180 towards the ego; with world_m"
        " from the world's x [deg]",
    )
    speed_km_h: Number = Field(default=0.0, description="At the start of the clip, along the heading [km/h]")
    change_at_s: Number | None = Field(default=None, description="Time from which the speed changes [s]")
    acceleration_m_s2: Number | None = Field(
        default=None,
        description="Rate of that change, negative to brake; the surface bounds it at mu g [m/s2]",
    )
    until_km_h: Number | None = Field(
        default=None, description="Speed at which the change ends; 0 where it brakes [km/h]"
    )

    @model_validator(mode="after")
    def _rules(self) -> "TrackForm":
        problems = []
        starts = [name for name in ("station_m", "gap_m", "world_m") if getattr(self, name) is not None]
        if len(starts) != 1:
            problems.append(
                f"needs exactly one of station_m, gap_m and world_m; it has {' and '.join(starts) or 'none'}"
            )
        if self.world_m is not None and self.lateral_m:
            problems.append("lateral_m goes with station_m or gap_m; with world_m leave it out")
        if self.gap_m is not None and not self.gap_m > 0:
            problems.append(f"gap_m must be above 0; it is {self.gap_m:g}")
        limits = load("table of physical limits")
        for name in ("speed_km_h", "until_km_h", "change_at_s"):
            value = getattr(self, name)
            if value is not None and value < 0:
                problems.append(f"{name} must not be negative; it is {value:g}")
            limit = limits.brake_time if name == "change_at_s" else limits.initial_speed
            if value is not None and (problem := find_limit_problem(name, value, limit)):
                problems.append(problem)
        rate, until = self.acceleration_m_s2, self.until_km_h
        if (rate is None) != (self.change_at_s is None):
            problems.append("change_at_s and acceleration_m_s2 go together; one of them is missing")
        if rate is None and until is not None:
            problems.append("until_km_h needs change_at_s and acceleration_m_s2")
        if rate is not None and rate > 0 and not (until is not None and until > self.speed_km_h):
            problems.append(
                f"acceleration_m_s2 above 0 needs until_km_h above speed_km_h ({self.speed_km_h:g})"
            )
        if rate is not None and rate < 0 and (until or 0.0) >= self.speed_km_h:
            problems.append(
                f"acceleration_m_s2 below 0 needs until_km_h below speed_km_h; they are {until or 0.0:g} and"
                f" {self.speed_km_h:g}"
            )
        if rate == 0:
            problems.append("acceleration_m_s2 must not be 0: leave it out, with change_at_s")
        if problems:
            raise ValueError("; ".join(problems))
        return self


class RoadUser(_Form):
    """A road user of a scenario."""

    kind: Kind = Field(description="Which body; catalogs/road_users.yaml has its size")
    body: str | None = Field(
        default=None,
        max_length=4096,
        description="In place of that body, a .ply of Gaussians in body axes: x forward, y left, z up, the ground at 0",
    )
    size_m: tuple[Number, Number, Number] | None = Field(
        default=None,
        description="With body: length, width and height of its box, in the middle of which it stands [m]",
    )
    track: TrackForm

    @field_serializer("body")
    def _record_body(self, body: str | None) -> str | None:
        """Return the path as records have it: by its last part where the rest is a private matter."""
        path = Path(body or "")
        private = path.is_absolute() or path.parts[:1] == ("~",) or ".." in path.parts
        return path.name if private else body

    @model_validator(mode="after")
    def _own_body_has_a_box(self) -> "RoadUser":
        if (self.body is None) != (self.size_m is None):
            raise ValueError("body and size_m go together; one of them is missing")
        if self.size_m is not None and not all(0 < side <= LONGEST_M for side in self.size_m):
            raise ValueError(f"size_m must be above 0 and at most {LONGEST_M:g} m; it is {list(self.size_m)}")
        if self.body is not None and not self.body.lower().endswith(".ply"):
            raise ValueError(f"body must be a .ply file; it is {self.body}")
        return self

    def choose_size(self, sizes: Mapping[str, tuple[float, ...]]) -> tuple[float, ...]:
        """Return length, width and height of its box [m]: its own, or that of its kind."""
        return self.size_m or sizes[self.kind]

    def as_record(self) -> dict[str, Any]:
        """What the grid says of it, as JSON has it."""
        return self.model_dump(mode="json", exclude_defaults=True)

    def build_track(self, size: tuple[float, ...]) -> Track:
        """Return its track.

        Parameters
        ----------
        size : length, width and height of its body [m]
        """
        form, heading = self.track, radians(self.track.heading_deg)
        start = form.world_m
        if start is None:
            along = form.station_m
            if along is None:
                along = (form.gap_m or 0.0) + reach_along(size, heading)
            start = (along, form.lateral_m)
        return Track(
            start=start,
            heading=heading,
            in_world=form.world_m is not None,
            speed=form.speed_km_h / 3.6,
            change_at=inf if form.change_at_s is None else form.change_at_s,
            acceleration=form.acceleration_m_s2 or 0.0,
            final_speed=(form.until_km_h or 0.0) / 3.6,
        )


def reach_along(size: tuple[float, ...], heading: float) -> float:
    """Return how far a box reaches from its middle along the road [m].

    Parameters
    ----------
    size : length, width and height [m]
    heading : of the box from the road's direction [rad]
    """
    return (abs(cos(heading)) * size[0] + abs(sin(heading)) * size[1]) / 2
