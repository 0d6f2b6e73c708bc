"""For analysts: ``import musync; data = musync.open("datasets/demo")``."""

from typing import TYPE_CHECKING, Any

from flows.reading.clips import Clip
from flows.reading.opening import Dataset, open
from tasks.errors import InputError

if TYPE_CHECKING:
    from flows.reading.windows import ClipWindows, SeededOrder

__all__ = ["Clip", "ClipWindows", "Dataset", "InputError", "SeededOrder", "open"]


def __getattr__(name: str) -> Any:
    """Torch is imported with the classes that need it: it takes longer than a question to a dataset."""
    if name in {"ClipWindows", "SeededOrder"}:
        from flows.reading import windows

        return getattr(windows, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
