"""The lineage of a clip in plain words and as a table."""

from collections.abc import Mapping, Sequence
from typing import Any

from catalogs.sentences import shorten
from studies.lineage.citations import HEADS

MARK = "*"
WIDEST_VALUE = 28
WIDEST_SOURCE = 110


def format_text(result: Mapping[str, Any]) -> str:
    """The lineage in lines for people.

    Parameters
    ----------
    result : of `studies.lineage.trace.trace_lineage`
    """
    return "\n".join(
        [
            *_describe_summary(result),
            "",
            "each column rests on:",
            *_describe_columns(result["columns"]),
            *_describe_reached(result),
            "",
            "the lines:",
            *_describe_lines(result["lines"]),
            "",
            "the works that these lines cite:",
            *(f"  {_name_work(work)}: {_count(work['lines'], 'line')}" for work in result["works"]),
            *_describe_others(result["other_sources"]),
            *_describe_measured(result["measured"]),
        ]
    ) + "\n"  # fmt: skip


def _describe_summary(result: Mapping[str, Any]) -> list[str]:
    catalogue = [row for row in result["lines"] if row["file"] in {one["file"] for one in result["files"]}]
    asked, files = len(result["lines"]) - len(catalogue), {row["file"] for row in catalogue}
    declared = sum("declared" in row["works"] for row in catalogue)
    cited = sum(work["work"] not in HEADS for work in result["works"])
    still, scene = len(result["still"]), result["scene"]
    return [
        f"{result['label']} ({result['clip_id']}) of run {result['run_id']}, {result['weather']}",
        f"It rests on {_count(len(catalogue), 'line')} of {_count(len(files), 'catalogue file')},"
        f" {_count(asked, 'number')} that the grid asks for, and the scene {scene['name']}"
        f" (SHA-256 {scene['sha256'][:16]}).",
        f"The lines cite {_count(cited, 'work')} beside the paper; {_count(declared, 'line')}"
        f" {'is' if declared == 1 else 'are'} declared: chosen, not measured.",
        f"{_count(still, 'more line')} of the same files {'moves' if still == 1 else 'move'} nothing in this clip,"
        " even at half or double.",
        "Driven again from these lines, every tick is as recorded."
        if result["follows"]
        else "Driven again from these lines, the telemetry is NOT as recorded: code, libraries or processor differ, and"
        " what follows is said of the numbers that they give here (musync audit names the difference).",
    ]


def _describe_columns(columns: Sequence[Mapping[str, Any]]) -> list[str]:
    """Columns that rest on the same lines together, in the order in which one follows from another."""
    groups: dict[tuple[tuple[str, str], ...], list[str]] = {}
    for column in columns:
        keys = tuple((line["file"], _mark_key(line)) for line in column["lines"])
        groups.setdefault(keys, []).append(_name_column(column))
    said = []
    for keys, names in groups.items():
        by_file: dict[str, list[str]] = {}
        for file, key in keys:
            by_file.setdefault(file, []).append(key)
        said.append(f"  {', '.join(names)}")
        said += [f"    {file}: {', '.join(inside)}" for file, inside in by_file.items()]
    if any(line["threshold"] for column in columns for line in column["lines"]):
        said.append(f"  {MARK} a threshold: a change by a hundredth moves nothing, half or double does")
    return said


def _mark_key(line: Mapping[str, Any]) -> str:
    return line["key"] + (MARK if line["threshold"] else "")


def _name_column(column: Mapping[str, Any]) -> str:
    equation = f"Eq. {column['equation']}" if column["equation"] not in (None, "none") else ""
    inside = ", ".join(part for part in (column["symbol"], equation) if part)
    return column["column"] + (f" ({inside})" if inside else "")


def _describe_reached(result: Mapping[str, Any]) -> list[str]:
    """Return the sentences on what is known by file alone: pictures and their check."""
    said = []
    for reached in dict.fromkeys(name for row in result["lines"] for name in row["reaches"]):
        rows = [row for row in result["lines"] if reached in row["reaches"]]
        moved = sum(bool(row["moves"] or row["moves_at_threshold"]) for row in rows)
        files: dict[str, int] = {}
        for row in rows:
            if not (row["moves"] or row["moves_at_threshold"]):
                files[row["file"]] = files.get(row["file"], 0) + 1
        told = [f"{file} ({_count(n, 'line')})" for file, n in files.items()]
        told += (
            [f"the {_count(moved, 'line')} above that move the pose, the film or the snow"] if moved else []
        )
        told += ["the scene"] if reached == "pictures" else []
        said.append(f"  {reached}, by file: {', '.join(told)}")
    return said


def _describe_lines(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    cells = [
        (row["file"], row["key"], f"{shorten(_format_value(row['value']), WIDEST_VALUE)} {row['unit']}".strip(),
         shorten(row["source"], WIDEST_SOURCE))
        for row in rows
    ]  # fmt: skip
    cells = [("file", "key", "value and unit", "source"), *cells]
    widths = [max((len(cell[k]) for cell in cells), default=0) for k in range(3)]
    return ["  " + "  ".join([*(cell[k].ljust(widths[k]) for k in range(3)), cell[3]]) for cell in cells]


def _describe_others(others: Sequence[Mapping[str, Any]]) -> list[str]:
    if not others:
        return []
    told = [
        f"  {shorten(other['source'], WIDEST_SOURCE)}: {_count(other['lines'], 'line')}" for other in others
    ]
    return ["", "lines that cite no work, by the first words of their source:", *told]


def _describe_measured(provenance: Mapping[str, Any] | None) -> list[str]:
    if provenance is None:
        return ["", "no number of the vehicle was fitted to measured or reference runs"]
    data = [f"    {name}: {digest}" for name, digest in provenance["data_sha256"].items()]
    return [
        "",
        f"the vehicle was fitted in {provenance['mode']} mode to the {provenance['split']} runs below, from"
        f" {provenance['base']} (SHA-256 {provenance['base_sha256'][:16]}), by {provenance['procedure']}"
        f" (SHA-256 {provenance['procedure_sha256'][:16]}) of version {provenance['version']}; SHA-256 of the data:",
        *data,
    ]


def _name_work(work: Mapping[str, Any]) -> str:
    return work["work"] + (
        f", doi:{work['doi']}" if work["doi"] and not work["work"].startswith("doi:") else ""
    )


def _format_value(value: Any) -> str:
    if isinstance(value, list):
        return ", ".join(_format_value(one) for one in value)
    return f"{value:g}" if isinstance(value, float) else str(value)


def _count(number: int, word: str) -> str:
    return f"{number} {word}{'' if number == 1 else 's'}"
