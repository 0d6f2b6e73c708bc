"""Approaches of the protocols of emergency brakes: how fast the car comes, and what its target does."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from math import copysign, inf
from typing import Any

from catalogs.entries import load
from catalogs.road_users import EGO, RoadUser
from catalogs.scenario import Scenario
from studies.emergency_braking.table import ProtocolEntry
from tasks.driving.targets import TargetTrack, follow_track


@dataclass(frozen=True, kw_only=True)
class Case:
    """One approach of a protocol.

    Parameters
    ----------
    protocol, name : of the protocol, and of the approach in it
    scenario : speed of the car, which nobody brakes, and its one road user
    allowed_km_h : impact that the rule allows; None where it says nothing [km/h]
    """

    protocol: str
    name: str
    scenario: Scenario
    allowed_km_h: float | None = None

    @property
    def speed(self) -> float:
        """Speed of the car [m/s]."""
        return self.scenario.initial_speed_km_h / 3.6

    def follow(self, friction: float = inf) -> TargetTrack:
        """Return the way of the target on a road, whose friction [1] bounds how hard it brakes."""
        (target,) = self.scenario.objects
        size = target.choose_size(load("road user sizes"))
        return follow_track(target.build_track(size), size, friction)


def list_cases(protocol: str, entry: ProtocolEntry) -> Iterator[Case]:
    """Yield the approaches of a protocol.

    Parameters
    ----------
    protocol : its name
    entry : its numbers
    """
    overhang, width = load("road user sizes")[EGO]
    target, across = entry.target, entry.target.crosses_km_h
    for place, speed in enumerate(entry.speeds_km_h):
        shown = f"{speed:g} km/h"
        tracks: dict[str, dict[str, Any]]
        if entry.begins_s is None:
            tracks = {
                f"{shown}, {gap:g} m, {slows:g} m/s2": {
                    "gap_m": overhang + gap, "speed_km_h": target.speed_km_h, "change_at_s": target.brakes_at_s,
                    "acceleration_m_s2": -slows,
                }
                for gap, slows in product(target.gaps_m, target.decelerations)
            }  # fmt: skip
        else:
            gap = (speed - target.speed_km_h) / 3.6 * entry.begins_s
            track = {"gap_m": overhang + gap, "speed_km_h": target.speed_km_h}
            if across:
                met_at = copysign((target.overlap - 0.5) * width, across)
                track |= {
                    "speed_km_h": abs(across), "heading_deg": copysign(90.0, across),
                    "lateral_m": met_at - across / 3.6 * entry.begins_s,
                }  # fmt: skip
            tracks = {shown: track}
        for name, track in tracks.items():
            user = RoadUser.model_validate({"kind": target.kind, "track": track})
            yield Case(
                protocol=protocol,
                name=name,
                scenario=Scenario(initial_speed_km_h=speed, hold_speed=True, objects=(user,)),
                allowed_km_h=entry.allowed_km_h[place] if entry.allowed_km_h else None,
            )
