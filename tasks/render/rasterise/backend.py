"""Choice of the rasteriser: this project's on the CPU, or gsplat where its picture on a GPU agrees with the CPU's."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal, Protocol, get_args

import numpy as np
from numpy.typing import NDArray

from tasks.conventions import SemanticClass
from tasks.errors import InputError
from tasks.render.rasterise import rasteriser
from tasks.render.rasterise.gbuffer import GBuffer
from tasks.render.rasterise.placed_body import PlacedBody, Shade
from tasks.render.rasterise.preparation import recolour_prepared
from tasks.scene.gaussians import Gaussians

BackendName = Literal["auto", "cpu", "gsplat"]

PROBE_TOLERANCE = 0.01
"""Largest difference in colour, opacity, normal or relative depth of two equal pictures of the probe [1]."""

_GPU_DEVICES = (Path("/dev/nvidia0"), Path("/dev/dxg"))
"""Exist where a CUDA driver is loaded: Linux, and Linux under Windows. This is the only access to the file
system in this package; asking torch instead takes more than a second."""


class Backend(Protocol):
    """A rasteriser: prepare a cloud once, then rasterise any number of views of it."""

    @property
    def name(self) -> str:
        """``"cpu"`` or ``"gsplat"``."""

    def prepare_gaussians(self, gaussians: Gaussians) -> Any:
        """Pack a cloud the way this backend draws it; see `tasks.render.rasterise.rasteriser.prepare_gaussians`."""

    def recolour(self, prepared: Any, sh: NDArray[np.float32]) -> Any:
        """Return a prepared cloud with other colours, float32 [N, K, 3] in the order of the cloud."""

    def rasterise_view(
        self,
        prepared: Any,
        viewmat: NDArray[np.floating],
        K: NDArray[np.floating],
        width: int,
        height: int,
        normals: bool = True,
        bodies: Sequence[PlacedBody] = (),
        shade: Shade | None = None,
    ) -> GBuffer:
        """Draw one view; see `tasks.render.rasterise.rasteriser.rasterise_view`; normals may be there unasked.

        The buffers lie where they are drawn: `GBuffer.on_host` brings them to the processor.
        """

    def keep(self, array: NDArray[np.float32]) -> Any:
        """Return a picture where this backend draws, so that `tasks.render.pixels` finds it beside the buffers."""


class CpuBackend:
    """`tasks.render.rasterise.rasteriser` as a `Backend`."""

    name = "cpu"
    prepare_gaussians = staticmethod(rasteriser.prepare_gaussians)
    recolour = staticmethod(recolour_prepared)
    rasterise_view = staticmethod(rasteriser.rasterise_view)

    @staticmethod
    def keep(array: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the picture itself."""
        return array


def select_backend(name: str = "auto") -> Backend:
    """Return the rasteriser to draw with.

    ``"auto"`` takes gsplat if a GPU is there and gsplat draws the probe scene as the CPU does, and the
    CPU in every other case. torch is imported only if a GPU is there or gsplat is asked for.

    Parameters
    ----------
    name : ``"auto"``, ``"cpu"`` or ``"gsplat"``

    Returns
    -------
    Backend

    Raises
    ------
    InputError
        The name is unknown, or gsplat is asked for and cannot be used here.
    """
    if name not in get_args(BackendName):
        raise InputError(f"backend: must be one of {', '.join(get_args(BackendName))}; it is {name!r}")
    if name == "cpu" or (name == "auto" and not any(device.exists() for device in _GPU_DEVICES)):
        return CpuBackend()
    # Any error on the GPU (no package, no compiler, no driver, no memory) is a reason to draw on the CPU, not to fail.
    try:
        from tasks.render.rasterise.gsplat_backend import GsplatBackend

        gsplat: Backend = GsplatBackend()
        problem = compare_with_cpu(gsplat)
    except Exception as error:
        problem = f"{type(error).__name__}: {error}"
    if not problem:
        return gsplat
    if name == "gsplat":
        raise InputError(f"backend: gsplat cannot be used here ({problem}); use cpu or auto")
    return CpuBackend()


def compare_with_cpu(backend: Backend) -> str:
    """Draw a small scene with this backend and with the CPU, and compare.

    Parameters
    ----------
    backend : the rasteriser to try

    Returns
    -------
    Sentence with the difference above `PROBE_TOLERANCE`; empty if there is none
    """
    gaussians, viewmat, K = probe_scene()
    covered = np.tile(np.array([2.0, 1.0], np.float32), (len(gaussians), 1))
    return _describe_difference(backend, gaussians, viewmat, K) or _describe_difference(
        backend, replace(gaussians, antialiased=True, surroundings=covered), viewmat, K
    )


def _describe_difference(
    backend: Backend, gaussians: Gaussians, viewmat: NDArray[np.float64], K: NDArray[np.float64]
) -> str:
    width, height = 64, 48
    drawn = backend.rasterise_view(backend.prepare_gaussians(gaussians), viewmat, K, width, height).on_host()
    wanted = rasteriser.rasterise_view(rasteriser.prepare_gaussians(gaussians), viewmat, K, width, height)
    differences = {
        "rgb": drawn.rgb - wanted.rgb,
        "alpha": drawn.alpha - wanted.alpha,
        "depth": np.nan_to_num(drawn.depth / wanted.depth, nan=1.0) - 1,
        "normal": (drawn.normal - wanted.normal) * wanted.alpha[..., None],
        "class": np.mean(drawn.class_id != wanted.class_id),
    }
    return "; ".join(
        f"{name} differs by up to {np.abs(difference).max():.3g} from the CPU's"
        for name, difference in differences.items()
        if not np.abs(difference).max() <= PROBE_TOLERANCE
    )


def probe_scene() -> tuple[Gaussians, NDArray[np.float64], NDArray[np.float64]]:
    """Return a spiral of 200 Gaussians in front of a camera: ``gaussians, viewmat, K``."""
    n = 200
    i = np.arange(n, dtype=np.float64)
    means = np.column_stack((np.cos(i) * i / n * 2.5, np.sin(i) * i / n * 2.5, 3 + 4 * ((i * 0.618) % 1)))
    quats = np.column_stack((np.ones(n), np.sin(i), np.sin(2 * i), np.sin(3 * i)))
    normals = np.column_stack((np.sin(5 * i), np.cos(5 * i), np.full(n, 1.5)))
    k = np.arange(16)
    sh = 0.6 * np.sin(i[:, None, None] + k[:, None] + 2 * np.arange(3)) / (1 + k[:, None])
    gaussians = Gaussians(
        means=means.astype(np.float32),
        quats_wxyz=(quats / np.linalg.norm(quats, axis=1, keepdims=True)).astype(np.float32),
        scales=(0.12 + 0.08 * np.sin(np.outer(i, (1, 2, 3)))).astype(np.float32),
        opacities=(0.5 + 0.45 * np.sin(7 * i)).astype(np.float32),
        sh=sh.astype(np.float32),
        normals=(normals / np.linalg.norm(normals, axis=1, keepdims=True)).astype(np.float32),
        class_id=(1 + i % (len(SemanticClass) - 1)).astype(np.uint8),
    )
    return gaussians, np.eye(4), np.array(((60.0, 0, 32), (0, 60.0, 24), (0, 0, 1)))
