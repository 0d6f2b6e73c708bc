"""What one rasterisation returns."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, kw_only=True)
class GBuffer:
    """Per-pixel buffers of one view, H x W.

    Parameters
    ----------
    rgb : float32 [H, W, 3] blended colour, premultiplied by alpha, in the scene's colour space [1]
    depth : float32 [H, W] camera z of the blended surface at the pixel: the discs' planes, weighted as the
        colours are; the expected z of the centres where they make no one surface [m]; NaN where alpha is 0
    alpha : float32 [H, W] accumulated opacity [1]
    normal : float32 [H, W, 3] blended unit normal, world frame, facing the camera; 0 where alpha is 0
    class_id : uint8 [H, W] class of the Gaussian at which the transmittance falls below one half;
        0 (`SemanticClass.SKY`) where it never does
    """

    rgb: NDArray[np.float32]
    depth: NDArray[np.float32]
    alpha: NDArray[np.float32]
    normal: NDArray[np.float32]
    class_id: NDArray[np.uint8]
