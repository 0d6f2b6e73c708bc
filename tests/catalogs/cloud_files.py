"""Files of Gaussians, written by hand: the .ply layout is the reference, not a library."""

from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np

SH_0 = 0.28209479177387814
"""Value of the first spherical harmonic."""
FORMS = {"float": "<f4", "double": "<f8", "uchar": "u1", "int": "<i4"}


def write_columns(
    path: Path,
    columns: Mapping[str, np.ndarray],
    kinds: Mapping[str, str] | None = None,
    comments: Iterable[str] = (),
) -> Path:
    """Write columns by name as a .ply and return its path: float, or of the type that ``kinds`` names."""
    kinds = dict.fromkeys(columns, "float") | dict(kinds or {})
    rows = np.zeros(len(next(iter(columns.values()))), [(name, FORMS[kinds[name]]) for name in columns])
    for name, values in columns.items():
        rows[name] = values
    lines = [*(f"comment {words}" for words in comments), f"element vertex {len(rows)}"]
    lines += [f"property {kinds[name]} {name}" for name in columns]
    header = "\n".join(["ply", "format binary_little_endian 1.0", *lines, "end_header", ""])
    path.write_bytes(header.encode() + rows.tobytes())
    return path


def write_inria(path: Path, nan_at: int | None = None, column: str = "x") -> dict[str, np.ndarray]:
    """Write 50 Gaussians as INRIA's trainer lays them out and return their columns; one value may be NaN."""
    names = ["x", "y", "z", "nx", "ny", "nz", *(f"f_dc_{i}" for i in range(3)), *(f"f_rest_{i}" for i in range(45)),
             "opacity", *(f"scale_{i}" for i in range(3)), *(f"rot_{i}" for i in range(4))]  # fmt: skip
    rows = np.random.default_rng(3).normal(size=(50, len(names))).astype("<f4")
    rows[:, names.index("scale_0") : names.index("scale_2") + 1] -= 3
    if nan_at is not None:
        rows[nan_at, names.index(column)] = np.nan
    columns = dict(zip(names, rows.T, strict=True))
    write_columns(path, columns)
    return columns


def draw_columns(count: int = 400) -> dict[str, np.ndarray]:
    """Draw the columns of Gaussians without view-dependent colour."""
    draw = np.random.default_rng(5)
    names = [*"xyz", "f_dc_0", "f_dc_1", "f_dc_2", "opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1",
             "rot_2", "rot_3"]  # fmt: skip
    columns = {name: draw.normal(size=count).astype(np.float32) for name in names}
    return columns | {f"scale_{i}": columns[f"scale_{i}"] - 2 for i in range(3)}
