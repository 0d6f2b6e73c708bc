"""Gaussians trained elsewhere: .ply (INRIA), compressed .ply, .splat and .spz.

gsply reads .spz; GaussForge turns .splat into .ply first.
"""

import struct
import tempfile
import zlib
from dataclasses import replace
from pathlib import Path

import gaussforge
import gsply
import numpy as np
from numpy.typing import NDArray
from scipy.special import expit, logit

from catalogs.scenes.ply_gaussians import RawCloud, read_ply
from catalogs.scenes.spz_header import check_spz
from tasks.conventions import SemanticClass
from tasks.errors import InputError
from tasks.scene.gaussians import Gaussians, check_gaussians

CLOUD_ARRAYS = ("means", "quats_wxyz", "scales", "opacities", "sh", "normals", "class_id")
FORMATS = (".compressed.ply", ".ply", ".splat", ".spz")
SMALLEST_OPACITY = 1e-6
"""Logits of fully transparent Gaussians underflow; they are kept, invisible [1]."""
MOST_DROPPED = 0.01
"""Share of Gaussians that may hold what is no number, as trainers leave them; these are dropped [1]."""


def read_gaussians(path: Path, notes: list[str] | None = None) -> Gaussians:
    """Read a file of Gaussians, in its own frame; the class is OTHER, the normal the shortest axis.

    Parameters
    ----------
    path : the file; its ending names the format
    notes : takes a sentence for each thing that was left out, where given

    Raises
    ------
    InputError
        If the file is missing, of an unknown format, truncated, empty, or holds values no Gaussian may have.
    """
    form = next((ending for ending in FORMATS if path.name.lower().endswith(ending)), None)
    if form is None:
        raise InputError(
            f"{path}: Gaussians must come as one of {', '.join(FORMATS)}; it ends in {path.suffix!r}"
        )
    if not path.is_file():
        raise InputError(f"{path}: no such file")
    raw = _decode_file(path, form[1:])
    if len(raw.means) == 0:
        raise InputError(f"{path}: must hold at least one Gaussian; it holds none")
    # in double precision no float32 is too large or too small to be squared
    norms = np.linalg.norm(raw.quats.astype(np.float64), axis=1, keepdims=True)
    empty = norms == 0
    with np.errstate(invalid="ignore", over="ignore"):
        quats = np.where(empty, [1, 0, 0, 0], raw.quats / np.where(empty, 1, norms)).astype(np.float32)
        gaussians = Gaussians(
            means=raw.means,
            quats_wxyz=quats,
            scales=raw.scales,
            opacities=np.clip(raw.opacities, SMALLEST_OPACITY, None),
            sh=raw.sh,
            normals=shortest_axis(quats, raw.scales),
            class_id=np.full(len(quats), SemanticClass.OTHER, np.uint8),
            antialiased=raw.antialiased,
            display_encoded=True,
        )
    gaussians = _drop_unreadable(gaussians, [] if notes is None else notes)
    check_gaussians(gaussians, str(path))
    return gaussians


def _drop_unreadable(gaussians: Gaussians, notes: list[str]) -> Gaussians:
    """The cloud without its few Gaussians that hold what is no number; all of them where they are many."""
    arrays = {name: getattr(gaussians, name) for name in CLOUD_ARRAYS}
    sound = np.ones(len(gaussians), np.bool_)
    for array in arrays.values():
        sound &= np.isfinite(array).reshape(len(array), -1).all(axis=1)
    if sound.all() or sound.mean() < 1 - MOST_DROPPED:
        return gaussians
    notes.append(
        f"{len(sound) - sound.sum()} of {len(sound)} Gaussians were left out: they hold what is no finite number, the"
        f" first is number {sound.argmin()}"
    )
    return replace(gaussians, **{name: array[sound] for name, array in arrays.items()})


def shortest_axis(quats_wxyz: NDArray[np.float32], scales: NDArray[np.float32]) -> NDArray[np.float32]:
    """Direction of each Gaussian's smallest standard deviation, float32 [N, 3] [1].

    Parameters
    ----------
    quats_wxyz : float32 [N, 4] unit quaternions [1]
    scales : float32 [N, 3] [m]
    """
    w, x, y, z = quats_wxyz.T
    axes = np.stack(
        [
            np.stack([1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)], axis=1),
            np.stack([2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)], axis=1),
            np.stack([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)], axis=1),
        ],
        axis=1,
    )
    return axes[np.arange(len(scales)), np.argmin(scales, axis=1)].astype(np.float32)


def write_gaussians(gaussians: Gaussians, path: Path) -> None:
    """Write a cloud as an INRIA-layout .ply, which has no place for classes.

    Parameters
    ----------
    gaussians : the cloud; other programs take its colours as display-encoded
    path : a file ending in .ply
    """
    n, coefficients = gaussians.sh.shape[:2]
    opacity = np.clip(gaussians.opacities.astype(np.float64), SMALLEST_OPACITY, 1 - SMALLEST_OPACITY)
    columns = {
        ("x", "y", "z"): gaussians.means,
        ("nx", "ny", "nz"): gaussians.normals,
        _number_names("f_dc", 3): gaussians.sh[:, 0],
        # channel-major: all coefficients of red, then of green, then of blue
        _number_names("f_rest", 3 * (coefficients - 1)): gaussians.sh[:, 1:]
        .transpose(0, 2, 1)
        .reshape(n, -1),
        ("opacity",): logit(opacity)[:, None],
        _number_names("scale", 3): np.log(gaussians.scales),
        _number_names("rot", 4): gaussians.quats_wxyz,
    }
    properties = "".join(f"property float {name}\n" for names in columns for name in names)
    mode = f"comment SplatRenderMode: {'mip' if gaussians.antialiased else 'default'}\n"
    header = f"ply\nformat binary_little_endian 1.0\n{mode}element vertex {n}\n{properties}end_header\n"
    path.write_bytes(header.encode() + np.concatenate(list(columns.values()), axis=1).astype("<f4").tobytes())


def _number_names(name: str, count: int) -> tuple[str, ...]:
    return tuple(f"{name}_{i}" for i in range(count))


def _decode_file(path: Path, form: str) -> RawCloud:
    try:
        if form.endswith("ply"):
            return read_ply(path)
        if form == "spz":
            return _read_spz(path)
        answer = gaussforge.GaussForge().convert(path.read_bytes(), form, "ply")
        if "error" in answer:
            raise ValueError(answer["error"])
        with tempfile.NamedTemporaryFile(suffix=".ply") as plain:
            plain.write(answer["data"])
            plain.flush()
            return read_ply(Path(plain.name))
    except InputError:
        raise
    except (ValueError, OSError, EOFError, LookupError, struct.error, zlib.error):
        raise InputError(
            f"{path}: must be a whole .{form} file of Gaussians; it cannot be decoded: is it truncated?"
        ) from None


def _read_spz(path: Path) -> RawCloud:
    # GaussForge reads it too, but reports on standard output, where --json prints
    antialiased = check_spz(path)
    data = gsply.read_spz(path)
    n = len(data.means)
    rest = np.empty((n, 0, 3), np.float32) if data.shN is None else data.shN.reshape(n, -1, 3)
    with np.errstate(over="ignore", invalid="ignore"):
        return RawCloud(
            means=np.ascontiguousarray(data.means),
            quats=data.quats,
            scales=np.exp(data.scales),
            opacities=expit(data.opacities.ravel()).astype(np.float32),
            sh=np.concatenate([data.sh0.reshape(n, 1, 3), rest], axis=1),
            antialiased=antialiased,
        )
