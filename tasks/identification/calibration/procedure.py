"""A calibration procedure: its stages, bounds, and when it has converged."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf

from tasks.identification.calibration.residual import Phase, Response, Yardstick
from tasks.vehicle.rollout import Mode


@dataclass(frozen=True, kw_only=True)
class Bounds:
    """Limits of one group.

    Parameters
    ----------
    unit : unit of the group's scalars
    lower, upper : limits of every scalar [unit]
    step : step of finite differences [unit]
    smooth : standard deviation of the difference between neighbouring knots of a family; infinite for none [unit]
    start : first value of an effect that the vehicle does not have yet; None for 0 [unit]
    """

    unit: str
    lower: float
    upper: float
    step: float
    smooth: float = inf
    start: float | None = None


@dataclass(frozen=True, kw_only=True)
class Stage:
    """One step of the procedure (paper, Table frozen_calibration_count).

    Parameters
    ----------
    name : name of the stage
    groups : groups whose scalars move together
    responses : responses that they are fitted to
    kinds : kinds of the cases that are used: flat, hump, depression
    phase : start, braking, tail or event
    """

    name: str
    groups: tuple[str, ...]
    responses: tuple[Response, ...]
    kinds: tuple[str, ...]
    phase: Phase


@dataclass(frozen=True, kw_only=True)
class Procedure:
    """Procedure of a whole calibration.

    Parameters
    ----------
    mode : paper or coupled
    stages : stages, in order
    passes : number of passes through all stages; with a tolerance, the largest number
    evaluations : largest number of residual evaluations of one stage
    bounds : bounds by group
    yardstick : scales and speeds
    tolerance : passes end when none of a pass's stages moves a scalar by more than this share of the distance between
        its bounds, and a stage is accepted only if all cases together are no worse; None runs every pass and accepts a
        stage on its own loss [1]
    """

    mode: Mode
    stages: tuple[Stage, ...]
    passes: int
    evaluations: int
    bounds: Mapping[str, Bounds]
    yardstick: Yardstick
    tolerance: float | None = None

    @property
    def groups(self) -> tuple[str, ...]:
        """Return every group that some stage moves, in order of first appearance."""
        return tuple(dict.fromkeys(group for stage in self.stages for group in stage.groups))
