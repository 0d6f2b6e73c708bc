"""Compare the header of a .ply with the file before anything is decoded.

The decoder reads columns and rows where the header puts them: what a header announces has to be what lies there, and
what it states has to be known, since what is passed over would be missing in the picture.
"""

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from catalogs.sentences import cap_problems, shorten, shorten_value
from tasks.errors import InputError

LONGEST_HEADER = 8192
"""Bytes in which a header has to end [1]: of the layouts below the longest takes 1,500."""
TYPES = {
    "char": "<i1", "uchar": "<u1", "short": "<i2", "ushort": "<u2", "int": "<i4", "uint": "<u4",
    "float": "<f4", "double": "<f8", "int8": "<i1", "uint8": "<u1", "int16": "<i2", "uint16": "<u2",
    "int32": "<i4", "uint32": "<u4", "float32": "<f4", "float64": "<f8",
}  # fmt: skip
"""NumPy's form of each type of a .ply."""
REST_COUNTS = (0, 9, 24, 45)
"""Numbers of f_rest properties of spherical harmonics of degree 0 to 3."""
HARMONICS, DISPLAY = ("f_dc_0", "f_dc_1", "f_dc_2"), ("red", "green", "blue")
"""Colour: coefficients of the spherical harmonics' band 0, or, where these are missing, the colour itself."""
SCALES, ROTATION = ("scale_0", "scale_1", "scale_2"), ("rot_0", "rot_1", "rot_2", "rot_3")
GAUSSIAN_PROPERTIES = ("x", "y", "z", "opacity", *SCALES[:2], *ROTATION)
"""Properties that every Gaussian has, beside its colour; one of two dimensions has no third scale."""
FILTER = "filter_3D"
"""Standard deviation of the smoothing filter of Mip-Splatting and Gaussian Opacity Fields."""
PASSED_OVER = ("nx", "ny", "nz", *DISPLAY)
"""Properties that say nothing further: the normal is the shortest axis, and a colour may stand beside harmonics."""
CHUNK_ROWS = 256
"""Gaussians that share the bounds of one chunk in the compressed layout."""
BOUND_GROUPS = (("x", "y", "z"), ("scale_x", "scale_y", "scale_z"), ("r", "g", "b"))
CHUNK_PROPERTIES = tuple(
    f"{end}_{name}" for group in BOUND_GROUPS for end in ("min", "max") for name in group
)
COLOURLESS = len(CHUNK_PROPERTIES) - 6
"""Bounds of a chunk without those of colours, which then take 8 bits from 0 to 1 [1]."""
RENDER_MODES = {"splatrendermode: mip": True, "splatrendermode: default": False, "splatrendermode: 2dgs": False,
                "antialiased 1": True, "antialiased 0": False}  # fmt: skip
"""Comments by which trainers say whether a cloud is drawn antialiased: those of Brush, gsplat and Postshot."""
PACKED_PROPERTIES = ("packed_position", "packed_rotation", "packed_scale", "packed_color")
BEGIN, END = b"ply\n", b"\nend_header\n"


@dataclass(frozen=True, kw_only=True)
class Element:
    """One element of a .ply: how many, and the (type, name) of its properties."""

    count: int
    properties: tuple[tuple[str, str], ...]

    @property
    def row(self) -> np.dtype[np.void]:
        """Form of one of them in the file."""
        return np.dtype([(name, TYPES[kind]) for kind, name in self.properties])

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the properties."""
        return tuple(name for _, name in self.properties)


@dataclass(frozen=True, kw_only=True)
class PlyHeader:
    """What a .ply announces.

    Parameters
    ----------
    elements : in the order of the file, by name
    size : bytes of the header itself [1]
    antialiased : whether the cloud is drawn antialiased, where a comment says so; else False
    """

    elements: dict[str, Element]
    size: int
    antialiased: bool


def read_header(path: Path) -> PlyHeader:
    """The header of a .ply of Gaussians, in the INRIA layout or the compressed one, whose file is whole.

    Parameters
    ----------
    path : the file

    Raises
    ------
    InputError
        Naming the rules that the header breaks, or the bytes that are missing.
    """
    with path.open("rb") as stream:
        head = stream.read(LONGEST_HEADER)
    if not head.startswith(b"ply"):
        raise InputError(f"{path}: a .ply must begin with the word ply; it begins with {head[:8]!r}")
    end = head.find(END)
    # the decoder ends the header at the first such word, be it in a comment
    if not head.startswith(BEGIN) or end < 0 or head.find(END[1:]) != end + 1:
        raise InputError(
            f"{path}: the header of a .ply must be lines of text up to end_header, within {LONGEST_HEADER} bytes;"
            " it is not: is the file truncated?"
        )
    try:
        lines = [line.split() for line in head[len(BEGIN) : end].decode("ascii").split("\n")]
    except UnicodeDecodeError:
        raise InputError(f"{path}: the header of a .ply must be ASCII text; it is not") from None
    elements = _read_elements(path, lines)
    antialiased, problems = _read_render_mode(lines)
    problems += _find_compressed_problems(elements) if "chunk" in elements else _find_plain_problems(elements)
    if problems:
        raise InputError(cap_problems([f"{path}: {problem}" for problem in problems]))
    size = end + len(END)
    announced = size + sum(element.count * element.row.itemsize for element in elements.values())
    if announced != path.stat().st_size:
        fault = "it is truncated" if announced > path.stat().st_size else "its header leaves something out"
        raise InputError(
            f"{path}: its header announces {elements['vertex'].count} Gaussians in {announced} bytes;"
            f" the file holds {path.stat().st_size}: {fault}"
        )
    return PlyHeader(elements=elements, size=size, antialiased=antialiased)


def _read_elements(path: Path, lines: list[list[str]]) -> dict[str, Element]:
    forms = [line[1:] for line in lines if line[:1] == ["format"]]
    if forms != [["binary_little_endian", "1.0"]]:
        found = shorten(" ".join(forms[0] if forms else []), 60)
        raise InputError(f"{path}: a .ply must be once of format binary_little_endian 1.0; it is {found!r}")
    counts: dict[str, int] = {}
    properties: dict[str, list[tuple[str, str]]] = {}
    for line in lines:
        match line:
            case ["element", name, count] if name not in counts and count.isdecimal() and len(count) < 16:
                counts[name], properties[name] = int(count), []
            case ["property", kind, name] if properties and kind in TYPES:
                properties[list(properties)[-1]].append((kind, name))
            case ["comment" | "obj_info" | "format", *_]:
                pass
            case _:
                raise InputError(
                    f"{path}: a .ply of Gaussians holds elements with a name of their own and a count, and properties"
                    f" of one number each; its header says {shorten(' '.join(line), 60)!r}"
                )
    if "vertex" not in counts:
        raise InputError(
            f"{path}: a .ply of Gaussians must have vertex elements; it has {shorten_value(list(counts))}"
        )
    twice = [
        problem for listed in properties.values() for problem in _find_repeated([name for _, name in listed])
    ]
    if twice:
        raise InputError([f"{path}: {problem}" for problem in twice])
    return {name: Element(count=counts[name], properties=tuple(properties[name])) for name in counts}


def _read_render_mode(lines: list[list[str]]) -> tuple[bool, list[str]]:
    """Whether the comments say that the cloud is drawn antialiased, and what is wrong with them."""
    comments = [
        " ".join(" ".join(line[1:]).lower().replace(":", ": ").split())
        for line in lines
        if line[:1] == ["comment"]
    ]
    modes_named = [words for words in comments if re.fullmatch(r"splatrendermode:.*|antialiased \S+", words)]
    unknown = [words for words in modes_named if words not in RENDER_MODES]
    modes = {RENDER_MODES[words] for words in modes_named if words in RENDER_MODES}
    problems = [
        f"a comment on how the cloud is drawn must be one of {', '.join(RENDER_MODES)}; it is {shorten(words, 60)!r}"
        for words in unknown
    ]
    if len(modes) > 1:
        problems.append(f"comments must agree on how the cloud is drawn; they say {', '.join(modes_named)}")
    return True in modes, problems


def _find_plain_problems(elements: dict[str, Element]) -> list[str]:
    names = elements["vertex"].names
    problems = []
    colour = DISPLAY if set(names).isdisjoint(HARMONICS) and not set(names).isdisjoint(DISPLAY) else HARMONICS
    if missing := [
        name for name in (*GAUSSIAN_PROPERTIES[:3], *colour, *GAUSSIAN_PROPERTIES[3:]) if name not in names
    ]:
        problems.append(f"a Gaussian must have {', '.join(missing)}; missing here")
    rest = sum(name.startswith("f_rest_") for name in names)
    expected = {f"f_rest_{i}" for i in range(rest)}
    if rest not in REST_COUNTS or not expected <= set(names):
        problems.append(f"there must be 0, 9, 24 or 45 f_rest properties, counted from 0; there are {rest}")
    known = {*GAUSSIAN_PROPERTIES, *HARMONICS, *SCALES, *PASSED_OVER, FILTER, *expected}
    if other := [name for name in names if name not in known and not name.startswith("f_rest_")]:
        problems.append(
            f"what a Gaussian states must be known, or it would be missing in the picture; {shorten(', '.join(other))}"
            f" {'is' if len(other) == 1 else 'are'} not: export a cloud that stands still, without columns of other"
            " tools, or leave them out of the file"
        )
    if len(elements) > 1:
        problems.append(f"the vertices must be the only element; there are {shorten_value(list(elements))}")
    return problems


def _find_compressed_problems(elements: dict[str, Element]) -> list[str]:
    bounds = CHUNK_PROPERTIES if len(elements["chunk"].names) > COLOURLESS else CHUNK_PROPERTIES[:COLOURLESS]
    layout = {"chunk": ("<f4", bounds), "vertex": ("<u4", PACKED_PROPERTIES)}
    problems = [
        f"the elements of a compressed .ply must be chunk, vertex and, where there is one, sh, in this order;"
        f" they are {shorten_value(list(elements))}"
        for names in [tuple(elements)]
        if names not in {("chunk", "vertex"), ("chunk", "vertex", "sh")}
    ]
    if problems:
        return problems
    problems = [
        f"each {name} of a compressed .ply must have {', '.join(keys)}, in this order, of type"
        f" {'float' if form == '<f4' else 'uint'}; it has others"
        for name, (form, keys) in layout.items()
        if [(key, TYPES[kind]) for kind, key in elements[name].properties] != [(key, form) for key in keys]
    ]
    vertex, chunk, harmonics = elements["vertex"].count, elements["chunk"].count, elements.get("sh")
    if chunk != -(-vertex // CHUNK_ROWS):
        problems.append(
            f"{vertex} Gaussians must have {-(-vertex // CHUNK_ROWS)} chunks, one for {CHUNK_ROWS}; there are {chunk}"
        )
    if harmonics is not None:
        names = harmonics.names
        whole = len(names) in REST_COUNTS and {TYPES[kind] for kind, _ in harmonics.properties} <= {"<u1"}
        if not whole or harmonics.count != vertex:
            problems.append(
                "the sh elements must be as many as the Gaussians, each of 0, 9, 24 or 45 uchar properties;"
                f" there are {harmonics.count} of {len(names)}"
            )
    return problems


def _find_repeated(names: list[str]) -> list[str]:
    twice = sorted({name for name in names if names.count(name) > 1})
    return [f"each property must stand once; {shorten_value(twice)} stand twice"] if twice else []
