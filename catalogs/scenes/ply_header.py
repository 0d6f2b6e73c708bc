"""What the header of a .ply announces, held against the file before anything is decoded."""

from dataclasses import dataclass
from pathlib import Path

from tasks.errors import InputError

LONGEST_HEADER = 65536
SIZES = {"float": 4, "uint": 4, "uchar": 1}
REST_COUNTS = (0, 9, 24, 45)
"""Numbers of f_rest properties of spherical harmonics of degree 0 to 3."""
GAUSSIAN_PROPERTIES = (
    "x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2", "opacity",
    "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3",
)  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Element:
    """One element of a .ply: how many, and the (type, name) of its properties."""

    count: int
    properties: tuple[tuple[str, str], ...]


def check_ply(path: Path) -> None:
    """See that a file is a whole .ply of Gaussians, in the INRIA layout or the compressed one.

    Parameters
    ----------
    path : the file

    Raises
    ------
    InputError
        Naming the first rule that the header breaks, or the bytes that are missing.
    """
    with path.open("rb") as stream:
        head = stream.read(LONGEST_HEADER)
    if not head.startswith(b"ply"):
        raise InputError(f"{path}: a .ply must begin with the word ply; it begins with {head[:8]!r}")
    end = head.find(b"end_header\n")
    if end < 0:
        raise InputError(
            f"{path}: the header of a .ply must end in end_header; it does not: is it truncated?"
        )
    lines = [line.split() for line in head[:end].decode("ascii", errors="replace").splitlines()]
    elements = _elements(path, lines)
    if "chunk" not in elements:
        _check_layout(path, elements["vertex"])
    announced = end + len(b"end_header\n")
    for element in elements.values():
        announced += element.count * sum(SIZES[kind] for kind, _ in element.properties)
    if announced > path.stat().st_size:
        raise InputError(
            f"{path}: its header announces {elements['vertex'].count} Gaussians in {announced} bytes;"
            f" the file holds {path.stat().st_size}: it is truncated"
        )


def _elements(path: Path, lines: list[list[str]]) -> dict[str, Element]:
    form = next((line[1:] for line in lines if line[:1] == ["format"]), [])
    if form != ["binary_little_endian", "1.0"]:
        raise InputError(
            f"{path}: a .ply must be of format binary_little_endian 1.0; it is {' '.join(form)!r}"
        )
    counts: dict[str, int] = {}
    properties: dict[str, list[tuple[str, str]]] = {}
    for line in lines:
        match line:
            case ["element", name, count] if count.isdecimal():
                counts[name], properties[name] = int(count), []
            case ["property", kind, name] if properties and kind in SIZES:
                properties[list(properties)[-1]].append((kind, name))
            case ["element" | "property", *_]:
                raise InputError(
                    f"{path}: a .ply of Gaussians holds elements with a count and properties of type"
                    f" {', '.join(SIZES)}; its header says {' '.join(line)!r}"
                )
    if "vertex" not in counts:
        raise InputError(f"{path}: a .ply of Gaussians must have vertex elements; it has {list(counts)}")
    return {name: Element(count=counts[name], properties=tuple(properties[name])) for name in counts}


def _check_layout(path: Path, vertex: Element) -> None:
    names = [name for _, name in vertex.properties]
    missing = [name for name in GAUSSIAN_PROPERTIES if name not in names]
    problems = [f"{path}: a Gaussian must have {', '.join(missing)}; missing here"] if missing else []
    rest = sum(name.startswith("f_rest_") for name in names)
    if rest not in REST_COUNTS:
        problems.append(f"{path}: there must be 0, 9, 24 or 45 f_rest properties; there are {rest}")
    other = [f"{kind} {name}" for kind, name in vertex.properties if kind != "float"]
    if other:
        problems.append(f"{path}: a Gaussian's properties must be of type float; not so: {', '.join(other)}")
    if problems:
        raise InputError(problems)
