"""The catalogue lines, works and measured runs on which the numbers of one clip rest."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from numpy.typing import NDArray

from catalogs.road_grade import SCENE_GRADES, name_grade_file
from flows.auditing.explain import find_planned_clip, find_route
from flows.making.catalogue import Catalogue
from flows.making.driven import refuse_driven
from flows.making.gathering import table_parts
from flows.making.input_changes import read_kept
from flows.making.plan import Plan
from flows.making.traced import refuse_traced
from flows.reading.answer_files import format_csv
from flows.running.orchestration import run_as_stage
from flows.store.address import open_for_reading
from flows.store.outputs import Outputs
from flows.store.sealed import read_manifest
from flows.store.telemetry import content_hash, list_columns
from manifests.explain import JUDGING, REACHES, RENDER, kind_of_input, parse_input
from studies.lineage.citations import HEADS, find_works, first_clause, join_works
from studies.lineage.driven_lines import (
    ASKED,
    Asked,
    Moved,
    drive_clip,
    is_driven,
    list_asked,
    list_steps,
    move_lines,
)
from studies.lineage.kept_lines import Line, describe_file, list_lines
from studies.lineage.text import format_text
from tasks.conventions import CHANNELS_BY_NAME
from tasks.explanation import Step
from tasks.surface.weather import WEATHERS

__all__ = ["format_text", "trace_lineage"]

SEEN = ("T_world_rig", "film_depth_mm", "snow_depth_mm", "snow_coverage")
"""Columns that the renderer takes: what moves them moves the picture."""
PICTURES, POSE_CHECK = "pictures", "pose check"
COLUMNS = ("file", "key", "value", "unit", "source", "moves", "moves_at_threshold", "reaches")
"""Columns of ``lineage.csv``."""


def want_inputs(name: str) -> bool:
    """Whether a file is needed beside the manifest: the catalogue entries are."""
    return name.startswith("inputs/")


def trace_lineage(dataset: str, clip: str, *, out: str | None = None) -> dict[str, Any]:
    """Find the catalogue lines on which the numbers of a clip rest, and what these lines rest on.

    The clip is driven again from the entries that the dataset keeps, then with each line changed in turn: a column
    rests on the lines that move it. Lines of the picture and of its check, which would need the frames drawn again, are
    told by file.

    Parameters
    ----------
    dataset : a sealed dataset folder
    clip : label or id of the clip
    out : folder for ``lineage.json``, ``lineage.csv`` and ``lineage.txt``; None writes none

    Returns
    -------
    ``follows``, whether the clip driven again has the recorded telemetry; ``lines[]`` with file, key, value, unit,
    source, works, ``moves`` (columns that a small change moves), ``moves_at_threshold`` (that only a large one does)
    and ``reaches`` (pictures, pose check); ``still[]``, lines that move nothing in this clip; ``columns[]`` with their
    equation and lines; ``works[]`` with DOI and how many lines cite them; ``other_sources[]``, of lines that cite no
    work; ``files[]``; ``scene``; ``measured``, the provenance of a vehicle that was fitted to runs, or None.

    Raises
    ------
    InputError
        The folder is no sealed dataset, has no such clip, or its kept entries are not those recorded.
    """
    results = Outputs(out, "lab lineage", "lineage.json", "lineage.csv", "lineage.txt")
    layout = open_for_reading(dataset, want_inputs)
    manifest = read_manifest(layout)
    plan = Plan.of(manifest, layout.manifest)
    refuse_traced(plan.inputs, dataset, "lab lineage")
    refuse_driven(plan.inputs, dataset, "lab lineage")
    planned = find_planned_clip(plan, clip, dataset)
    kept = {
        name: content
        for name, content in read_kept(layout, manifest["inputs"]).items()
        if not name.startswith(SCENE_GRADES) or name == name_grade_file(planned.scenario.scene)
    }
    asked = Asked(
        scenario=planned.scenario, mode=plan.settings.vehicle_mode, variant=plan.settings.variant,
        duration_s=plan.duration_s, route=find_route(plan.record_of(planned.scenario.scene)),
    )  # fmt: skip
    entries = Catalogue(layout.inputs, named=planned.scenario.scene)
    drive = drive_clip(asked, entries)
    units = {name: channel.unit for name, channel in CHANNELS_BY_NAME.items()}
    lines = list_asked(planned.scenario, units, manifest["grid"]["name"])
    lines += [line for name, content in kept.items() for line in list_lines(name, content)]
    moved = run_as_stage(move_lines)(asked, kept, [line for line in lines if is_driven(line)], drive)
    pictures, weather = plan.settings.pictures, planned.scenario.weather
    drawn = [line for line in lines if pictures and not is_driven(line) and _is_drawn(line, weather)]
    resting = [
        _driven_row(one, pictures) for one in moved if one.columns is None or one.columns or one.beyond
    ]
    resting += [_drawn_row(line) for line in drawn]
    content = next(c["content"] for c in manifest["clips"] if c["clip_id"] == planned.clip_id)
    result = {
        "dataset": str(layout),
        "run_id": manifest["run_id"],
        "clip_id": planned.clip_id,
        "label": planned.label,
        "weather": planned.scenario.weather,
        "follows": _follows(dataset, plan, planned.clip_id, drive.ride.columns, content["ticks"]),
        "lines": resting,
        "still": [
            {"file": one.line.file, "key": one.line.key} for one in moved if one.columns == () == one.beyond
        ],
        "columns": _list_columns(drive.numbers, resting, list_steps(asked, entries, drive)),
        "works": _count_works(resting),
        "other_sources": _count_others(resting),
        "files": [
            {"file": name, "sha256": manifest["inputs"][name], "title": describe_file(kept[name])}
            for name in kept
        ],
        "scene": {**plan.record_of(planned.scenario.scene), "at_hand": asked.route is not None},
        "measured": _find_provenance(kept),
    }
    results.write_json("lineage.json", result)
    results.write("lineage.csv", _write_table(resting))
    results.write("lineage.txt", format_text(result))
    return result


def _follows(
    dataset: str, plan: Plan, clip_id: str, columns: Mapping[str, NDArray[Any]], recorded: str
) -> bool:
    """Whether the ticks of a clip driven again have the recorded hash: over the columns that the dataset has."""
    if content_hash("ticks", columns) == recorded:
        return True
    path = next(path for path, ids in table_parts(plan, "ticks").items() if clip_id in ids)
    file = open_for_reading(dataset, lambda name: name == path).root / path
    stored = set(list_columns(file)) if file.is_file() else set()
    return content_hash("ticks", {name: columns[name] for name in stored & columns.keys()}) == recorded


def _driven_row(one: Moved, pictures: bool) -> dict[str, Any]:
    """A line that the drive reads; where it could not be changed, that it reaches the motion is all that is known."""
    if one.columns is None:
        return _as_row(one.line, ["motion"])
    seen = pictures and any(name in (*one.columns, *one.beyond) for name in SEEN)
    return _as_row(one.line, [PICTURES, POSE_CHECK] if seen else [], one.columns, one.beyond)


def _drawn_row(line: Line) -> dict[str, Any]:
    reached = REACHES.get(kind_of_input(line.file), (RENDER, JUDGING))
    return _as_row(line, [PICTURES, POSE_CHECK] if RENDER in reached else [POSE_CHECK])


def _is_drawn(line: Line, weather: str) -> bool:
    """Whether a line is not of another kind of weather than the clip's."""
    kind = line.file.removeprefix("weather/").removesuffix(".yaml")
    return kind == weather or kind not in WEATHERS


def _as_row(
    line: Line, reaches: Sequence[str], moves: Sequence[str] = (), beyond: Sequence[str] = ()
) -> dict[str, Any]:
    return {
        "file": line.file, "key": line.key, "value": line.value, "unit": line.unit, "source": line.source,
        "works": {} if line.file == ASKED else find_works(line.source), "moves": list(moves),
        "moves_at_threshold": list(beyond), "reaches": list(reaches),
    }  # fmt: skip


def _list_columns(
    names: Iterable[str], rows: Sequence[Mapping[str, Any]], steps: Sequence[Step]
) -> list[dict[str, Any]]:
    """Every column that a line moves: its unit, symbol, equation, and the lines."""
    equations = {step.symbol: step.equation for step in steps}
    columns = []
    for name in names:
        resting = [row for row in rows if name in (*row["moves"], *row["moves_at_threshold"])]
        if resting:
            channel = CHANNELS_BY_NAME[name]
            columns.append({
                "column": name, "unit": channel.unit, "symbol": channel.symbol,
                "equation": equations.get(channel.symbol),
                "lines": [{"file": row["file"], "key": row["key"], "threshold": name not in row["moves"]}
                          for row in resting],
                "works": sorted(join_works(row["works"] for row in resting)),
            })  # fmt: skip
    return columns


def _count_works(rows: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Every work that the lines cite, by how many lines cite it; those that are none, declared and paper, first."""
    works = join_works(row["works"] for row in rows)
    counted = [
        {"work": name, "doi": doi, "lines": sum(name in row["works"] for row in rows)}
        for name, doi in works.items()
    ]
    return sorted(counted, key=lambda one: (one["work"] not in HEADS, -one["lines"], one["work"]))


def _count_others(rows: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Sources of lines that cite no work, by their first clause, and how many lines have each."""
    counted = Counter(
        first_clause(row["source"]) for row in rows if row["file"] != ASKED and not row["works"]
    )
    return [{"source": source, "lines": lines} for source, lines in counted.most_common()]


def _find_provenance(kept: Mapping[str, bytes]) -> dict[str, Any] | None:
    entry = parse_input("vehicle.yaml", kept["vehicle.yaml"])
    found: dict[str, Any] | None = entry.get("provenance")
    return found


def _write_table(rows: Sequence[Mapping[str, Any]]) -> str:
    joined = ("moves", "moves_at_threshold", "reaches")
    return format_csv(
        COLUMNS, [[" ".join(row[c]) if c in joined else row[c] for c in COLUMNS] for row in rows]
    )
