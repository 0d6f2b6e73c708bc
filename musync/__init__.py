"""For analysts: ``import musync; data = musync.open("datasets/demo")``."""

from typing import TYPE_CHECKING, Any

from flows.reading.clips import Clip
from flows.reading.opening import Dataset, open
from tasks.errors import InputError

if TYPE_CHECKING:
    from flows.driving.simulator import Observation, Simulator
    from flows.reading.windows import ClipWindows, SeededOrder

__all__ = ["Clip", "ClipWindows", "Dataset", "InputError", "Observation", "SeededOrder", "Simulator", "open"]


def __getattr__(name: str) -> Any:
    """What needs torch or the vehicle's kernels imports them: both take longer than a question to a dataset."""
    if name in {"ClipWindows", "SeededOrder"}:
        from flows.reading import windows

        return getattr(windows, name)
    if name in {"Observation", "Simulator"}:
        from flows.driving import simulator

        return getattr(simulator, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
