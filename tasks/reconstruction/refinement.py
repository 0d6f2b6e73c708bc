"""Refinement of Gaussians by the pictures they came from, one picture after the other."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import cv2
import numba
import numpy as np
from numpy.typing import NDArray

from tasks.conventions import ROAD_CLASSES
from tasks.reconstruction.adjoint import (
    ALONG_X,
    ALONG_Y,
    COLOUR,
    OPACITY,
    OPACITY_SQUARE,
    SQUARE_XX,
    SQUARE_XY,
    SQUARE_YY,
    WEIGHT,
    blend_and_derive,
)
from tasks.render.rasterise.preparation import (
    BLOCK,
    LOG_OPACITY,
    OFFSET,
    SH,
    PreparedGaussians,
    prepare_gaussians,
)
from tasks.render.rasterise.projection import DEPTH, X, Y, project_gaussians
from tasks.render.rasterise.view import view_of
from tasks.scene.gaussians import Gaussians
from tasks.scene.spherical_harmonics import C0

COLOUR_STEP, OPACITY_STEP, DEPTH_STEP = 0.7, 0.5, 0.3
"""Shares of the full Gauss-Newton step taken per picture [1]."""
COLOUR_DAMPING, OPACITY_DAMPING = 1.0, 0.02
"""Evidence below which a colour or opacity changes less: pixels of average weight, squared display value [1]."""
DEPTH_SPREAD = 0.01
"""Standard uncertainty of the depth as a share of the depth; also the longest step [1]."""
DEPTH_DAMPING = 0.02
"""Weight of that uncertainty against the picture's evidence [1]."""
OPACITY_RANGE = (0.005, 0.99)
"""Opacities are kept within [1]."""
LONGEST_OPACITY_STEP = 0.5
"""Longest step of the logarithm of opacity [1]."""
FAINTEST = 0.02
"""Gaussians that end less opaque than this are dropped [1]."""
DARKEST = 0.01
"""Linear pixel value below which the display's response is taken as constant [1]."""

_COLOUR_STEP, _OPACITY_STEP, _OPACITY_DAMPING, _OPACITY_LIMIT, _DEPTH_STEP, _DEPTH_SPREAD, _DEPTH_DAMPING, _TWO = (
    np.float32(c)
    for c in (
        COLOUR_STEP / C0, OPACITY_STEP, OPACITY_DAMPING, LONGEST_OPACITY_STEP, DEPTH_STEP, DEPTH_SPREAD,
        DEPTH_DAMPING, 2,
    )
)  # fmt: skip
_FAINTEST, _DENSEST = (np.float32(np.log(c)) for c in OPACITY_RANGE)


@dataclass(frozen=True, kw_only=True)
class TrainingView:
    """One picture to be matched.

    Parameters
    ----------
    viewmat : float64 [4, 4] world to camera
    K : float64 [3, 3] intrinsics, pixel centres at +0.5 [px]
    radiance : float32 [H, W, 3] wanted linear light [1]
    clipped : bool [H, W] saturated pixels: any brighter value matches too
    gain : float32 [H, W] from radiance to linear pixel value [1]
    sky : float32 [H, W, 3] linear light behind the Gaussians [1]
    """

    viewmat: NDArray[np.float64]
    K: NDArray[np.float64]
    radiance: NDArray[np.float32]
    clipped: NDArray[np.bool_]
    gain: NDArray[np.float32]
    sky: NDArray[np.float32]


class _Camera(NamedTuple):
    """A view's camera as the kernel takes it: rotation [3, 3] [1], focal lengths and principal point [4] [px]."""

    rotation: NDArray[np.float32]
    lens: NDArray[np.float32]


def refine_gaussians(
    gaussians: Gaussians,
    rays: NDArray[np.floating],
    view: Callable[[int], TrainingView],
    count: int,
    passes: int,
) -> Gaussians:
    """Refine the Gaussians so that they reproduce the training pictures better.

    After each picture every Gaussian in it takes a damped Gauss-Newton step, with the off-diagonal of the
    normal matrix neglected, on the squared error of display values: its colour, its opacity and its depth
    along the ray on which stereo measured it. Road keeps its place and stays opaque. Pictures come in an
    order that jumps along the drive, the same in each pass.

    Parameters
    ----------
    gaussians : the cloud, with constant colours (K = 1)
    rays : [N, 3] world direction along which a Gaussian's depth is uncertain, per metre of depth [1]
    view : gives training picture 0 <= n < count
    count : number of training pictures [1]
    passes : how often all pictures are visited [1]

    Returns
    -------
    Gaussians, less those that became transparent, without `Gaussians.surroundings`
    """
    prepared = prepare_gaussians(gaussians)
    along = np.asarray(rays, dtype=np.float32)[prepared.order]
    fixed = np.isin(gaussians.class_id, ROAD_CLASSES)[prepared.order]
    for _ in range(passes):
        for n in bit_reversed_order(count):
            _correct_by_view(prepared, along, fixed, view(n))
    return _unpack_gaussians(gaussians, prepared)


def bit_reversed_order(count: int) -> list[int]:
    """Return 0 .. count - 1 in bit-reversed order, so that neighbours in the list are far apart."""
    bits = max(count - 1, 1).bit_length()
    return [n for k in range(1 << bits) if (n := int(f"{k:0{bits}b}"[::-1], 2)) < count]


def _correct_by_view(
    prepared: PreparedGaussians, along: NDArray[np.float32], fixed: NDArray[np.bool_], view: TrainingView
) -> None:
    """Take one step of all Gaussians that a picture shows, in place."""
    height, width = view.clipped.shape
    records, slots = project_gaussians(prepared, view_of(view.viewmat, view.K, width, height))
    weight = _display_response(view) ** 2
    target = np.where(view.clipped[..., None], -view.radiance, view.radiance)
    _, sums = blend_and_derive(records, target, weight, view.sky)
    lens = np.array((view.K[0, 0], view.K[1, 1], view.K[0, 2], view.K[1, 2]), dtype=np.float32)
    camera = _Camera(view.viewmat[:3, :3].astype(np.float32), lens)
    floor = np.float32(COLOUR_DAMPING * weight.mean())
    _step_gaussians(prepared.blocks, slots, records, sums, along, fixed, camera, floor)


@numba.njit(cache=True, nogil=True)
def _step_gaussians(blocks, slots, records, sums, along, fixed, camera, floor):  # type: ignore[no-untyped-def]
    rotation = camera.rotation
    fx, fy, cx, cy = camera.lens
    for i in range(len(slots)):
        block, lane = slots[i] // BLOCK, slots[i] % BLOCK
        evidence = max(sums[i, WEIGHT], floor)
        for c in range(3):
            blocks[block, SH + c, lane] += _COLOUR_STEP * sums[i, COLOUR + c] / evidence
        if fixed[slots[i]]:
            continue
        step = _OPACITY_STEP * sums[i, OPACITY] / (sums[i, OPACITY_SQUARE] + _OPACITY_DAMPING)
        opacity = blocks[block, LOG_OPACITY, lane] + min(max(step, -_OPACITY_LIMIT), _OPACITY_LIMIT)
        blocks[block, LOG_OPACITY, lane] = min(max(opacity, _FAINTEST), _DENSEST)
        # The splat's motion in the picture per metre of depth along its ray.
        z = records[i, DEPTH]
        ray = rotation @ along[slots[i]]
        du = (fx * ray[0] - (records[i, X] - cx) * ray[2]) / z
        dv = (fy * ray[1] - (records[i, Y] - cy) * ray[2]) / z
        gradient = sums[i, ALONG_X] * du + sums[i, ALONG_Y] * dv
        square = (
            sums[i, SQUARE_XX] * du * du + _TWO * sums[i, SQUARE_XY] * du * dv + sums[i, SQUARE_YY] * dv * dv
        )
        longest = _DEPTH_SPREAD * z
        step = _DEPTH_STEP * gradient / (square + _DEPTH_DAMPING / (longest * longest))
        step = min(max(step, -longest), longest)
        for c in range(3):
            blocks[block, OFFSET + c, lane] += step * along[slots[i], c]


def _display_response(view: TrainingView) -> NDArray[np.float32]:
    """Return the change of display value per change of radiance, at the local mean of the picture, [H, W]."""
    exposed = np.clip(cv2.blur(view.radiance.mean(axis=2), (5, 5)) * view.gain, DARKEST, 1)
    return (1.055 / 2.4 * exposed ** (1 / 2.4 - 1) * view.gain).astype(np.float32)


def _unpack_gaussians(gaussians: Gaussians, prepared: PreparedGaussians) -> Gaussians:
    """Return the cloud with the corrected planes of the prepared blocks, in its own order."""
    n = len(gaussians)
    planes = prepared.blocks.transpose(1, 0, 2).reshape(prepared.blocks.shape[1], -1)[:, :n]
    means, sh, opacities = gaussians.means.copy(), gaussians.sh.copy(), gaussians.opacities.copy()
    origins = np.repeat(prepared.origins, BLOCK, axis=0)[:n]
    means[prepared.order] = origins + planes[OFFSET : OFFSET + 3].T
    sh[prepared.order, 0] = planes[SH : SH + 3].T
    opacities[prepared.order] = np.exp(planes[LOG_OPACITY])
    kept = opacities >= FAINTEST
    refined = replace(gaussians, means=means, sh=sh, opacities=opacities, surroundings=None)
    names = ("means", "quats_wxyz", "scales", "opacities", "sh", "normals", "class_id")
    return replace(refined, **{name: getattr(refined, name)[kept] for name in names})
