"""The result of one rasterisation."""

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from tasks.render.pixels import bring_to_host


@dataclass(frozen=True, kw_only=True)
class GBuffer:
    """Per-pixel buffers of one view, H x W: arrays, or tensors of the device that drew it.

    Parameters
    ----------
    rgb : float32 [H, W, 3] blended colour, premultiplied by alpha, in the scene's colour space [1]
    depth : float32 [H, W] camera z of the surface at the pixel: of the plane of the Gaussian at which the
        transmittance falls below one half; the expected depth where it never does [m]; NaN where alpha is 0
    expected_depth : float32 [H, W] camera z of the Gaussians' centres, weighted as the colours are [m]; NaN
        where alpha is 0. Where many discs make one surface it comes out too near, as the near ones hide the far
    alpha : float32 [H, W] accumulated opacity [1]
    normal : float32 [H, W, 3] blended unit normal, world frame, facing the camera; 0 where alpha is 0
    class_id : uint8 [H, W] class of the Gaussian at which the transmittance falls below one half;
        0 (`SemanticClass.SKY`) where it never does
    object_id : uint16 [H, W] number of the body that this Gaussian belongs to; 0 for the scene
    """

    rgb: NDArray[np.float32]
    depth: NDArray[np.float32]
    expected_depth: NDArray[np.float32]
    alpha: NDArray[np.float32]
    normal: NDArray[np.float32]
    class_id: NDArray[np.uint8]
    object_id: NDArray[np.uint16]

    def on_host(self) -> "GBuffer":
        """Return the same buffers as arrays of the processor."""
        return GBuffer(**{field.name: bring_to_host(getattr(self, field.name)) for field in fields(self)})
