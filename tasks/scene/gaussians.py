"""A cloud of 3D Gaussians: the scene as the rasteriser sees it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tasks.errors import InputError

LARGEST = 1e18
"""Greatest coordinate and standard deviation [m]: the square of a larger one is infinite in single precision."""
UNIT_TOLERANCE = 1e-2
"""Largest deviation of a quaternion's or normal's length from 1 [1]."""


@dataclass(frozen=True, kw_only=True)
class Gaussians:
    """N anisotropic Gaussians in the world frame (ISO 8855: z up) [m].

    Parameters
    ----------
    means : float32 [N, 3] centres [m]
    quats_wxyz : float32 [N, 4] unit quaternions, local axes to world [1]
    scales : float32 [N, 3] standard deviations along the local axes [m]
    opacities : float32 [N] peak opacity in (0, 1] [1]
    sh : float32 [N, K, 3] spherical-harmonic colour, K = 1, 4, 9 or 16, band order of the INRIA layout;
        colour = max(SH(direction) + 0.5, 0) [1]
    normals : float32 [N, 3] unit normals, world frame [1]
    class_id : uint8 [N] `SemanticClass`
    surroundings : float32 [N, 2] overlap of the surface about each Gaussian, and root mean square size of its
        neighbours over its own, see `tasks.scene.surroundings`: the cloud is drawn without the painter's bias
        (`tasks.render.rasterise.painters_bias`) [1]; None: as its trainer drew it, with the bias
    light : float32 [N, 4] share of `Scene.daylight` that reaches each Gaussian: of the sun, cosine and shadow
        included, of the sky and of the sunlit surroundings; and share of its colour that mirrors the sky, so that
        it can be lit anew [1]; None: not known
    antialiased : splats narrower than a pixel fade instead of growing (Yu et al. 2024, Mip-Splatting,
        doi:10.1109/CVPR52733.2024.01839); False: the rule of the INRIA code, for which most files are made
    display_encoded : the colours blend in sRGB display space (scenes trained on pictures) and the
        picture is linearised after blending; False: they are linear light
    """

    means: NDArray[np.float32]
    quats_wxyz: NDArray[np.float32]
    scales: NDArray[np.float32]
    opacities: NDArray[np.float32]
    sh: NDArray[np.float32]
    normals: NDArray[np.float32]
    class_id: NDArray[np.uint8]
    surroundings: NDArray[np.float32] | None = None
    light: NDArray[np.float32] | None = None
    antialiased: bool = False
    display_encoded: bool = False

    def __len__(self) -> int:
        return len(self.means)


def check_gaussians(gaussians: Gaussians, place: str = "scene") -> None:
    """Raise `InputError` naming every array with a wrong shape, a NaN or a value out of range."""
    n = len(gaussians.means)
    problems = []
    shapes = {
        "means": (n, 3), "quats_wxyz": (n, 4), "scales": (n, 3), "opacities": (n,), "normals": (n, 3), "class_id": (n,),
    }  # fmt: skip
    shapes |= {k: (n, w) for k, w in (("surroundings", 2), ("light", 4)) if getattr(gaussians, k) is not None}
    if gaussians.surroundings is not None and not gaussians.antialiased:
        problems.append(f"{place}: surroundings are counted for antialiased Gaussians; these are not")
    for name, shape in shapes.items():
        if getattr(gaussians, name).shape != shape:
            problems.append(
                f"{place}: {name} must have shape {shape}; it has {getattr(gaussians, name).shape}"
            )
    for name in (*shapes, "sh"):
        wanted, found = "uint8" if name == "class_id" else "float32", getattr(gaussians, name).dtype
        if found != wanted:
            problems.append(f"{place}: {name} must be {wanted}; it is {found}")
    if (
        gaussians.sh.ndim != 3
        or gaussians.sh.shape[0] != n
        or gaussians.sh.shape[1:] not in {(k, 3) for k in (1, 4, 9, 16)}
    ):
        problems.append(f"{place}: sh must have shape ({n}, 1|4|9|16, 3); it has {gaussians.sh.shape}")
    if problems:
        raise InputError(problems)
    for name in (*(name for name in shapes if name != "class_id"), "sh"):
        finite = np.isfinite(getattr(gaussians, name))
        bad = np.flatnonzero(~finite.all(axis=tuple(range(1, finite.ndim))))
        if len(bad):
            problems.append(
                f"{place}: {name} must be finite; {len(bad)} of {n} Gaussians are not, the first is number {bad[0]}"
            )
    if not problems:
        for name, ok, rule in (
            ("means", (np.abs(gaussians.means) <= LARGEST).all(axis=1), f"within {LARGEST:g} m"),
            ("quats_wxyz", _is_unit(gaussians.quats_wxyz), "unit quaternions"),
            ("normals", _is_unit(gaussians.normals), "unit vectors"),
            (
                "scales",
                ((gaussians.scales > 0) & (gaussians.scales <= LARGEST)).all(axis=1),
                f"positive, and at most {LARGEST:g} m",
            ),
            ("opacities", (gaussians.opacities > 0) & (gaussians.opacities <= 1), "in (0, 1]"),
            ("surroundings", _is_surrounded(gaussians), "an overlap of 0 or more and a positive size"),
            ("light", _is_lit(gaussians), "shares from 0 to 1"),
        ):
            if not ok.all():
                bad = np.flatnonzero(~ok)
                problems.append(
                    f"{place}: {name} must be {rule}; {len(bad)} of {n} are not, the first is number {bad[0]}"
                )
    if problems:
        raise InputError(problems)


def _is_unit(vectors: NDArray[np.float32]) -> NDArray[np.bool_]:
    """Return whether each of the vectors [N, D] has length 1; one whose square overflows single precision has not."""
    return np.abs(np.sqrt(np.einsum("ni,ni->n", vectors, vectors)) - 1) <= UNIT_TOLERANCE


def _is_surrounded(gaussians: Gaussians) -> NDArray[np.bool_]:
    if gaussians.surroundings is None:
        return np.ones(len(gaussians), dtype=np.bool_)
    return (gaussians.surroundings[:, 0] >= 0) & (gaussians.surroundings[:, 1] > 0)


def _is_lit(gaussians: Gaussians) -> NDArray[np.bool_]:
    if gaussians.light is None:
        return np.ones(len(gaussians), dtype=np.bool_)
    return (gaussians.light.min(axis=1) >= 0) & (gaussians.light.max(axis=1) <= 1)
