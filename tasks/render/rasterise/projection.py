"""EWA projection of prepared Gaussians: from blocks in the world to splat records in the picture.

Zwicker et al. 2002 (doi:10.1109/TVCG.2002.1021576) with the rules of gsplat (arXiv:2409.06765): a pixel's
variance added to the picture covariance, the Jacobian's ray clamped to 1.3 times the field of view, nothing
below an opacity of 1/255. Antialiased clouds (`Gaussians.antialiased`) lose as much opacity as they gain area;
without that, discs smaller than a pixel grow, near ones hide far ones, and the road moves relative to the car.
A splat is stored so that along a picture row y its opacity is

    alpha(x) = exp(log_opacity - row_falloff dy^2 - column_falloff (x - x0 - slope dy)^2),  dy = y - y0,

a sum of squares, which unlike the usual conic cannot cancel for long thin splats.
"""

from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from tasks.render.rasterise.painters_bias import LARGEST_SHIFT, interpolate_shift
from tasks.render.rasterise.preparation import (
    AXES,
    BLOCK,
    LOG_OPACITY,
    NORMAL,
    OFFSET,
    SH,
    SURROUNDINGS,
    PreparedGaussians,
)
from tasks.render.rasterise.shading import shade_lanes
from tasks.render.rasterise.view import View

NEAR = 0.05
"""Nothing closer than this is drawn [m]."""
CLASSIC_LOW_PASS, ANTIALIASED_LOW_PASS = 0.3, 0.1
"""Variance added to both picture axes, for a pixel's own extent [px^2]: in the INRIA code (Kerbl et al. 2023,
doi:10.1145/3592433), and near that of the pixel itself, 1/12 (Yu et al. 2024, doi:10.1109/CVPR52733.2024.01839)."""
LOG_CUT = float(np.log(1 / 255))
"""Logarithm of the opacity below which a splat is not drawn [1]."""

X, Y, SLOPE, COLUMN_FALLOFF, ROW_FALLOFF, LOG_ALPHA, DISTANCE, HALF_HEIGHT = range(8)
DEPTH, RED, GREEN, BLUE, NORMAL_X, NORMAL_Y, NORMAL_Z, CLASS = range(8, 16)
RECORD = 16
"""Columns of a splat record: one cache line of float32. ``CLASS`` is the class, and `CODES` times the number of the
body. ``DISTANCE`` is from the eye to the splat's plane along its normal [m], negative as it faces the eye: at a pixel,
the camera z of that plane is ``distance / (normal . ray)``."""

CODES = 256
"""Classes that a code of ``CLASS`` can hold: with numbers below 2^16 it is exact in single precision."""

NOTHING = np.empty((0, RECORD), np.float32)
"""No records."""
_EDGE_ON = np.float32(1e-12)
_NEAR, _LOG_CUT = np.float32(NEAR), np.float32(LOG_CUT)
_LARGEST_DET = np.float32(1e37)
_FACING = np.float32(1e-20)
_ZERO, _HALF, _ONE, _TWO = (np.float32(c) for c in (0, 0.5, 1, 2))

# A block's geometry and the records made from it, plane after plane in one flat scratch array: with offsets
# known at compile time the compiler sees that nothing overlaps, and works on whole vector registers.
_RECORD = SH * BLOCK


class _Cloud(NamedTuple):
    """Arrays and rules of a `PreparedGaussians`, as the kernel takes them."""

    blocks: NDArray[np.float32]
    class_id: NDArray[np.uint8]
    antialiased: bool
    corrects_bias: bool


class _Camera(NamedTuple):
    """A `View` as the kernel takes it: rotation [3, 3], focal lengths, principal point and ray limits [8], and size."""

    rotation: NDArray[np.float32]
    lens: NDArray[np.float32]
    width: np.float32
    height: np.float32


def low_pass(antialiased: bool) -> float:
    """Return the variance added to both picture axes [px^2]."""
    return ANTIALIASED_LOW_PASS if antialiased else CLASSIC_LOW_PASS


def visible_blocks(prepared: PreparedGaussians, view: View) -> NDArray[np.int64]:
    """Return the blocks that may touch the picture, among them all that do.

    A splat's half width is at most 3.33 sqrt(variance), it is moved by at most 2.5, and its variance is at most
    (f sigma / z)^2 (1 + ray^2) plus the low pass, so "outside one edge" is a half-space of camera coordinates.
    """
    x, y, z = view.to_camera(prepared.origins).T
    keep = z + prepared.radii >= NEAR
    extent = np.sqrt(-2 * LOG_CUT) + (LARGEST_SHIFT if prepared.corrects_bias else 0.0)
    blur = extent * np.sqrt(low_pass(prepared.antialiased)) + 1.0
    limits = view.ray_limits
    for p, f, c, size, ray in ((x, 0, 0, view.width, limits[:2]), (y, 1, 1, view.height, limits[2:])):
        focal, centre = view.K[f, f], view.K[c, 2]
        inflation = extent * prepared.reach * focal * np.sqrt(1 + (ray**2).max())
        for sign, edge in ((1.0, size - centre + blur), (-1.0, centre + blur)):
            distance = sign * focal * p - edge * z
            keep &= distance <= inflation + prepared.radii * np.hypot(focal, edge) + 1e-3 * focal
    return np.flatnonzero(keep)


def project_gaussians(
    prepared: PreparedGaussians, view: View, before: NDArray[np.float32] = NOTHING
) -> tuple[NDArray[np.float32], NDArray[np.int64]]:
    """Return the splat records of the Gaussians that touch the picture, along the Morton curve.

    Parameters
    ----------
    prepared : the cloud
    view : the camera
    before : float32 [P, 16] records of other clouds, which come first; they have no slots

    Returns
    -------
    records : float32 [P + V, 16] columns as named in this module, the first at a cache line's start [px, m, 1]
    slots : int64 [V] place of each along the curve [1]
    """
    wanted = visible_blocks(prepared, view)
    rotation = view.viewmat[:3, :3].astype(np.float32)
    lens = np.array(
        (view.K[0, 0], view.K[1, 1], view.K[0, 2], view.K[1, 2], *view.ray_limits), dtype=np.float32
    )
    cloud = _Cloud(prepared.blocks, prepared.class_id, prepared.antialiased, prepared.corrects_bias)
    camera = _Camera(rotation, lens, np.float32(view.width), np.float32(view.height))
    from_eye = prepared.origins[wanted] - view.eye
    first = len(before)
    count = first + len(wanted) * BLOCK
    room = np.empty((count + 1) * RECORD, dtype=np.float32)
    line = -room.ctypes.data // room.itemsize % RECORD
    records = room[line : line + count * RECORD].reshape(-1, RECORD)
    records[:first] = before
    slots = np.empty(count - first, dtype=np.int64)
    in_camera = view.to_camera(prepared.origins[wanted]).astype(np.float32)
    count = _project_blocks(
        cloud, wanted, in_camera, from_eye.astype(np.float32), camera, records[first:], slots
    )
    return records[: first + count], slots[:count]


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _project_blocks(cloud, wanted, in_camera, from_eye, camera, records, slots):  # type: ignore[no-untyped-def]
    blocks, class_id, antialiased, corrects_bias = cloud
    rotation, lens, width, height = camera
    s = np.empty((SH + RECORD) * BLOCK, dtype=np.float32)
    directions, colours = np.empty(3 * BLOCK, dtype=np.float32), s[_RECORD + RED * BLOCK :]
    visible = np.empty(BLOCK, dtype=np.bool_)
    written = 0
    for i in range(len(wanted)):
        block = blocks[wanted[i]]
        for plane in range(SH):
            for l in range(BLOCK):
                s[plane * BLOCK + l] = block[plane, l]
        _project_lanes(s, antialiased, in_camera[i], rotation, lens, visible)
        if corrects_bias:
            _move_nearer(s, antialiased, rotation, lens)
        if not _find_visible(s, width, height, visible):
            continue
        _face_camera(s, from_eye[i], directions)
        shade_lanes(directions, block, colours)
        first = wanted[i] * BLOCK
        for l in range(BLOCK):
            if visible[l]:
                for column in range(CLASS):
                    records[written, column] = s[_RECORD + column * BLOCK + l]
                records[written, CLASS] = np.float32(class_id[first + l])
                slots[written] = first + l
                written += 1
    return written


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _project_lanes(s, antialiased, origin, rotation, lens, drawable):  # type: ignore[no-untyped-def]
    """Fill the records but for planes and colours; mark the Gaussians in front whose splats single precision holds."""
    r00, r01, r02 = rotation[0]
    r10, r11, r12 = rotation[1]
    r20, r21, r22 = rotation[2]
    fx, fy, cx, cy, x_low, x_high, y_low, y_high = lens
    ox, oy, oz = origin
    blur = np.float32(ANTIALIASED_LOW_PASS if antialiased else CLASSIC_LOW_PASS)
    for l in range(BLOCK):
        dx, dy, dz = s[OFFSET * BLOCK + l], s[(OFFSET + 1) * BLOCK + l], s[(OFFSET + 2) * BLOCK + l]
        x = r00 * dx + r01 * dy + r02 * dz + ox
        y = r10 * dx + r11 * dy + r12 * dz + oy
        z = r20 * dx + r21 * dy + r22 * dz + oz
        inverse = _ONE / z
        ray_x, ray_y = x * inverse, y * inverse
        jx, jy = min(max(ray_x, x_low), x_high), min(max(ray_y, y_low), y_high)
        focal_x, focal_y = fx * inverse, fy * inverse

        # Rows of M = J R A, where A's columns are the scaled axes.
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
        # det(M M^T + blur I) by Cauchy-Binet: only positive terms, so nothing cancels.
        m01, m02, m12 = p0 * q1 - p1 * q0, p0 * q2 - p2 * q0, p1 * q2 - p2 * q1
        sharp_det = m01 * m01 + m02 * m02 + m12 * m12
        det = sharp_det + blur * (pp + qq) + blur * blur
        yy = qq + blur
        log_alpha = s[LOG_OPACITY * BLOCK + l]
        if antialiased:
            log_alpha += _HALF * np.log(max(sharp_det / det, _EDGE_ON))
        reach = _TWO * max(log_alpha - _LOG_CUT, _ZERO)
        s[_RECORD + X * BLOCK + l] = fx * ray_x + cx
        s[_RECORD + Y * BLOCK + l] = fy * ray_y + cy
        s[_RECORD + SLOPE * BLOCK + l] = pq / yy
        s[_RECORD + COLUMN_FALLOFF * BLOCK + l] = _HALF * yy / det
        s[_RECORD + ROW_FALLOFF * BLOCK + l] = _HALF / yy
        s[_RECORD + LOG_ALPHA * BLOCK + l] = log_alpha
        s[_RECORD + HALF_HEIGHT * BLOCK + l] = np.sqrt(reach * yy)
        s[_RECORD + DEPTH * BLOCK + l] = z
        drawable[l] = (z >= _NEAR) & (reach > _ZERO) & (det < _LARGEST_DET)


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _move_nearer(s, antialiased, rotation, lens):  # type: ignore[no-untyped-def]
    """Undo the painter's bias: move every splat along its surface by its shift."""
    r00, r01, r02 = rotation[0]
    r10, r11, r12 = rotation[1]
    r20, r21, r22 = rotation[2]
    fx, fy, cx, cy = lens[0], lens[1], lens[2], lens[3]
    blur = np.float32(ANTIALIASED_LOW_PASS if antialiased else CLASSIC_LOW_PASS)
    for l in range(BLOCK):
        nx, ny, nz = s[NORMAL * BLOCK + l], s[(NORMAL + 1) * BLOCK + l], s[(NORMAL + 2) * BLOCK + l]
        u, v = s[_RECORD + X * BLOCK + l], s[_RECORD + Y * BLOCK + l]
        # Inverse depth on the disc's plane is proportional to a (u - cx) + b (v - cy) + c.
        a, b = (r00 * nx + r01 * ny + r02 * nz) / fx, (r10 * nx + r11 * ny + r12 * nz) / fy
        slant = a * (u - cx) + b * (v - cy) + (r20 * nx + r21 * ny + r22 * nz)
        # The covariance again, as a sum of squares: in a row, and from row to row along the slope.
        within = _HALF / s[_RECORD + COLUMN_FALLOFF * BLOCK + l]
        across = _HALF / s[_RECORD + ROW_FALLOFF * BLOCK + l]
        slope = s[_RECORD + SLOPE * BLOCK + l]
        down = a * slope + b
        along_y = across * down
        along_x = within * a + slope * along_y
        # Variances along the gradient, times its square: of the splat, of the pixel in it, of the neighbours.
        own = max(_FACING, within * a * a + across * down * down)
        pixel = blur * (a * a + b * b)
        size = s[(SURROUNDINGS + 1) * BLOCK + l]
        neighbours = max(size * size * (own - pixel) + pixel, _FACING)
        closeness = np.sqrt(own) / max(abs(slant), _FACING) * (_ONE - pixel / own)
        way = interpolate_shift(s[SURROUNDINGS * BLOCK + l], np.sqrt(own / neighbours), closeness) / np.sqrt(
            own
        )
        way = way if slant > _ZERO else -way
        s[_RECORD + X * BLOCK + l] = u + way * along_x
        s[_RECORD + Y * BLOCK + l] = v + way * along_y


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _find_visible(s, width, height, visible):  # type: ignore[no-untyped-def]
    """Keep the drawable splats whose box holds a pixel centre of the picture; return whether any is left."""
    for l in range(BLOCK):
        u, v = s[_RECORD + X * BLOCK + l], s[_RECORD + Y * BLOCK + l]
        slope, half_height = s[_RECORD + SLOPE * BLOCK + l], s[_RECORD + HALF_HEIGHT * BLOCK + l]
        # half_height^2 = reach yy; half_width^2 = reach xx
        share = s[_RECORD + ROW_FALLOFF * BLOCK + l] / s[_RECORD + COLUMN_FALLOFF * BLOCK + l]
        half_width = half_height * np.sqrt(share + slope * slope)
        left, right = np.ceil(u - half_width - _HALF), np.floor(u + half_width - _HALF)
        top, bottom = np.ceil(v - half_height - _HALF), np.floor(v + half_height - _HALF)
        across = max(left, _ZERO) <= min(right, width - _ONE)
        down = max(top, _ZERO) <= min(bottom, height - _ONE)
        visible[l] &= across & down
    count = 0
    for l in range(BLOCK):
        count += visible[l]
    return count > 0


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _face_camera(s, from_eye, directions):  # type: ignore[no-untyped-def]
    """Compute unit viewing directions, and turn the planes of the splats against them."""
    ox, oy, oz = from_eye
    for l in range(BLOCK):
        x = s[OFFSET * BLOCK + l] + ox
        y = s[(OFFSET + 1) * BLOCK + l] + oy
        z = s[(OFFSET + 2) * BLOCK + l] + oz
        nx, ny, nz = s[NORMAL * BLOCK + l], s[(NORMAL + 1) * BLOCK + l], s[(NORMAL + 2) * BLOCK + l]
        inverse = _ONE / np.sqrt(x * x + y * y + z * z)
        distance = nx * x + ny * y + nz * z
        sign = -_ONE if distance > _ZERO else _ONE
        directions[l] = x * inverse
        directions[BLOCK + l] = y * inverse
        directions[2 * BLOCK + l] = z * inverse
        s[_RECORD + DISTANCE * BLOCK + l] = sign * distance
        s[_RECORD + NORMAL_X * BLOCK + l] = sign * nx
        s[_RECORD + NORMAL_Y * BLOCK + l] = sign * ny
        s[_RECORD + NORMAL_Z * BLOCK + l] = sign * nz
