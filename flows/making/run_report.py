"""Result of a generating run, and what its clips cost."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from flows.store.layout import Layout


@dataclass(frozen=True, kw_only=True)
class RunCost:
    """Cost of all clips together; nothing of a single clip is kept.

    Parameters
    ----------
    cpu_s, wall_s : sums over the clips [s]
    peak_memory_mib : of the largest worker [MiB]
    """

    cpu_s: float = 0.0
    wall_s: float = 0.0
    peak_memory_mib: float = 0.0

    def with_clip(self, cost: Mapping[str, float]) -> "RunCost":
        """The cost with that of one more clip."""
        return RunCost(
            cpu_s=self.cpu_s + cost["cpu_s"],
            wall_s=self.wall_s + cost["wall_s"],
            peak_memory_mib=max(self.peak_memory_mib, cost["peak_memory_mib"]),
        )


@dataclass(frozen=True, kw_only=True)
class RunReport:
    """Result of a generating run.

    Parameters
    ----------
    layout : where it lies
    run_id : of its frozen plan
    clips, made : clips of the dataset, and of these those made now
    quarantined : why the pose check failed, by label of the clip; they stay in the dataset, marked
    cost : of what was made now
    """

    layout: Layout
    run_id: str
    clips: int
    made: int
    quarantined: dict[str, list[str]]
    cost: RunCost


def list_step_times(made: Mapping[str, Any]) -> dict[str, Any]:
    """Return what a table of a run's clips shows of one: the check's outcome, and the processor time of each step.

    Parameters
    ----------
    made : a clip's receipt with its ``cost``, as of `flows.making.clip.make_clip`
    """
    return {"check": {True: "passed", False: "failed", None: "not judged"}[made["verdict"]["passed"]]} | {
        f"{step} [CPU-s]": round(spent, 3) for step, spent in made["cost"]["steps"].items()
    }
