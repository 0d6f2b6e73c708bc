"""A ray-cast street with exact depth: a textured plane between two textured walls, under an empty sky.

It shares no code with the project's renderer, so that the judges are measured against a truth
that nothing else here produced.
"""

from dataclasses import dataclass
from typing import TypedDict, Unpack

import numba
import numpy as np
from numpy.typing import NDArray

WALL_DISTANCE, WALL_HEIGHT, FAR = 6.0, 7.0, 400.0
TEXELS_PER_METRE = 64.0
SKY, ROAD, BUILDING = 0, 1, 5


@dataclass(frozen=True, kw_only=True)
class Clip:
    """Frames with their truth; `pitch` nose-down positive [rad], `station` and `heave` [m]."""

    frames: NDArray[np.uint8]
    depth: NDArray[np.float32]
    class_id: NDArray[np.uint8]
    K: NDArray[np.float64]
    T_rig_camera: NDArray[np.float64]
    T_world_rig: NDArray[np.float64]
    pitch: NDArray[np.float64]
    heave: NDArray[np.float64]
    station: NDArray[np.float64]


def camera_matrix(width: int = 480, height: int = 320, focal: float = 400.0) -> NDArray[np.float64]:
    return np.array([[focal, 0, (width - 1) / 2], [0, focal, (height - 1) / 2], [0, 0, 1.0]])


def make_mount(x: float = -0.6, z: float = 1.4, tilt: float = np.deg2rad(3.0)) -> NDArray[np.float64]:
    """T_rig_camera of a camera above the rig origin, looking ahead and `tilt` down."""
    c, s = np.cos(tilt), np.sin(tilt)
    T = np.eye(4)
    T[:3, :3] = np.array([[0, -s, c], [-1, 0, 0], [0, -c, -s]])
    T[:3, 3] = x, 0.0, z
    return T


def rig_poses(
    station: NDArray[np.float64],
    heave: NDArray[np.float64],
    pitch: NDArray[np.float64],
    curvature: float = 0.0,
) -> NDArray[np.float64]:
    """T_world_rig [F, 4, 4] on a level arc of constant `curvature` [1/m], left positive."""
    heading = curvature * station
    T = np.tile(np.eye(4), (len(station), 1, 1))
    c, s, ch, sh = np.cos(pitch), np.sin(pitch), np.cos(heading), np.sin(heading)
    T[:, :3, 0] = np.stack([ch * c, sh * c, -s], axis=-1)
    T[:, :3, 1] = np.stack([-sh, ch, 0 * ch], axis=-1)
    T[:, :3, 2] = np.stack([ch * s, sh * s, c], axis=-1)
    along = station if curvature == 0.0 else np.sin(heading) / curvature
    aside = 0 * station if curvature == 0.0 else (1 - np.cos(heading)) / curvature
    T[:, :3, 3] = np.stack([along, aside, heave], axis=-1)
    return T


def hump_drive(
    frames: int = 81,
    frame_rate: float = 16.0,
    speed: float = 40 / 3.6,
    deceleration: float = 0.0,
    hump_at: float = 1.2,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Station, heave, pitch of a car that meets a hump at `hump_at` and may brake from 1 s until it stands."""
    t = np.arange(frames) / frame_rate
    braking = np.clip(t - 1.0, 0.0, speed / deceleration if deceleration > 0 else 0.0)
    station = speed * np.minimum(t, 1.0) + speed * np.maximum(t - 1.0, 0.0)
    if deceleration > 0:
        station = speed * np.minimum(t, 1.0) + speed * braking - deceleration * braking**2 / 2
    after = np.maximum(t - hump_at, 0.0)
    ring = np.exp(-1.8 * after) * (after > 0)
    pitch = np.deg2rad(-1.4) * ring * np.sin(2 * np.pi * 1.4 * after)
    heave = 0.05 * ring * np.sin(2 * np.pi * 1.2 * after)
    if deceleration > 0:
        rate = np.where((t > 1.0) & (braking < speed / deceleration), 1.0, 0.0)
        pitch = pitch + np.deg2rad(0.22) * deceleration * rate * (1 - np.exp(-6 * np.maximum(t - 1.0, 0.0)))
    return station, heave, pitch


class CameraSize(TypedDict):
    """Size and focal length of a camera, all [px]."""

    width: int
    height: int
    focal: float


LARGE_CAMERA: CameraSize = {"width": 480, "height": 320, "focal": 400.0}


def drive_clip(
    *,
    frames: int = 81,
    frame_rate: float = 16.0,
    speed: float = 40 / 3.6,
    deceleration: float = 0.0,
    hump_at: float = 1.2,
    curvature: float = 0.0,
    seed: int = 1,
    **size: Unpack[CameraSize],
) -> Clip:
    """Return a clip of a drive over a hump; ``size`` is the camera's, `LARGE_CAMERA` where it is not given."""
    camera = size or LARGE_CAMERA
    width, height = camera["width"], camera["height"]
    station, heave, pitch = hump_drive(frames, frame_rate, speed, deceleration, hump_at)
    return render_clip(
        station, heave, pitch, K=camera_matrix(width, height, camera["focal"]), width=width, height=height,
        curvature=curvature, seed=seed,
    )  # fmt: skip


def render_clip(
    station: NDArray[np.float64],
    heave: NDArray[np.float64],
    pitch: NDArray[np.float64],
    *,
    K: NDArray[np.float64],
    width: int,
    height: int,
    curvature: float = 0.0,
    seed: int = 1,
) -> Clip:
    T_world_rig = rig_poses(station, heave, pitch, curvature)
    T_rig_camera = make_mount()
    textures = [_make_mipmaps(_noise_texture(seed + i)) for i in range(2)]
    n = len(station)
    rgb = np.empty((n, height, width, 3), np.uint8)
    depth = np.empty((n, height, width), np.float32)
    class_id = np.empty((n, height, width), np.uint8)
    for k in range(n):
        T = T_world_rig[k] @ T_rig_camera
        _cast_rays(T, np.linalg.inv(K), curvature, *textures, rgb[k], depth[k], class_id[k])
    return Clip(
        frames=rgb, depth=depth, class_id=class_id, K=K, T_rig_camera=T_rig_camera, T_world_rig=T_world_rig,
        pitch=pitch, heave=heave, station=station,
    )  # fmt: skip


def _noise_texture(seed: int, size: int = 1024) -> NDArray[np.float32]:
    """Tileable noise of falling amplitude over octaves, in 0..1."""
    rng = np.random.default_rng(seed)
    spectrum = np.fft.fft2(rng.standard_normal((size, size)))
    f = np.hypot(*np.meshgrid(np.fft.fftfreq(size), np.fft.fftfreq(size)))
    texture = np.fft.ifft2(spectrum / np.maximum(f, 3 / size) ** 0.9).real
    return np.clip(0.5 + 0.16 * texture / texture.std(), 0, 1).astype(np.float32)


def _make_mipmaps(texture: NDArray[np.float32]) -> NDArray[np.float32]:
    """[L, S, S]: each level box-filtered by two and stored in the corner of a full-size plane."""
    size = texture.shape[0]
    levels = [texture]
    while levels[-1].shape[0] > 4:
        t = levels[-1]
        levels.append(t.reshape(t.shape[0] // 2, 2, -1, 2).mean(axis=(1, 3)))
    stack = np.zeros((len(levels), size, size), np.float32)
    for i, t in enumerate(levels):
        stack[i, : t.shape[0], : t.shape[1]] = t
    return stack


@numba.njit(cache=True)
def _sample_texture(mips, u, v, level):
    top = mips.shape[0] - 1.001
    level = min(max(level, 0.0), top)
    l0 = int(level)
    total = 0.0
    for i in range(2):
        weight = level - l0 if i == 1 else 1.0 - (level - l0)
        size = mips.shape[1] >> (l0 + i)
        x, y = u * size - 0.5, v * size - 0.5
        ix, iy = int(np.floor(x)), int(np.floor(y))
        fx, fy = x - ix, y - iy
        x0, x1, y0, y1 = ix % size, (ix + 1) % size, iy % size, (iy + 1) % size
        m = mips[l0 + i]
        total += weight * (
            (1 - fy) * ((1 - fx) * m[y0, x0] + fx * m[y0, x1]) + fy * ((1 - fx) * m[y1, x0] + fx * m[y1, x1])
        )
    return total


@numba.njit(cache=True)
def _intersect_ray(ox, oy, oz, dx, dy, dz, curvature):
    """Depth along the ray, what it meets, and the cosine-like slant of the meeting."""
    z, kind, slant = np.inf, SKY, 1.0
    if dz < 0:
        z, kind, slant = -oz / dz, ROAD, -dz
    for side in (-1.0, 1.0):
        if curvature == 0.0:
            hit, across = ((side * WALL_DISTANCE - oy) / dy if dy * side > 0 else np.inf), abs(dy)
        else:  # a cylinder about the centre of the arc
            radius, cy = abs(1.0 / curvature - side * WALL_DISTANCE), oy - 1.0 / curvature
            a, b, c = dx * dx + dy * dy, ox * dx + cy * dy, ox * ox + cy * cy - radius * radius
            root = b * b - a * c
            hit, across = np.inf, 1.0
            if root > 0:
                near, far = (-b - np.sqrt(root)) / a, (-b + np.sqrt(root)) / a
                hit = near if near > 1e-6 else (far if far > 1e-6 else np.inf)
                across = abs((ox + hit * dx) * dx + (cy + hit * dy) * dy) / radius
        if hit < z and oz + hit * dz < WALL_HEIGHT:
            z, kind, slant = hit, BUILDING, across
    return (z, kind, slant) if z < FAR else (np.inf, SKY, 1.0)


@numba.njit(cache=True)
def _cast_rays(T, K_inv, curvature, road, wall, rgb, depth, class_id):
    """One ray at each pixel's centre for depth and class, 2 x 2 rays for colour."""
    H, W = depth.shape
    tile = road.shape[1] / TEXELS_PER_METRE
    ox, oy, oz = T[0, 3], T[1, 3], T[2, 3]
    for y in range(H):
        for x in range(W):
            red = green = blue = 0.0
            for sub in range(5):
                px = x + (0.0 if sub == 4 else (sub % 2 - 0.5) / 2)
                py = y + (0.0 if sub == 4 else (sub // 2 - 0.5) / 2)
                cx, cy = K_inv[0, 0] * px + K_inv[0, 2], K_inv[1, 1] * py + K_inv[1, 2]
                dx = T[0, 0] * cx + T[0, 1] * cy + T[0, 2]
                dy = T[1, 0] * cx + T[1, 1] * cy + T[1, 2]
                dz = T[2, 0] * cx + T[2, 1] * cy + T[2, 2]
                z, kind, slant = _intersect_ray(ox, oy, oz, dx, dy, dz, curvature)
                if sub == 4:
                    depth[y, x] = z if kind != SKY else np.nan
                    class_id[y, x] = kind
                elif kind == SKY:
                    red, green, blue = red + 0.70, green + 0.78, blue + 0.90
                else:
                    X, Y, Z = ox + z * dx, oy + z * dy, oz + z * dz
                    footprint = TEXELS_PER_METRE * z * K_inv[0, 0] / 2 / np.sqrt(max(slant, 1e-3))
                    level = np.log2(max(footprint, 1e-6))
                    if kind == ROAD:
                        g = 0.8 * _sample_texture(road, X / tile, Y / tile, level)
                        red, green, blue = red + g, green + g, blue + 1.02 * g
                    else:
                        along = X if curvature == 0.0 else np.arctan2(X, 1 / curvature - Y) / curvature
                        g = _sample_texture(wall, along / tile, Z / tile, level)
                        red, green, blue = red + g, green + 0.85 * g, blue + 0.7 * g
            rgb[y, x, 0] = np.uint8(red / 4 * 255 + 0.5)
            rgb[y, x, 1] = np.uint8(green / 4 * 255 + 0.5)
            rgb[y, x, 2] = np.uint8(blue / 4 * 255 + 0.5)
