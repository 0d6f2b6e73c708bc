"""Preparation of a cloud of Gaussians: the packed blocks that the rasteriser reads."""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from tasks.scene.gaussians import Gaussians, check_gaussians

BLOCK = 64
"""Gaussians per block: one block is culled, projected and shaded as a whole, one vector lane each."""

OFFSET, AXES, LOG_OPACITY, NORMAL, SURROUNDINGS, SH = 0, 3, 12, 13, 16, 18
"""First plane of each quantity inside a block; SH coefficient k of channel c is plane ``SH + 3 k + c``."""

_MORTON_BITS = 21
_NEVER_VISIBLE = -1e30
"""Logarithmic opacity of the padding in the last block [1]."""


@dataclass(frozen=True, kw_only=True)
class PreparedGaussians:
    """Gaussians along a Morton curve, in blocks of 64, one contiguous plane per quantity.

    Neighbours in space are neighbours in memory, so that whole blocks fall outside a view at once.

    Parameters
    ----------
    blocks : float32 [B, 18 + 3 K, 64] centre offset from the block's origin [m], local axes times
        standard deviation (axis-major) [m], natural logarithm of opacity [1], normal [1], surroundings [1], SH [1]
    origins : float64 [B, 3] middle of each block's bounding box, world frame [m]
    radii : float64 [B] distance from the origin to the furthest centre of the block [m]
    reach : float64 [B] largest standard deviation within the block [m]
    class_id : uint8 [64 B] `SemanticClass`
    order : int64 [N] index in the original cloud of each Gaussian along the curve
    corrects_bias : the surroundings are known, and splats are drawn without the painter's bias
    antialiased, display_encoded : carried over from `Gaussians`
    """

    blocks: NDArray[np.float32]
    origins: NDArray[np.float64]
    radii: NDArray[np.float64]
    reach: NDArray[np.float64]
    class_id: NDArray[np.uint8]
    order: NDArray[np.int64]
    corrects_bias: bool
    antialiased: bool
    display_encoded: bool

    def __len__(self) -> int:
        return len(self.order)


class _Cloud(NamedTuple):
    """The arrays of `Gaussians` as the kernel takes them, with logarithms of opacity [N] and SH as [N, 3 K]."""

    means: NDArray[np.float32]
    quats_wxyz: NDArray[np.float32]
    scales: NDArray[np.float32]
    log_opacities: NDArray[np.float64]
    normals: NDArray[np.float32]
    surroundings: NDArray[np.float32]
    sh: NDArray[np.float32]


def rotation_matrices(quats_wxyz: NDArray[np.floating]) -> NDArray[np.float64]:
    """Return the rotation matrices of quaternions, which are normalised first.

    Parameters
    ----------
    quats_wxyz : [N, 4] quaternions, not zero [1]

    Returns
    -------
    float64 [N, 3, 3] local axes as columns [1]
    """
    q = np.asarray(quats_wxyz, dtype=np.float64)
    w, x, y, z = (q / np.linalg.norm(q, axis=1, keepdims=True)).T
    rows = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )
    return np.moveaxis(np.array(rows), 2, 0)


def morton_order(means: NDArray[np.floating]) -> NDArray[np.int64]:
    """Return the indices that sort the points along a Morton curve; points in one cell keep their order.

    Parameters
    ----------
    means : [N, 3] points [m]

    Returns
    -------
    int64 [N] indices
    """
    if len(means) == 0:
        return np.zeros(0, dtype=np.int64)
    low = means.min(axis=0).astype(np.float64)
    extent = float((means.max(axis=0) - low).max()) or 1.0
    cells = ((means - low) * ((2**_MORTON_BITS - 1) / extent)).astype(np.uint64)
    code = np.zeros(len(means), dtype=np.uint64)
    for axis in range(3):
        code |= _spread_bits(cells[:, axis]) << np.uint64(axis)
    return np.argsort(code, kind="stable").astype(np.int64)


def _spread_bits(v: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """Put two zero bits between the 21 low bits of v."""
    for shift, mask in (
        (32, 0x1F00000000FFFF),
        (16, 0x1F0000FF0000FF),
        (8, 0x100F00F00F00F00F),
        (4, 0x10C30C30C30C30C3),
        (2, 0x1249249249249249),
    ):
        v = (v | (v << np.uint64(shift))) & np.uint64(mask)
    return v


def prepare_gaussians(gaussians: Gaussians) -> PreparedGaussians:
    """Check, order and pack a cloud once; every view of it is then rasterised from the result.

    Parameters
    ----------
    gaussians : the cloud, world frame

    Returns
    -------
    PreparedGaussians

    Raises
    ------
    InputError
        An array has a wrong shape, a NaN or a value out of range.
    """
    check_gaussians(gaussians)
    order = morton_order(gaussians.means)
    n, block_count = len(order), -(-len(order) // BLOCK)
    members = np.empty((block_count, BLOCK), dtype=np.int64)
    members.ravel()[:n] = order
    members.ravel()[n:] = order[-1:]
    blocks = np.empty((block_count, SH + 3 * gaussians.sh.shape[1], BLOCK), dtype=np.float32)
    origins, radii, reach = np.empty((block_count, 3)), np.empty(block_count), np.empty(block_count)
    with_surroundings = gaussians.surroundings is not None
    cloud = _Cloud(
        means=np.ascontiguousarray(gaussians.means),
        quats_wxyz=np.ascontiguousarray(gaussians.quats_wxyz),
        scales=np.ascontiguousarray(gaussians.scales),
        log_opacities=np.log(gaussians.opacities.astype(np.float64)),
        normals=np.ascontiguousarray(gaussians.normals),
        surroundings=np.ascontiguousarray(gaussians.surroundings)
        if gaussians.surroundings is not None
        else np.empty((0, 2), dtype=np.float32),
        sh=np.ascontiguousarray(gaussians.sh).reshape(n, 3 * gaussians.sh.shape[1]),
    )
    _pack_blocks(cloud, members, with_surroundings, blocks, origins, radii, reach)
    if n % BLOCK:
        blocks[-1, LOG_OPACITY, n % BLOCK :] = _NEVER_VISIBLE
    return PreparedGaussians(
        blocks=blocks,
        origins=origins,
        radii=radii,
        reach=reach,
        class_id=gaussians.class_id[members].ravel(),
        order=order,
        corrects_bias=gaussians.surroundings is not None,
        antialiased=gaussians.antialiased,
        display_encoded=gaussians.display_encoded,
    )


def recolour_prepared(prepared: PreparedGaussians, sh: NDArray[np.float32]) -> PreparedGaussians:
    """Return a prepared cloud with other colours.

    Parameters
    ----------
    prepared : the cloud
    sh : float32 [N, K, 3] spherical harmonics, in the order of the original cloud [1]
    """
    blocks = prepared.blocks.copy()
    planes = np.zeros((len(blocks) * BLOCK, blocks.shape[1] - SH), np.float32)
    planes[: len(prepared)] = sh.reshape(len(sh), -1)[prepared.order]
    blocks[:, SH:] = planes.reshape(len(blocks), BLOCK, -1).swapaxes(1, 2)
    return replace(prepared, blocks=blocks)


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _pack_blocks(cloud, members, with_surroundings, blocks, origins, radii, reach):  # type: ignore[no-untyped-def]
    """Fill the blocks [B, P, 64] with the members [B, 64], and their origins, radii and reach."""
    means, quats, scales, log_opacities, normals, surroundings, sh = cloud
    for b in range(len(members)):
        block = blocks[b]
        for axis in range(3):
            low = high = np.float64(means[members[b, 0], axis])
            for l in range(BLOCK):
                at = np.float64(means[members[b, l], axis])
                low, high = min(low, at), max(high, at)
            origins[b, axis] = (low + high) / 2
        furthest = largest = 0.0
        for l in range(BLOCK):
            i = members[b, l]
            square = 0.0
            for axis in range(3):
                offset = means[i, axis] - origins[b, axis]
                square += offset * offset
                block[OFFSET + axis, l] = offset
                block[NORMAL + axis, l] = normals[i, axis]
            furthest = max(furthest, square)
            w, x, y, z = quats[i]
            length = np.sqrt(np.float64(w) * w + np.float64(x) * x + np.float64(y) * y + np.float64(z) * z)
            w, x, y, z = w / length, x / length, y / length, z / length
            turn = (
                (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
                (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
                (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
            )
            for k in range(3):
                size = np.float64(scales[i, k])
                largest = max(largest, size)
                for axis in range(3):
                    block[AXES + 3 * k + axis, l] = turn[axis][k] * size
            block[LOG_OPACITY, l] = log_opacities[i]
            if with_surroundings:
                block[SURROUNDINGS, l], block[SURROUNDINGS + 1, l] = surroundings[i]
            for plane in range(sh.shape[1]):
                block[SH + plane, l] = sh[i, plane]
        radii[b], reach[b] = np.sqrt(furthest), largest
