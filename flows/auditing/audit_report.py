"""The report of an audit: its sentence, its lines for people, and a page that can be filed by itself."""

from collections.abc import Mapping, Sequence
from typing import Any

from flows.auditing.verify import describe_files, describe_signature
from flows.pages.writer import Cell, Command, Part, Section, Table, write_page
from manifests.explain import ABSENT


def describe_verdict(result: Mapping[str, Any]) -> str:
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


def describe_unchecked(rows: Sequence[Mapping[str, Any]]) -> str:
    """Return in one sentence what an audit did not check, each with its count.

    Parameters
    ----------
    rows : of `flows.auditing.audit_facts.list_unchecked`
    """
    listed = (f"{row['what']} of {row['count']} of {row['of']} {row['unit']} ({row['why']})" for row in rows)
    return f"Not checked: {'; '.join(listed) or 'nothing'}."


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
    tick = f", {row['counted_in']} {row['tick']}" if "tick" in row else ""
    pixel = f", pixel {row['pixel'][0]} right and {row['pixel'][1]} down" if "pixel" in row else ""
    values = f": {row['recorded']} recorded, {row['remade']} made again" if "recorded" in row else ""
    return f"{row['stage']}, {row['channel']}{tick}{pixel}{values}"


def write_audit_page(result: Mapping[str, Any]) -> str:
    """Return the page: one file without scripts that loads nothing.

    Parameters
    ----------
    result : of `flows.auditing.audit.audit_dataset`
    """
    remedies = list_remedies(result)
    compared: list[Part] = [
        _list_comparisons(result),
        *(["What to do:", remedies] if remedies else []),
        Table(title="Damaged files", rows=[
            {"file": row["path"], "damage": row["damage"], "clip": row["clip_id"]} for row in result["damaged"]
        ]),
        Table(title="Clips made again", rows=[
            {"clip": clip["label"], "id": clip["clip_id"], "outcome": _describe_outcome(clip)}
            for clip in result["remade"]
        ]),
    ]  # fmt: skip
    mismatches = [
        f"{row['label']} ({', '.join(row['changed'])}): {describe_place(row)}."
        f" Can come from: {', '.join(row['why']) or 'no input that is recorded'}."
        for row in result["mismatches"]
    ]
    tools = [
        {"tool": name, "made the dataset": made,
         "audited it": Cell(value=here, tone="bad") if made != here else "the same"}
        for name, made, here in compare_tools(result["tools_recorded"], result["tools_here"])
    ]  # fmt: skip
    differing = [
        "These differ between what made the dataset and what audited it:", result["differences"]
    ] if result["differences"] else [
        "No recorded input or tool that decides bytes differs between what made the dataset and what audited it."
    ]  # fmt: skip
    return write_page(
        f"Audit of {result['grid']}, run {result['run_id']}",
        result["verdict"],
        [
            Section(title="The dataset", parts=[_list_dataset_facts(result)]),
            Section(title="This audit", parts=[_list_audit_facts(result)]),
            Section(title="What was compared", parts=compared),
            Section(title="Where clips differ first", parts=[mismatches] if mismatches else []),
            Section(title="Inputs and tools", parts=[*differing, Table(title="Tools", rows=tools)]),
            Section(title="To check this report", parts=_list_commands(result)),
        ],
        above=result["not_checked"],
        lead=[f"Audit of {result['grid']}, {result['ended_utc']}"],
        tone="good" if result["verified"] else "bad",
    )


def _list_dataset_facts(result: Mapping[str, Any]) -> dict[str, str]:
    facts = {
        "address": result["dataset"],
        "grid": f"{result['grid']}, {_count(result['clips'], 'clip')}",
        "run": result["run_id"],
        "seal": result["seal"],
        "SHA-256 of manifest.json": result["manifest_sha256"],
        "signature": result["signature"],
    }
    if result["key_id"]:
        facts |= {"checked with key": result["key_id"], "SHA-256 of that key (DER)": result["key_sha256"]}
    if result["signers"]:
        facts["keys that the envelope names"] = ", ".join(result["signers"])
    return facts


def _list_audit_facts(result: Mapping[str, Any]) -> dict[str, str]:
    machine, tools = result["machine"], result["tools_here"]
    changed = ", changed since" if tools["git"] and tools["git"]["changed"] else ""
    source = f"commit {tools['git']['commit']}{changed}" if tools["git"] else "of no checkout"
    return {
        "began (UTC)": result["started_utc"],
        "ended (UTC)": result["ended_utc"],
        "machine": f"{machine['name']}, {machine['system']}, {machine['processors']} processors",
        "musync": f"{tools['code']['version']}, {source}",
        "asked for": f"a share of {result['share']} of the clips, drawn by seed {result['seed']}, made again in reverse"
        f" order by {_count(result['workers'], 'worker')} ({result['runner']})",
    }


def _list_comparisons(result: Mapping[str, Any]) -> list[str]:
    """Return in sentences what was compared with what, and what of it differs."""
    compared, same = result["compared"], sum(clip["as_recorded"] for clip in result["remade"])
    intact = f"{result['intact']} {'is' if result['intact'] == 1 else 'are'}"
    lines = [
        f"The SHA-256 of {_count(result['files'], 'file')} with the record: {intact} as recorded.",
        f"The decoded content, stored and recorded, of {compared['tables']} tables and {compared['arrays']} arrays of"
        f" {len(result['remade'])} of {result['clips']} clips, made again from the inputs that the dataset keeps:"
        f" {same} of these clips came out as recorded.",
    ]
    if result["unrecorded"]:
        there = "There is" if len(result["unrecorded"]) == 1 else "There are"
        lines.append(
            f"{there} {_count(len(result['unrecorded']), 'file')} that nobody recorded:"
            f" {', '.join(result['unrecorded'])}."
        )
    contradictions = (
        _count(len(result["contradictions"]), "contradiction") if result["contradictions"] else None
    )
    return [
        *lines,
        "Every table, record and array's metadata with the plan, the kept inputs and the bytes that muSync writes, of"
        f" all clips: {contradictions or 'no contradictions'}.",
        *(f"Records that contradict each other: {sentence}" for sentence in result["contradictions"]),
        *(f"No clip could be made again: {problem}" for problem in result["not_remade"]),
    ]


def _list_commands(result: Mapping[str, Any]) -> list[str | Command]:
    key = " --key PUBLIC.pem" if result["key_id"] else ""
    return [
        "The first command takes about a second a gigabyte; the second makes the same clips again. The dataset is the"
        " one of this report if the SHA-256 of its manifest.json is the one above.",
        Command(
            text=f"musync verify DIR{key}\nmusync audit DIR --share {result['share']} --seed {result['seed']}{key}"
        ),
    ]


def _describe_outcome(clip: Mapping[str, Any]) -> Cell:
    same = clip["as_recorded"]
    return Cell(value="as recorded" if same else "differs", tone="good" if same else "bad")


def _count(number: int, thing: str) -> str:
    return f"{number} {thing}{'' if number == 1 else 's'}"


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
