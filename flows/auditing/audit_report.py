"""The report of an audit: its sentence, its lines for people, and a page that can be filed by itself."""

from collections.abc import Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined, Template

from flows.auditing.verify import describe_files, describe_signature
from flows.pages import DATASET_PAGE, make_policy
from manifests.explain import ABSENT

PAGE = Path(__file__).parent / "audit_page"


def tell_verdict(result: Mapping[str, Any]) -> str:
    """Return the verdict of an audit in one sentence.

    Parameters
    ----------
    result : of `audit_dataset`
    """
    clips, same = result["remade"], sum(clip["as_recorded"] for clip in result["remade"])
    if result["not_remade"]:
        remade = "no clip could be made again"
    elif not clips:
        remade = "no clip was made again"
    elif same == len(clips):
        remade = f"{same} of {result['clips']} clips, made again, came out bit for bit as recorded"
    else:
        remade = (
            f"of {len(clips)} clips made again {same} came out as recorded and {len(clips) - same} did not"
        )
    word = "Verified" if result["verified"] else "Not verified"
    clauses = [describe_files(result), remade, describe_signature(result)]
    if result["contradictions"]:
        clauses.insert(1, "its records contradict each other")
    return f"{word}: {'; '.join(clauses)}."


def tell_unchecked(rows: Sequence[Mapping[str, Any]]) -> str:
    """Return in one sentence what an audit did not check, each with its count.

    Parameters
    ----------
    rows : of `flows.auditing.audit_facts.list_unchecked`
    """
    told = (f"{row['what']} of {row['count']} of {row['of']} {row['unit']} ({row['why']})" for row in rows)
    return f"Not checked: {'; '.join(told) or 'nothing'}."


def list_remedies(result: Mapping[str, Any]) -> list[str]:
    """Return what to do about what an audit found, a sentence for each kind.

    Parameters
    ----------
    result : of `audit_dataset`
    """
    damage = {row["damage"] for row in result["damaged"]}
    is_forged = result["contradictions"] or result["mismatches"]
    remedies = {
        "remove each file that nobody recorded, or move it out of the folder": "not recorded" in damage,
        "musync lab repair makes damaged and missing files again": bool(damage - {"not recorded"}),
        "trust no file or record named here: take the dataset from its maker again, and a signature with it, or make it"
        " again with musync generate and compare the two with musync lab diff": bool(is_forged),
    }
    return [sentence for sentence, is_due in remedies.items() if is_due]


def format_text(result: Mapping[str, Any]) -> str:
    """The audit in lines for people.

    Parameters
    ----------
    result : of `audit_dataset`
    """
    version, machine = result["tools_here"]["code"]["version"], result["machine"]["name"]
    lines = [
        result["not_checked"],
        result["verdict"],
        f"{result['dataset']}, run {result['run_id']}, seal {result['seal']}",
        f"audited {result['ended_utc']} by musync {version} on {machine}",
        *(f"  {row['path']}: {row['damage']}" for row in result["damaged"]),
        *(f"  {sentence}" for sentence in result["contradictions"]),
        *(f"  none could be made: {problem}" for problem in result["not_remade"]),
    ]
    if result["remade"]:
        lines.append(f"clips drawn by --seed {result['seed']}")
    same = [clip["label"] for clip in result["remade"] if clip["as_recorded"]]
    if same:
        lines.append(f"made again as recorded: {', '.join(same)}")
    for row in result["mismatches"]:
        lines += [
            f"made again otherwise: {row['label']} ({row['clip_id']}): {', '.join(row['changed'])}",
            f"    first in {describe_place(row)}",
            f"    can come from: {', '.join(row['why']) or 'no input that is recorded'}",
        ]
    lines.append(
        "inputs and tools that differ:" if result["differences"] else "no recorded input or tool differs"
    )
    lines += [f"  {difference}" for difference in result["differences"]]
    lines += [f"what to do: {sentence}" for sentence in list_remedies(result)]
    lines.append("verified" if result["verified"] else "not verified")
    return "\n".join(lines) + "\n"


def describe_place(row: Mapping[str, Any]) -> str:
    """Return where a clip differs first, with both values, or why what is stored of it cannot be read.

    Parameters
    ----------
    row : one of ``mismatches``
    """
    if "problem" in row:
        return f"{row['stage']}, {row['problem']}"
    place = f", {row['counted_in']} {row['tick']}" if "tick" in row else ""
    pixel = f", pixel {row['pixel'][0]} right and {row['pixel'][1]} down" if "pixel" in row else ""
    values = f": {row['recorded']} recorded, {row['remade']} made again" if "recorded" in row else ""
    return f"{row['stage']}, {row['channel']}{place}{pixel}{values}"


def write_audit_page(result: Mapping[str, Any]) -> str:
    """Return the page: one file without scripts that loads nothing.

    Parameters
    ----------
    result : of `flows.auditing.audit.audit_dataset`
    """
    style = "\n".join(sheet.read_text() for sheet in (DATASET_PAGE / "report.css", PAGE / "page.css"))
    return _read_template().render(
        result=result,
        tools=compare_tools(result["tools_recorded"], result["tools_here"]),
        remedies=list_remedies(result),
        places=[describe_place(row) for row in result["mismatches"]],
        style=style,
        policy=make_policy(style=style),
    )


@lru_cache
def _read_template() -> Template:
    pages = Environment(loader=FileSystemLoader(PAGE), autoescape=True, undefined=StrictUndefined)
    return pages.get_template("audit.html")


def compare_tools(recorded: Mapping[str, Any], here: Mapping[str, Any]) -> list[tuple[str, str, str]]:
    """Return each fact about the tools by name: what made the dataset, and what audits it.

    Parameters
    ----------
    recorded, here : ``tools_recorded`` and ``tools_here`` of an audit
    """
    rows = []
    for part, title in (("code", "musync"), ("git", "source"), ("libraries", ""), ("processor", "processor")):
        a, b = recorded[part] or {}, here[part] or {}
        rows += [
            (f"{title} {name}".strip().replace("_", " "), str(a.get(name, ABSENT)), str(b.get(name, ABSENT)))
            for name in sorted(a.keys() | b.keys())
        ]
    return rows
