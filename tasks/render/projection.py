"""EWA projection of prepared Gaussians: from blocks in the world to splat records in the picture.

Zwicker et al. 2002 (doi:10.1109/TVCG.2002.1021576) with the rules of gsplat (arXiv:2409.06765): 0.3 px^2
added to the picture covariance without compensation, the Jacobian's ray clamped to 1.3 times the field
of view, nothing below an opacity of 1/255. A splat is stored so that along a picture row y its opacity is

    alpha(x) = exp(log_opacity - row_falloff dy^2 - column_falloff (x - x0 - slope dy)^2),  dy = y - y0,

a sum of squares, which unlike the usual conic cannot cancel for long thin splats.
"""

from dataclasses import dataclass

import numba
import numpy as np
from numpy.typing import NDArray

from tasks.errors import InputError
from tasks.render.preparation import AXES, BLOCK, LOG_OPACITY, NORMAL, OFFSET, SH, PreparedGaussians
from tasks.render.spherical_harmonics import shade_lanes

NEAR = 0.05
"""Nothing closer than this is drawn [m]."""
LOW_PASS = 0.3
"""Variance added to both picture axes, for a pixel's own extent [px^2]."""
RAY_MARGIN = 0.3
"""The Jacobian is taken at most this share of the half field of view outside the picture [1]."""
LOG_CUT = float(np.log(1 / 255))
"""Logarithm of the opacity below which a splat is not drawn [1]."""

X, Y, SLOPE, COLUMN_FALLOFF, ROW_FALLOFF, LOG_ALPHA, HALF_WIDTH, HALF_HEIGHT = range(8)
DEPTH, RED, GREEN, BLUE, NORMAL_X, NORMAL_Y, NORMAL_Z, CLASS = range(8, 16)
RECORD = 16
"""Columns of a splat record: one cache line of float32."""

_LOW_PASS, _LOW_PASS_DET = np.float32(LOW_PASS), np.float32(LOW_PASS**2)
_NEAR, _LOG_CUT = np.float32(NEAR), np.float32(LOG_CUT)
_ZERO, _HALF, _ONE, _TWO = (np.float32(c) for c in (0, 0.5, 1, 2))

# Planes of one block's scratch, each BLOCK floats: the block's own geometry comes first.
_RECORDS = SH * BLOCK
_DIRECTION = _RECORDS + RECORD * BLOCK
_BASIS = _DIRECTION + 3 * BLOCK
_VISIBLE = _BASIS + 16 * BLOCK
_SCRATCH = _VISIBLE + BLOCK


@dataclass(frozen=True, kw_only=True)
class View:
    """A pinhole camera as the kernels want it.

    Parameters
    ----------
    viewmat : float64 [4, 4] world to camera, x right, y down, z forward
    K : float64 [3, 3] intrinsics, pixel centres at +0.5 [px]
    width, height : picture size [px]
    """

    viewmat: NDArray[np.float64]
    K: NDArray[np.float64]
    width: int
    height: int

    @property
    def ray_limits(self) -> NDArray[np.float64]:
        """Lowest and highest x/z, then y/z, at which the Jacobian is taken [1]."""
        f, c = np.array((self.K[0, 0], self.K[1, 1])), self.K[:2, 2]
        size = np.array((self.width, self.height))
        margin = RAY_MARGIN * 0.5 * size / f
        return np.column_stack((-c / f - margin, (size - c) / f + margin)).ravel()


def view_of(viewmat: NDArray[np.floating], K: NDArray[np.floating], width: int, height: int) -> View:
    """The camera, checked.

    Raises
    ------
    InputError
        A matrix has the wrong shape or a NaN, a focal length or the picture size is not positive.
    """
    viewmat, K = np.asarray(viewmat, dtype=np.float64), np.asarray(K, dtype=np.float64)
    problems = []
    for name, matrix, shape in (("viewmat", viewmat, (4, 4)), ("K", K, (3, 3))):
        if matrix.shape != shape or not np.isfinite(matrix).all():
            problems.append(f"camera: {name} must be a finite {shape} matrix; it is {matrix.tolist()}")
    if not problems and not (K[0, 0] > 0 and K[1, 1] > 0):
        problems.append(f"camera: focal lengths must be positive; they are {K[0, 0]} and {K[1, 1]}")
    if width < 1 or height < 1:
        problems.append(f"camera: the picture must have at least one pixel; its size is {width} x {height}")
    if problems:
        raise InputError(problems)
    return View(viewmat=viewmat, K=K, width=int(width), height=int(height))


def visible_blocks(prepared: PreparedGaussians, view: View) -> NDArray[np.int64]:
    """Blocks of which some Gaussian may touch the picture; never leaves out one that does.

    A splat's half width is at most 3.33 sqrt(variance), and its variance at most
    (f sigma / z)^2 (1 + ray^2) + 0.3, so "outside one edge" is a half-space of camera coordinates.
    """
    R, t = view.viewmat[:3, :3], view.viewmat[:3, 3]
    x, y, z = (prepared.origins @ R.T + t).T
    keep = z + prepared.radii >= NEAR
    extent = np.sqrt(-2 * LOG_CUT)
    blur = extent * np.sqrt(LOW_PASS) + 1.0
    limits = view.ray_limits
    for p, f, c, size, ray in ((x, 0, 0, view.width, limits[:2]), (y, 1, 1, view.height, limits[2:])):
        focal, centre = view.K[f, f], view.K[c, 2]
        inflation = extent * prepared.reach * focal * np.sqrt(1 + (ray**2).max())
        for sign, edge in ((1.0, size - centre + blur), (-1.0, centre + blur)):
            distance = sign * focal * p - edge * z
            keep &= distance <= inflation + prepared.radii * np.hypot(focal, edge) + 1e-3 * focal
    return np.flatnonzero(keep)


def project(prepared: PreparedGaussians, view: View) -> tuple[NDArray[np.float32], NDArray[np.int64]]:
    """Splat records of the Gaussians that touch the picture, along the Morton curve.

    Returns
    -------
    records : float32 [V, 16] columns as named in this module [px, m, 1]
    slots : int64 [V] place of each along the curve [1]
    """
    wanted = visible_blocks(prepared, view)
    R, t = view.viewmat[:3, :3], view.viewmat[:3, 3]
    eye = -R.T @ t
    origins = prepared.origins[wanted]
    camera = np.concatenate((
        R.ravel(), (view.K[0, 0], view.K[1, 1], view.K[0, 2], view.K[1, 2]), view.ray_limits,
        (view.width, view.height),
    )).astype(np.float32)  # fmt: skip
    records = np.empty((len(wanted) * BLOCK, RECORD), dtype=np.float32)
    slots = np.empty(len(records), dtype=np.int64)
    count = _project_blocks(
        prepared.blocks, prepared.class_id, wanted,
        (origins @ R.T + t).astype(np.float32), (origins - eye).astype(np.float32), camera, records, slots,
    )  # fmt: skip
    return records[:count], slots[:count]


@numba.njit(cache=True, nogil=True)
def _project_blocks(blocks, class_id, wanted, origin_camera, origin_eye, camera, records, slots):  # type: ignore[no-untyped-def]
    s = np.empty(_SCRATCH, dtype=np.float32)
    sh_count = (blocks.shape[1] - SH) // 3
    written = 0
    for i in range(len(wanted)):
        block = blocks[wanted[i]]
        for plane in range(SH):
            for l in range(BLOCK):
                s[plane * BLOCK + l] = block[plane, l]
        if _project_lanes(s, camera, origin_camera[i, 0], origin_camera[i, 1], origin_camera[i, 2]) == _ZERO:
            continue
        _face_camera(s, origin_eye[i, 0], origin_eye[i, 1], origin_eye[i, 2])
        shade_lanes(s, _DIRECTION, _BASIS, _RECORDS + RED * BLOCK, block, SH, sh_count, BLOCK)
        first = wanted[i] * BLOCK
        for l in range(BLOCK):
            if s[_VISIBLE + l] > _ZERO:
                for column in range(CLASS):
                    records[written, column] = s[_RECORDS + column * BLOCK + l]
                records[written, CLASS] = np.float32(class_id[first + l])
                slots[written] = first + l
                written += 1
    return written


@numba.njit(cache=True, nogil=True)
def _project_lanes(s, camera, ox, oy, oz):  # type: ignore[no-untyped-def]
    r00, r01, r02, r10, r11, r12, r20, r21, r22 = camera[:9]
    fx, fy, cx, cy, x_low, x_high, y_low, y_high, width, height = camera[9:19]
    for l in range(BLOCK):
        dx, dy, dz = s[OFFSET * BLOCK + l], s[(OFFSET + 1) * BLOCK + l], s[(OFFSET + 2) * BLOCK + l]
        x = r00 * dx + r01 * dy + r02 * dz + ox
        y = r10 * dx + r11 * dy + r12 * dz + oy
        z = r20 * dx + r21 * dy + r22 * dz + oz
        inverse = _ONE / z
        ray_x, ray_y = x * inverse, y * inverse
        jx, jy = min(max(ray_x, x_low), x_high), min(max(ray_y, y_low), y_high)
        focal_x, focal_y = fx * inverse, fy * inverse

        ax, ay, az = s[AXES * BLOCK + l], s[(AXES + 1) * BLOCK + l], s[(AXES + 2) * BLOCK + l]
        w = r20 * ax + r21 * ay + r22 * az
        p0 = focal_x * (r00 * ax + r01 * ay + r02 * az - jx * w)
        q0 = focal_y * (r10 * ax + r11 * ay + r12 * az - jy * w)
        ax, ay, az = s[(AXES + 3) * BLOCK + l], s[(AXES + 4) * BLOCK + l], s[(AXES + 5) * BLOCK + l]
        w = r20 * ax + r21 * ay + r22 * az
        p1 = focal_x * (r00 * ax + r01 * ay + r02 * az - jx * w)
        q1 = focal_y * (r10 * ax + r11 * ay + r12 * az - jy * w)
        ax, ay, az = s[(AXES + 6) * BLOCK + l], s[(AXES + 7) * BLOCK + l], s[(AXES + 8) * BLOCK + l]
        w = r20 * ax + r21 * ay + r22 * az
        p2 = focal_x * (r00 * ax + r01 * ay + r02 * az - jx * w)
        q2 = focal_y * (r10 * ax + r11 * ay + r12 * az - jy * w)

        pp, qq = p0 * p0 + p1 * p1 + p2 * p2, q0 * q0 + q1 * q1 + q2 * q2
        pq = p0 * q0 + p1 * q1 + p2 * q2
        # det(M M^T + 0.3 I) by Cauchy-Binet: only positive terms, so nothing cancels.
        m01, m02, m12 = p0 * q1 - p1 * q0, p0 * q2 - p2 * q0, p1 * q2 - p2 * q1
        det = m01 * m01 + m02 * m02 + m12 * m12 + _LOW_PASS * (pp + qq) + _LOW_PASS_DET
        xx, yy = pp + _LOW_PASS, qq + _LOW_PASS
        log_alpha = s[LOG_OPACITY * BLOCK + l]
        reach = _TWO * max(log_alpha - _LOG_CUT, _ZERO)
        half_width, half_height = np.sqrt(reach * xx), np.sqrt(reach * yy)
        u, v = fx * ray_x + cx, fy * ray_y + cy
        s[_RECORDS + X * BLOCK + l] = u
        s[_RECORDS + Y * BLOCK + l] = v
        s[_RECORDS + SLOPE * BLOCK + l] = pq / yy
        s[_RECORDS + COLUMN_FALLOFF * BLOCK + l] = _HALF * yy / det
        s[_RECORDS + ROW_FALLOFF * BLOCK + l] = _HALF / yy
        s[_RECORDS + LOG_ALPHA * BLOCK + l] = log_alpha
        s[_RECORDS + HALF_WIDTH * BLOCK + l] = half_width
        s[_RECORDS + HALF_HEIGHT * BLOCK + l] = half_height
        s[_RECORDS + DEPTH * BLOCK + l] = z
        # Whether the splat's box holds a pixel centre of the picture.
        left, right = (
            max(np.ceil(u - half_width - _HALF), _ZERO),
            min(np.floor(u + half_width - _HALF), width - _ONE),
        )
        top, bottom = (
            max(np.ceil(v - half_height - _HALF), _ZERO),
            min(np.floor(v + half_height - _HALF), height - _ONE),
        )
        inside = (left <= right) & (top <= bottom) & (z >= _NEAR) & (reach > _ZERO)
        s[_VISIBLE + l] = _ONE if inside else _ZERO
    total = _ZERO
    for l in range(BLOCK):
        total += s[_VISIBLE + l]
    return total


@numba.njit(cache=True, nogil=True)
def _face_camera(s, ox, oy, oz):  # type: ignore[no-untyped-def]
    """Unit viewing directions, and normals turned against them."""
    for l in range(BLOCK):
        x = s[OFFSET * BLOCK + l] + ox
        y = s[(OFFSET + 1) * BLOCK + l] + oy
        z = s[(OFFSET + 2) * BLOCK + l] + oz
        inverse = _ONE / np.sqrt(x * x + y * y + z * z)
        nx, ny, nz = s[NORMAL * BLOCK + l], s[(NORMAL + 1) * BLOCK + l], s[(NORMAL + 2) * BLOCK + l]
        sign = -_ONE if nx * x + ny * y + nz * z > _ZERO else _ONE
        s[_DIRECTION + l] = x * inverse
        s[_DIRECTION + BLOCK + l] = y * inverse
        s[_DIRECTION + 2 * BLOCK + l] = z * inverse
        s[_RECORDS + NORMAL_X * BLOCK + l] = sign * nx
        s[_RECORDS + NORMAL_Y * BLOCK + l] = sign * ny
        s[_RECORDS + NORMAL_Z * BLOCK + l] = sign * nz
