"""The simulator as a Gymnasium environment: ``pip install 'musync-gs[gym]'``."""

from typing import Any

import gymnasium
import numpy as np

from catalogs.entries import load
from catalogs.road_users import EGO
from flows.driving.simulator import Observation, Simulator

HIGHEST_MPA = 12.0
"""Pressure of the action 1, above which no car of the catalogue brakes harder [MPa]."""
MOST_TARGETS = 4


class BrakingEnvironment(gymnasium.Env):
    """Brake so that nothing is hit: an action in 0 to 1 is the pressure over `HIGHEST_MPA`.

    The observation is a dictionary: ``state`` (speed, acceleration, wheel speeds) and ``targets`` (distance, speed,
    lateral position and width of up to `MOST_TARGETS`, infinitely far for none). The reward of a step is minus its
    pressure share, less the speed at which a target is met.

    Parameters
    ----------
    simulator : that is stepped; with its own rate, targets and frames
    """

    def __init__(self, simulator: Simulator) -> None:
        self._simulator = simulator
        self._overhang, self._width = load("road user sizes")[EGO]
        self.action_space = gymnasium.spaces.Box(0.0, 1.0, (1,), np.float64)
        spaces = {
            "state": gymnasium.spaces.Box(-np.inf, np.inf, (4,), np.float64),
            "targets": gymnasium.spaces.Box(-np.inf, np.inf, (MOST_TARGETS, 4), np.float64),
        }
        self.observation_space = gymnasium.spaces.Dict(spaces)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Begin anew; the drive has no chance in it, so a seed changes nothing."""
        super().reset(seed=seed)
        seen = self._simulator.reset()
        return self._pack(seen), {"observation": seen}

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Drive one step; the episode terminates where a target is met or the car stands."""
        share = float(np.clip(np.asarray(action, np.float64).ravel()[0], 0.0, 1.0))
        seen = self._simulator.step(HIGHEST_MPA * share)
        met = [
            target for target in seen.targets
            if target.station - seen.station - self._overhang <= 0.0
            and abs(target.lateral) < 0.5 * (target.width + self._width)
        ]  # fmt: skip
        impact = max((max(seen.speed - target.speed, 0.0) for target in met), default=0.0)
        return (
            self._pack(seen), -share - impact, bool(met) or seen.stands, seen.ends, {"observation": seen}
        )  # fmt: skip

    def _pack(self, seen: Observation) -> dict[str, np.ndarray[Any, Any]]:
        targets = np.zeros((MOST_TARGETS, 4))
        targets[:, 0] = np.inf
        for row, target in zip(targets, seen.targets, strict=False):
            distance = target.station - seen.station - self._overhang
            row[:] = distance, target.speed, target.lateral, target.width
        state = np.array([seen.speed, seen.acceleration, seen.wheel_speed_f, seen.wheel_speed_r])
        return {"state": state, "targets": targets}
