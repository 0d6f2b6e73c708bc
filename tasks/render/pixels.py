"""Laws of one pixel, in one source for two processors.

A law is a Numba function ``law(row, column, *arrays)`` that reads and writes a picture's arrays at one pixel. On the
processor a loop over rows and columns calls it. Where the first array is a tensor, `tasks.render.device` compiles the
same function for CUDA and runs it at every pixel of that tensor.
"""

import sys
from collections.abc import Callable
from functools import wraps
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

Law = Callable[..., Any]

LAW = {"cache": True, "nogil": True, "error_model": "numpy", "_nrt": False}
"""How Numba compiles laws and their loops. They make no arrays: to count references to them, pixel by pixel, would cost
more than most laws do."""
INLINED = LAW | {"inline": "always"}
"""The same for a law that is written into the loop that calls it."""


def run_on_either(law: Law) -> Callable[[Law], Law]:
    """Let a loop of the processor stand for its law: given tensors, the law runs on their device.

    Parameters
    ----------
    law : the law of one pixel
    """

    def bind(loop: Law) -> Law:
        @wraps(loop)
        def run(*arguments: Any) -> None:
            if isinstance(arguments[0], np.ndarray):
                loop(*arguments)
                return
            run_on_device(law, *arguments)

        return run

    return bind


def run_on_device(law: Law, *arguments: Any) -> None:
    """Run a law at every pixel of the first argument, a tensor; see `tasks.render.device.launch`."""
    from tasks.render.device import launch

    launch(law, *arguments)


def find_namespace(array: Any) -> Any:
    """Return the module whose functions take this array: numpy, or torch for a tensor."""
    return sys.modules["torch"] if type(array).__module__ == "torch" else np


def bring_to_host(array: Any) -> NDArray[Any]:
    """Return an array of the processor: the same, or a copy of a tensor."""
    return array if isinstance(array, np.ndarray) else array.cpu().numpy()


def new_picture(beside: Any, *channels: int) -> Any:
    """Return zeros, float32 [H, W, *channels], where the array ``beside`` of a picture [H, W, ...] lies."""
    shape = (*beside.shape[:2], *channels)
    if isinstance(beside, np.ndarray):
        return np.zeros(shape, dtype=np.float32)
    return beside.new_zeros(shape, dtype=find_namespace(beside).float32)


def find_classes(class_id: Any, classes: Any) -> Any:
    """Return where a picture of classes shows one of those given, bool [H, W].

    Parameters
    ----------
    class_id : uint8 [H, W] `SemanticClass`
    classes : classes to look for
    """
    if isinstance(class_id, np.ndarray):
        return np.isin(class_id, classes)
    return find_namespace(class_id).isin(class_id, class_id.new_tensor(classes))


def blur(picture: Any, width: int) -> Any:
    """Return the mean over a square window about each pixel, mirrored about the outermost pixels at the edges.

    Parameters
    ----------
    picture : float32 [H, W] or [H, W, 3]
    width : of the window, odd [px]
    """
    if isinstance(picture, np.ndarray):
        return cv2.blur(picture, (width, width))
    from tasks.render.device import blur_tensor

    return blur_tensor(picture, width)
