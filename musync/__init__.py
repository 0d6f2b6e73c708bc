"""For analysts: ``import musync; data = musync.open("datasets/demo")``."""

from flows.opening import Dataset, open
from flows.windows import ClipWindows, SeededOrder
from tasks.errors import InputError

__all__ = ["ClipWindows", "Dataset", "InputError", "SeededOrder", "open"]
