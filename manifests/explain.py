"""Why two datasets differ: what their manifests and frozen inputs say was different before anything was made."""

from collections.abc import Mapping, Sequence
from pathlib import PurePosixPath
from typing import Any

from catalogs.documents import parse_yaml_value
from catalogs.entries import KINDS
from catalogs.grids.form import BEFORE
from catalogs.tyres import tyre_entries
from manifests.canonical import sha256_of
from manifests.provenance import code_version, describe_processor, library_versions

VEHICLE, RENDER, JUDGING = "vehicle", "render", "judging"
REACHES = {
    "vehicle.yaml": (VEHICLE, RENDER),
    "tyre": (VEHICLE, RENDER),
    "surface.yaml": (VEHICLE, RENDER),
    "camera.yaml": (RENDER,),
    "hazard_marking.yaml": (RENDER,),
    "road_users.yaml": (RENDER,),
    "bodies": (RENDER,),
    "low_speed.yaml": (VEHICLE, RENDER),
    "wet_friction.yaml": (VEHICLE, RENDER),
    "road_grade.yaml": (VEHICLE, RENDER),
    "ablation.yaml": (VEHICLE, RENDER),
    "no_low_speed_rule.yaml": (VEHICLE, RENDER),
    "gates.yaml": (JUDGING,),
    "study.yaml": (JUDGING,),
    "weather": (RENDER,),
    "traces": (VEHICLE, RENDER),
    "driven": (VEHICLE, RENDER),
    "scene": (RENDER,),
    "backend": (RENDER,),
    "parameters": (VEHICLE, RENDER),
    "vehicle_mode": (VEHICLE, RENDER),
    "composition": (RENDER,),
    "frames": (VEHICLE, RENDER),
    "duration_s": (VEHICLE,),
    "low_speed": (VEHICLE, RENDER),
    "wet_friction": (VEHICLE, RENDER),
    "variant": (VEHICLE, RENDER),
    "frame_rate_hz": (VEHICLE, RENDER),
    "labels": (RENDER,),
    "pictures": (RENDER, JUDGING),
    "seed": (RENDER,),
    "code": (VEHICLE, RENDER, JUDGING),
    "libraries": (VEHICLE, RENDER, JUDGING),
    "processor": (VEHICLE, RENDER),
}
"""Stages whose bytes an input can change; motion reaches the picture because the camera rides on the body."""
STAGE_OF_CONTENT = (
    dict.fromkeys(("ticks", "label", "scenario", "seed", "split", "calibration"), VEHICLE)
    | dict.fromkeys(
        ("rgb", "depth", "class", "instance", "normal", "road", "flow", "marks", "objects"), RENDER
    )
    | dict.fromkeys(("frames", "figures", "verdict"), JUDGING)
)
"""Stage that makes each content of a clip, and from which on each of its records can change."""
ABSENT = "absent"


def find_input_differences(
    a: Mapping[str, Any], b: Mapping[str, Any], inputs_a: Mapping[str, bytes], inputs_b: Mapping[str, bytes]
) -> list[dict[str, Any]]:
    """Every input that differs, down to the value inside a catalogue entry.

    Parameters
    ----------
    a, b : manifests
    inputs_a, inputs_b : catalogue files by their path under ``inputs/``; where one lacks, hashes are compared

    Returns
    -------
    Rows with ``input``, ``path`` (inside it), ``a``, ``b`` and ``reaches`` (stages that it can change).
    """
    rows: list[dict[str, Any]] = []
    for name in sorted(a["inputs"].keys() | b["inputs"].keys()):
        if a["inputs"].get(name) != b["inputs"].get(name):
            key = kind_of_input(name)
            known = all(
                name in files or name not in m["inputs"] for m, files in ((a, inputs_a), (b, inputs_b))
            )
            rows += (
                _list_rows(name, key, *(parse_input(name, files.get(name)) for files in (inputs_a, inputs_b)))
                if known
                else _list_rows(name, key, a["inputs"].get(name, ABSENT), b["inputs"].get(name, ABSENT))
            )
    rows += _list_rows("scene", "scene", a["scene"].get("sha256"), b["scene"].get("sha256"))
    several = [{scene["name"]: scene["sha256"] for scene in one.get("scenes", ())} for one in (a, b)]
    rows += _list_rows("scenes", "scene", *several)
    rows += _list_rows("backend", "backend", a["backend"], b["backend"])
    for name in (
        "vehicle_mode", "low_speed", "wet_friction", "variant", "composition", "labels", "pictures", "frames",
        "frame_rate_hz", "duration_s", "seed",
    ):  # fmt: skip
        before = BEFORE.get(name)
        rows += _list_rows(name, name, a["grid"].get(name, before), b["grid"].get(name, before))
    return rows + find_tool_differences(a, b)


def find_tool_differences(a: Mapping[str, Any], b: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Rows of `find_input_differences` that are about code, libraries and processor.

    Parameters
    ----------
    a, b : manifests, or `tools_here`
    """
    rows = [
        _list_rows(name, name, a["made_with"].get(name), b["made_with"].get(name))
        for name in ("code", "libraries")
    ]
    return [*rows[0], *rows[1], *_list_rows("processor", "processor", a.get("processor"), b.get("processor"))]


def tools_here() -> dict[str, Any]:
    """Return the code, libraries and processor of this machine as a manifest records them."""
    return {
        "made_with": {"code": code_version(), "libraries": library_versions()},
        "processor": describe_processor(),
    }


def find_parameter_differences(a: Mapping[str, Any], b: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Rows like those of `find_input_differences` for what was asked of each clip.

    Parameters
    ----------
    a, b : plans or manifests
    """
    asked = [
        {clip["label"]: {"seed": clip["seed"], **clip["scenario"]} for clip in m["clips"]} for m in (a, b)
    ]
    return _list_rows("parameters", "parameters", *asked)


def as_sentences(differences: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return a sentence for each difference between the tools that made a dataset (a) and those at hand (b)."""
    return [
        f"{row['input']} {row['path']}".strip()
        + f": {format_value(row['a'])} made it, {format_value(row['b'])} is here"
        for row in differences
    ]


def format_value(value: Any) -> str:
    """A value in a sentence, cut where it is long."""
    return (value if isinstance(value, str) else repr(value))[:80]


def find_reasons(changed: Sequence[str], differences: Sequence[Mapping[str, Any]]) -> list[str]:
    """Inputs that can have caused a clip's earliest change, by name; empty if no recorded input can.

    Parameters
    ----------
    changed : contents and records of the clip that differ, keys of `STAGE_OF_CONTENT`
    differences : rows of `find_input_differences`
    """
    stages = {STAGE_OF_CONTENT[name] for name in changed}
    first = next((stage for stage in (VEHICLE, RENDER, JUDGING) if stage in stages), None)
    return list(dict.fromkeys(row["input"] for row in differences if first in row["reaches"]))


def find_value_differences(a: Any, b: Any, path: str = "") -> list[tuple[str, Any, Any]]:
    """Leaves at which two JSON-like values differ, as (path, in a, in b).

    Parameters
    ----------
    a, b : values; tables are compared key by key, lists of one length item by item
    path : path so far
    """
    if isinstance(a, Mapping) and isinstance(b, Mapping):
        keys: list[Any] = sorted(a.keys() | b.keys(), key=str)
        pairs = [(str(key), a.get(key, ABSENT), b.get(key, ABSENT)) for key in keys]
    elif isinstance(a, list) and isinstance(b, list) and len(a) == len(b):
        pairs = [(str(i), x, y) for i, (x, y) in enumerate(zip(a, b, strict=True))]
    else:
        return [] if a == b else [(path, a, b)]
    return [
        row for key, x, y in pairs for row in find_value_differences(x, y, f"{path}.{key}" if path else key)
    ]


def _list_rows(name: str, key: str, a: Any, b: Any) -> list[dict[str, Any]]:
    reaches = list(REACHES.get(key, (VEHICLE, RENDER, JUDGING)))
    return [
        {"input": name, "path": path, "a": x, "b": y, "reaches": reaches}
        for path, x, y in find_value_differences(a, b)
    ]


def kind_of_input(name: str) -> str:
    """The key of `REACHES` for a file under ``inputs/``.

    Parameters
    ----------
    name : path below ``inputs/``
    """
    path = PurePosixPath(name)
    if path.suffix in KINDS["tyre"].suffixes:
        return "tyre"
    if path.parts[0] == "road_grade":
        return "road_grade.yaml"
    return path.parts[0] if path.parts[0] in ("weather", "traces", "driven", "bodies") else name


def parse_input(name: str, content: bytes | None) -> Any:
    """The values of a file under ``inputs/``; `ABSENT` where there is none.

    Parameters
    ----------
    name : path below ``inputs/``
    content : of the file

    Raises
    ------
    InputError
        If it is no YAML.
    """
    if content is None:
        return ABSENT
    if kind_of_input(name) == "tyre":
        return tyre_entries(content)
    if PurePosixPath(name).suffix in (".parquet", ".py", ".ply"):
        return {"sha256": sha256_of([content])}
    return parse_yaml_value(content, name, "catalogue entry")
