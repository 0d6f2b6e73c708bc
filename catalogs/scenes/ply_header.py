"""Compare the header of a .ply with the file before anything is decoded.

The decoder reads columns and rows where it expects them, without a second look: what a header announces has to be what
lies there.
"""

from dataclasses import dataclass
from pathlib import Path

from catalogs.sentences import cap_problems, shorten, shorten_value
from tasks.errors import InputError

LONGEST_HEADER = 8192
"""Bytes in which a header has to end [1]: of the layouts below the longest takes 1,500."""
SIZES = {"float": 4, "uint": 4, "uchar": 1}
REST_COUNTS = (0, 9, 24, 45)
"""Numbers of f_rest properties of spherical harmonics of degree 0 to 3."""
GAUSSIAN_PROPERTIES = (
    "x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2", "opacity",
    "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3",
)  # fmt: skip
CHUNK_ROWS = 256
"""Gaussians that share the bounds of one chunk in the compressed layout."""
CHUNK_PROPERTIES = tuple(
    f"{end}_{name}" for group in (("x", "y", "z"), ("scale_x", "scale_y", "scale_z"), ("r", "g", "b"))
    for end in ("min", "max") for name in group
)  # fmt: skip
PACKED_PROPERTIES = ("packed_position", "packed_rotation", "packed_scale", "packed_color")
BEGIN, END = b"ply\n", b"\nend_header\n"


@dataclass(frozen=True, kw_only=True)
class Element:
    """One element of a .ply: how many, and the (type, name) of its properties."""

    count: int
    properties: tuple[tuple[str, str], ...]

    @property
    def bytes(self) -> int:
        """Bytes that all of them take in the file [1]."""
        return self.count * sum(SIZES[kind] for kind, _ in self.properties)


def check_ply(path: Path) -> None:
    """See that a file is a whole .ply of Gaussians, in the INRIA layout or the compressed one.

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
        lines = head[len(BEGIN) : end].decode("ascii").split("\n")
    except UnicodeDecodeError:
        raise InputError(f"{path}: the header of a .ply must be ASCII text; it is not") from None
    elements = _read_elements(path, [line.split() for line in lines])
    problems = _find_compressed_problems(elements) if "chunk" in elements else _find_plain_problems(elements)
    if problems:
        raise InputError(cap_problems([f"{path}: {problem}" for problem in problems]))
    announced = end + len(END) + sum(element.bytes for element in elements.values())
    if announced > path.stat().st_size:
        raise InputError(
            f"{path}: its header announces {elements['vertex'].count} Gaussians in {announced} bytes;"
            f" the file holds {path.stat().st_size}: it is truncated"
        )


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
            case ["property", kind, name] if properties and kind in SIZES:
                properties[list(properties)[-1]].append((kind, name))
            case ["comment" | "obj_info" | "format", *_]:
                pass
            case _:
                raise InputError(
                    f"{path}: a .ply of Gaussians holds elements with a name of their own and a count, and properties"
                    f" of type {', '.join(SIZES)}; its header says {shorten(' '.join(line), 60)!r}"
                )
    if "vertex" not in counts:
        raise InputError(
            f"{path}: a .ply of Gaussians must have vertex elements; it has {shorten_value(list(counts))}"
        )
    return {name: Element(count=counts[name], properties=tuple(properties[name])) for name in counts}


def _find_plain_problems(elements: dict[str, Element]) -> list[str]:
    vertex = elements["vertex"]
    names = [name for _, name in vertex.properties]
    problems = _find_repeated(names)
    if missing := [name for name in GAUSSIAN_PROPERTIES if name not in names]:
        problems.append(f"a Gaussian must have {', '.join(missing)}; missing here")
    rest = sum(name.startswith("f_rest_") for name in names)
    if rest not in REST_COUNTS:
        problems.append(f"there must be 0, 9, 24 or 45 f_rest properties; there are {rest}")
    if other := [f"{kind} {name}" for kind, name in vertex.properties if kind != "float"]:
        problems.append(f"a Gaussian's properties must be of type float; not so: {shorten(', '.join(other))}")
    if len(elements) > 1:
        problems.append(f"the vertices must be the only element; there are {shorten_value(list(elements))}")
    return problems


def _find_compressed_problems(elements: dict[str, Element]) -> list[str]:
    layout = {
        "chunk": tuple(("float", name) for name in CHUNK_PROPERTIES),
        "vertex": tuple(("uint", name) for name in PACKED_PROPERTIES),
    }
    problems = [
        f"the elements of a compressed .ply must be chunk, vertex and, where there is one, sh, in this order;"
        f" they are {shorten_value(list(elements))}"
        for names in [tuple(elements)]
        if names not in {("chunk", "vertex"), ("chunk", "vertex", "sh")}
    ]
    if problems:
        return problems
    problems = [
        f"each {name} of a compressed .ply must have {', '.join(f'{kind} {key}' for kind, key in expected)}, in this"
        " order; it has others"
        for name, expected in layout.items()
        if elements[name].properties != expected
    ]
    vertex, chunk, harmonics = elements["vertex"].count, elements["chunk"].count, elements.get("sh")
    if chunk != -(-vertex // CHUNK_ROWS):
        problems.append(
            f"{vertex} Gaussians must have {-(-vertex // CHUNK_ROWS)} chunks, one for {CHUNK_ROWS}; there are {chunk}"
        )
    if harmonics is not None:
        names = [name for _, name in harmonics.properties]
        problems += _find_repeated(names)
        whole = len(names) in REST_COUNTS and {kind for kind, _ in harmonics.properties} <= {"uchar"}
        if not whole or harmonics.count != vertex:
            problems.append(
                "the sh elements must be as many as the Gaussians, each of 0, 9, 24 or 45 uchar properties;"
                f" there are {harmonics.count} of {len(names)}"
            )
    return problems


def _find_repeated(names: list[str]) -> list[str]:
    twice = sorted({name for name in names if names.count(name) > 1})
    return [f"each property must stand once; {shorten_value(twice)} stand twice"] if twice else []
