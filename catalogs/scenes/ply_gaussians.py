"""Decode the Gaussians of a .ply, in the INRIA layout or the compressed one of PlayCanvas."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit

from catalogs.scenes.ply_header import (
    BOUND_GROUPS,
    CHUNK_ROWS,
    DISPLAY,
    FILTER,
    HARMONICS,
    ROTATION,
    SCALES,
    PlyHeader,
    read_header,
)
from tasks.errors import InputError

Floats = NDArray[np.float32]
SH_0 = 0.28209479177387814
"""Spherical harmonic of band 0 [1]."""
FLAT = 1e-6
"""Third standard deviation of a Gaussian of two dimensions [unit of the file]."""
LARGEST_ROUNDING = 1e-3
"""Most that a position may move in single precision [unit of the file]."""
LARGEST_LOGIT, LARGEST_COEFFICIENT = 30.0, 16.0
"""Greatest logit and coefficient of a colour that a trainer leaves [1]; a byte's values go on to 255."""


@dataclass(frozen=True, kw_only=True)
class RawCloud:
    """Gaussians as a file has them, in its own frame and unit.

    Parameters
    ----------
    means : float32 [N, 3] centres [unit of the file]
    quats : float32 [N, 4] quaternions of any length, w x y z [1]
    scales : float32 [N, 3] standard deviations [unit of the file]
    opacities : float32 [N] 0 to 1 [1]
    sh : float32 [N, K, 3] coefficients of spherical harmonics [1]
    antialiased : as of `tasks.scene.gaussians.Gaussians`
    """

    means: Floats
    quats: Floats
    scales: Floats
    opacities: Floats
    sh: Floats
    antialiased: bool = False


def read_ply(path: Path) -> RawCloud:
    """The Gaussians of a .ply.

    Raises
    ------
    InputError
        If the header breaks a rule, bytes are missing, or the values are no longer those that a trainer stores.
    """
    header = read_header(path)
    with path.open("rb") as stream:
        stream.seek(header.size)
        rows = {
            name: np.fromfile(stream, element.row, element.count) for name, element in header.elements.items()
        }
    return (
        _decode_compressed(rows, header) if "chunk" in rows else _decode_plain(rows["vertex"], header, path)
    )


def _decode_plain(rows: NDArray[np.void], header: PlyHeader, path: Path) -> RawCloud:
    names = header.elements["vertex"].names
    means = _gather(rows, ("x", "y", "z"))
    logits = rows["opacity"].astype(np.float32)
    logarithms = _gather(rows, tuple(name for name in SCALES if name in names))
    problems = _find_activated(rows, logits, logarithms) if len(rows) else []
    with np.errstate(invalid="ignore"):
        moved = max(
            np.fmax.reduce(np.abs(rows[name] - means[:, i]), initial=0) for i, name in enumerate("xyz")
        )
    if moved > LARGEST_ROUNDING:
        problems.append(
            f"positions must be near enough to the origin for single precision, which would move them by {moved:.2g}:"
            " subtract one offset from the cloud and from the route"
        )
    if problems:
        raise InputError([f"{path}: {problem}" for problem in problems])
    with np.errstate(over="ignore", invalid="ignore"):
        scales = np.exp(logarithms)
        if scales.shape[1] < 3:
            scales = np.concatenate([scales, np.full((len(rows), 1), FLAT, np.float32)], axis=1)
        opacities = expit(logits)
        if FILTER in names:
            # the smoothed Gaussian is wider and spreads what it covers (Yu et al. 2024, Mip-Splatting, equation 9)
            smoothed = np.hypot(scales.astype(np.float64), rows[FILTER][:, None])
            opacities = opacities * np.prod(scales / smoothed, axis=1)
            scales = smoothed
    coefficients = sum(name.startswith("f_rest_") for name in names) // 3
    rest = _gather(rows, tuple(f"f_rest_{i}" for i in range(3 * coefficients)))
    # channel-major: all coefficients of red, then of green, then of blue
    rest = rest.reshape(len(rows), 3, coefficients).transpose(0, 2, 1)
    return RawCloud(
        means=means,
        quats=_gather(rows, ROTATION),
        scales=scales.astype(np.float32),
        opacities=opacities.astype(np.float32),
        sh=np.concatenate([_read_colour(rows)[:, None], rest], axis=1),
        antialiased=header.antialiased,
    )


def _gather(rows: NDArray[np.void], names: tuple[str, ...]) -> Floats:
    """Columns of the rows, [N, names]."""
    columns = np.empty((len(rows), len(names)), np.float32)
    with np.errstate(over="ignore"):
        for i, name in enumerate(names):
            columns[:, i] = rows[name]
    return columns


def _read_colour(rows: NDArray[np.void]) -> Floats:
    """Coefficients of band 0, [N, 3]: as they stand, or from a colour of 0 to 1, or to the greatest of its bits."""
    names: Any = rows.dtype.names
    if HARMONICS[0] in names:
        return _gather(rows, HARMONICS)
    kinds = [rows.dtype[name] for name in DISPLAY]
    whole = [np.iinfo(kind).max if kind.kind in "iu" else 1 for kind in kinds]
    return ((_gather(rows, DISPLAY) / np.array(whole, np.float32) - 0.5) / SH_0).astype(np.float32)


def _find_activated(rows: NDArray[np.void], logits: Floats, logarithms: Floats) -> list[str]:
    """The columns whose values are opacities, lengths or colours, where a trainer stores what it takes these from."""
    problems = []
    low, high = _find_range(logits)
    if low >= 0 and (0 < high <= 1 or high > LARGEST_LOGIT):
        problems.append(
            f"opacity must be a logit, below 0 where a Gaussian is faint; all are {low:.3g} to {high:.3g}, as opacities"
            " themselves"
        )
    low, high = _find_range(logarithms)
    if low > 0 and np.nanmedian(logarithms) < 1:
        problems.append(
            "scale_0 to scale_2 must be logarithms, below 0 where a Gaussian is smaller than one unit; all are"
            f" {low:.3g} to {high:.3g}, as lengths themselves"
        )
    low, high = _find_range(_read_colour(rows))
    if HARMONICS[0] in (rows.dtype.names or ()) and low >= 0 and high > LARGEST_COEFFICIENT:
        problems.append(
            f"f_dc_0 to f_dc_2 must be coefficients of spherical harmonics, within some +-2; all are {low:.3g} to"
            f" {high:.3g}, as colours of 8 bits"
        )
    remedy = "export the cloud as its trainer stores it (INRIA layout)"
    return [f"{problem}: {remedy}" for problem in problems]


def _find_range(values: Floats) -> tuple[float, float]:
    """Least and greatest finite value; NaN where there is none."""
    finite = values[np.isfinite(values)]
    return (float(finite.min()), float(finite.max())) if finite.size else (np.nan, np.nan)


def _decode_compressed(rows: dict[str, NDArray[np.void]], header: PlyHeader) -> RawCloud:
    vertex = rows["vertex"]
    chunk = np.arange(len(vertex)) // CHUNK_ROWS
    mean, scale, colour = (
        [_gather(rows["chunk"], tuple(f"{end}_{name}" for name in group))[chunk] for end in ("min", "max")]
        if f"min_{group[0]}" in header.elements["chunk"].names
        else [np.zeros((len(vertex), 3), np.float32), np.ones((len(vertex), 3), np.float32)]
        for group in BOUND_GROUPS
    )
    shares = _unpack(vertex["packed_color"], (8, 8, 8, 8))
    small = (_unpack(vertex["packed_rotation"], (2, 10, 10, 10))[:, 1:] - 0.5) * np.float32(np.sqrt(2))
    largest = np.sqrt(np.clip(1 - (small**2).sum(axis=1), 0, None))
    number = vertex["packed_rotation"] >> 30
    quats = np.empty((len(vertex), 4), np.float32)
    for axis in range(4):
        these = number == axis
        quats[these] = np.insert(small[these], axis, largest[these], axis=1)
    sh = ((_blend(colour, shares[:, :3]) - 0.5) / SH_0)[:, None]
    if "sh" in rows:
        names = header.elements["sh"].names
        rest = (_gather(rows["sh"], names) - 127.5) / 32
        sh = np.concatenate([sh, rest.reshape(len(vertex), 3, -1).transpose(0, 2, 1)], axis=1)
    with np.errstate(over="ignore", invalid="ignore"):
        return RawCloud(
            means=_blend(mean, _unpack(vertex["packed_position"], (11, 10, 11))),
            quats=quats,
            scales=np.exp(_blend(scale, _unpack(vertex["packed_scale"], (11, 10, 11)))),
            opacities=shares[:, 3],
            sh=sh.astype(np.float32),
            antialiased=header.antialiased,
        )


def _unpack(packed: NDArray[np.uint32], bits: tuple[int, ...]) -> Floats:
    """Fields of 32-bit words, highest first, each as a share of its greatest value, [N, fields] [1]."""
    shares = np.empty((len(packed), len(bits)), np.float32)
    below = 32
    for i, width in enumerate(bits):
        below -= width
        shares[:, i] = ((packed >> below) & (2**width - 1)) / np.float32(2**width - 1)
    return shares


def _blend(ends: list[Floats], share: Floats) -> Floats:
    low, high = ends
    with np.errstate(over="ignore", invalid="ignore"):
        return low + share * (high - low)
