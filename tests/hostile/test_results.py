"""Folders of results that are somebody's, and words of a stranger in pages, file names and on the terminal."""

import json
import re
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from flows.auditing.audit import audit_dataset
from flows.auditing.dataset_diff import compare_datasets
from flows.auditing.explain import explain_frame
from flows.auditing.repair import repair_dataset
from flows.auditing.verify import verify_dataset
from flows.cli import app
from flows.reading.previews import make_films
from flows.reading.report import make_report
from flows.store.outputs import FORMAT, MARKER
from studies.paper.sheets import draw_sheets
from studies.physics_judge.audit_physics import audit_physics
from tasks.errors import InputError
from tests.flows.reseal import reseal
from tests.hostile.stage import COMMANDS, Stage, endure, listing

RESULTS: dict[str, Callable[[str, str], Any]] = {
    "report": lambda dataset, out: make_report(dataset, out=out),
    "preview": lambda dataset, out: make_films(dataset, out),
    "sheets": lambda dataset, out: draw_sheets(dataset, out, station=2.0),
    "verify": lambda dataset, out: verify_dataset(dataset, out=out),
    "repair": lambda dataset, out: repair_dataset(dataset, out=out, runner="threads", workers=1),
    "audit": lambda dataset, out: audit_dataset(dataset, share=0, out=out),
    "explain": lambda dataset, out: explain_frame(dataset, "dry/flat", 3, out=out),
    "diff": lambda dataset, out: compare_datasets(dataset, dataset, out=out),
    "audit-physics": lambda dataset, out: audit_physics(dataset, out=out),
}
FILES = (
    "index.html", "clips/holiday.mp4", "media/wedding.mp4", "data.js", "manifest.json", "verify.json", "repair.json",
    "audit.json", "audit.txt", "explain.json", "explain.txt", "diff.json", "diff.txt", "physics.json", "dry-flat.mp4",
    "traces/x.json", "films/x.mp4", "plotly.min.js", "contact_sheets", "seasons.png",
)  # fmt: skip


def fill(folder: Path) -> dict[str, str]:
    for name in FILES:
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        if not path.exists():
            path.write_text(f"somebody's {name}")
    return listing(folder)


def unchanged(folder: Path, before: dict[str, str]) -> bool:
    after = listing(folder)
    return {name: after.get(name) for name in before} == before


@pytest.mark.parametrize("command", RESULTS)
def test_results_into_a_folder_of_somebody_s_files_leave_them_as_they_are(stage, command):
    out = stage.world / "mine"
    before = fill(out)
    try:
        RESULTS[command](str(stage.dataset.root), str(out))
    except InputError as error:
        assert str(out) in str(error)
    assert unchanged(out, before)


MARKERS: dict[str, Callable[[Path, Path], Any]] = {
    "that claims everything": lambda out, victim: {
        name: command for name in FILES for command in ("report",)
    },
    "with ways out": lambda out, victim: {
        "../victim/id_rsa": "report",
        "clips/../../victim/id_rsa": "report",
    },
    "with a folder that is a link": lambda out, victim: {"link/id_rsa": "report", "link/lock": "report"},
    "with a file that is a link": lambda out, victim: {"film.mp4": "report", "index.html": "report"},
    "with NUL": lambda out, victim: {"a\0b": "report"},
}


@pytest.mark.parametrize("command", ["report", "preview", "sheets"])
@pytest.mark.parametrize("attack", MARKERS)
def test_a_forged_marker(stage, attack, command):
    """It names files that muSync wrote, in a folder from elsewhere: nothing outside goes, and no link is followed."""
    out = stage.world / "mine"
    fill(out)
    (out / "link").symlink_to(stage.victim)
    (out / "film.mp4").symlink_to(stage.victim / "id_rsa")
    files = MARKERS[attack](out, stage.victim)
    files = dict.fromkeys(files, command) if isinstance(files, dict) else files
    (out / MARKER).write_text(json.dumps({"format": FORMAT, "files": files}))
    before, own = listing(stage.victim), listing(out)
    with suppress(InputError):
        RESULTS[command](str(stage.dataset.root), str(out))
    assert listing(stage.victim) == before
    if "claims" not in attack:
        del own[MARKER]
        assert unchanged(out, own)


@pytest.mark.parametrize("command", RESULTS)
def test_results_into_a_link_or_a_file_reach_nothing_behind_it(stage, command):
    out = stage.world / "mine"
    before = listing(stage.victim)
    out.mkdir()
    for name in FILES:
        if "/" not in name:
            (out / name).symlink_to(stage.victim / "id_rsa")
    for name in ("media", "traces", "films"):
        (out / name).symlink_to(stage.victim)
    with suppress(InputError):
        RESULTS[command](str(stage.dataset.root), str(out))
    assert listing(stage.victim) == before


WORDS = {
    "markup": "[/red][bold]x[link=file:///etc/passwd]",
    "the end of a script": "</script><script>alert(document.cookie)</script>",
    "a way out": "../../../victim/id_rsa",
    "a shell": "$(touch PWNED); `touch PWNED`",
    "an option": "--out=/owned-by-a-stranger",
    "look-alikes": "dry⁄flat‮gnp.",
}


@pytest.mark.parametrize("attack", WORDS)
def test_a_label_that_is(stage, attack):
    def rename(record: Any) -> None:
        record["clips"][0]["label"] = WORDS[attack]
        record["clips"][0].get("verdict", {})["reasons"] = [WORDS[attack]]

    plan = json.loads(stage.dataset.plan.read_text())
    plan["clips"][0]["label"] = WORDS[attack]
    stage.dataset.plan.write_text(json.dumps(plan))
    reseal(stage.dataset, rename)
    endure(stage, "describe", "preview", "report")
    results = stage.world / "results"
    assert not Path("PWNED").exists() and not Path("/owned-by-a-stranger").exists()
    for page in results.rglob("*.html"):
        text = page.read_text()
        assert "<script>alert" not in text and "onload='alert" not in text
    for script in results.rglob("*.js"):
        assert (
            not re.search(r"</script", script.read_text().split("plotly")[0], flags=re.I)
            or "plotly" in script.name
        )


ESCAPES = ("\x1b[31m", "\x1b]8;;http://evil\x07", "\x9b31m", "\r", "‮")


@pytest.mark.parametrize("command", ["describe", "verify", "explain"])
def test_a_terminal_is_given_no_control_characters_of_a_stranger_s(stage, command):
    """Through file names, which may hold all of them, and through records, which may not."""
    for escape in ESCAPES:
        (stage.dataset.telemetry / f"{escape.replace('/', '')}[red].parquet").write_text("x")
    plan = json.loads(stage.dataset.plan.read_text())
    plan["clips"][0]["label"] = "".join(ESCAPES)
    stage.dataset.plan.write_text(json.dumps(plan))
    reseal(stage.dataset, lambda m: m["clips"][0].update(label="".join(ESCAPES)))
    arguments = ["".join(ESCAPES), "3"] if command == "explain" else []
    ended = CliRunner().invoke(app, [command, str(stage.dataset.root), *arguments])
    assert ended.exception is None or isinstance(ended.exception, InputError | SystemExit), ended.exception
    assert not any(escape in ended.output for escape in ESCAPES)


def test_every_command_takes_the_honest_dataset(stage: Stage):
    """A dataset that is as muSync wrote it is not refused: the control of all attacks."""
    outcomes = endure(stage, *COMMANDS)
    refused = {name: outcome for name, outcome in outcomes.items() if isinstance(outcome, InputError)}
    assert refused == {}
    assert outcomes["verify"]["verified"] and outcomes["audit"]["verified"] and outcomes["repair"]["repaired"]
