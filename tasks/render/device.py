"""Pictures on a CUDA device: every pixel runs a law of one pixel, in the source that the processor runs.

Arrays of a picture are tensors of torch, which keeps and orders the device's memory. A tensor of the processor runs in
CUDA's simulator (``NUMBA_ENABLE_CUDASIM=1``), which needs no device.
"""

from functools import cache
from typing import Any

import numba
import numpy as np
import torch
from numba import cuda
from torch.nn.functional import avg_pool2d, pad

from tasks.render.pixels import LAW, Law

BLOCK = (32, 8)
"""Columns and rows of pixels that run together [px]."""


def launch(law: Law, *arguments: Any) -> None:
    """Run a law at every pixel.

    Parameters
    ----------
    law : ``law(row, column, *arguments)``, compiled by Numba
    arguments : tensors, arrays and numbers; the first is a tensor that has the picture's rows and columns
    """
    rows, columns = arguments[0].shape[:2]
    blocks = -(-columns // BLOCK[0]), -(-rows // BLOCK[1])
    device = arguments[0].device
    _compile(law)[blocks, BLOCK](rows, columns, tuple(_pass(one, device) for one in arguments))


@cache
def _compile(law: Any) -> Any:
    law = numba.njit(**LAW)(law.py_func)  # not inlined: a call with all arguments of a tuple cannot be

    @cuda.jit
    def kernel(rows, columns, arguments):  # type: ignore[no-untyped-def]
        column, row = cuda.grid(2)
        if row < rows and column < columns:
            law(row, column, *arguments)

    return kernel


def _pass(value: Any, device: torch.device) -> Any:
    """What a kernel takes for an argument; a small array of the processor is copied."""
    if isinstance(value, np.ndarray):
        value = torch.from_numpy(value.copy()).to(device)
    if not isinstance(value, torch.Tensor):
        return value
    return cuda.as_cuda_array(value, sync=False) if value.is_cuda else value.numpy()


def blur_tensor(picture: torch.Tensor, width: int) -> torch.Tensor:
    """Return `tasks.render.pixels.blur` of a picture on a device."""
    reach = width // 2
    planes = picture.reshape(*picture.shape[:2], -1).permute(2, 0, 1)
    wide = pad(planes[None], (reach, reach, reach, reach), mode="reflect")
    mean = avg_pool2d(avg_pool2d(wide, (width, 1), stride=1), (1, width), stride=1)
    return mean[0].permute(1, 2, 0).reshape(picture.shape).contiguous()
