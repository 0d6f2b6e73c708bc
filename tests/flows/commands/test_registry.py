"""A command is registered once: its function, its Prefect flow and its options agree."""

import re
import subprocess
import sys
from inspect import Parameter, signature

import pytest
from typer.testing import CliRunner

from flows import parser
from flows.cli import app
from flows.commands.command import REQUIRED, Command, define_argument, define_option
from flows.registry import COMMANDS, import_function
from manifests.provenance import SOURCE_ROOT
from tasks.errors import InputError

FRONT = {
    "Datasets": {
        "validate",
        "generate",
        "materialise",
        "drive",
        "schedule",
        "status",
        "sql",
        "report",
        "export",
    },
    "Audits": {"verify", "audit", "explain"},
    "Measured data": {"import-measurements", "close-loop"},
    "Groups": {"scene", "vehicle", "lab"},
}


@pytest.mark.parametrize("command", COMMANDS, ids=lambda command: command.name)
def test_the_function_of_a_command_takes_its_options_with_their_defaults(command):
    known = signature(import_function(command)).parameters
    extra = any(parameter.kind is Parameter.VAR_KEYWORD for parameter in known.values())
    for chosen in command.options:
        assert chosen.name in known or extra, chosen.name
        if chosen.name in known and chosen.default is not REQUIRED:
            assert known[chosen.name].default in (chosen.default, Parameter.empty), chosen.name
    needed = {name for name, p in known.items() if p.default is p.empty and p.kind is not p.VAR_KEYWORD}
    assert needed <= {chosen.name for chosen in command.options}
    if command.output == "sentences":
        assert hasattr(sys.modules[import_function(command).__module__], "format_text")


@pytest.mark.parametrize("command", COMMANDS, ids=lambda command: command.name)
def test_values_that_the_shell_completes_exist(command):
    for chosen in command.options:
        if isinstance(chosen.known, str):
            assert list(SOURCE_ROOT.glob(chosen.known)), chosen.known


def test_help_lists_what_daily_work_needs_below_the_heading_of_its_users_and_three_groups():
    listed: dict[str, set[str]] = {}
    for line in CliRunner().invoke(app, ["--help"], terminal_width=200).output.splitlines():
        if heading := re.match(r"╭─ (.+?) ─", line):
            names = listed.setdefault(heading[1], set())
        elif row := re.match(r"│ ([a-z-]+) ", line):
            names.add(row[1])
    assert {group: names for group, names in listed.items() if group != "Options"} == FRONT
    assert len({command.name for command in COMMANDS}) == len(COMMANDS)


@pytest.mark.parametrize("command", COMMANDS, ids=lambda command: command.name)
def test_help_shows_each_text_with_its_units_and_no_default_without_meaning(command):
    """Rich takes [m] for markup unless it is told not to."""
    shown = CliRunner().invoke(app, [*command.name.split(), "--help"], env={"COLUMNS": "400"}).output
    shown = " ".join(shown.replace("│", " ").split())
    for chosen in command.options:
        assert chosen.help in shown and chosen.help.endswith("."), chosen.name
    assert not re.search(r"\d{7}|<bool>(?! Show this message)", shown)


def test_version_names_the_package_and_the_commit(monkeypatch):
    facts = {"commit": "0123456789abcdef", "changed": False}
    monkeypatch.setattr("manifests.provenance.git_commit", lambda: facts)
    assert CliRunner().invoke(app, ["--version"]).output == "musync 0.1.0 (commit 0123456789ab)\n"
    monkeypatch.setattr("manifests.provenance.git_commit", lambda: None)
    assert CliRunner().invoke(app, ["--version"]).output == "musync 0.1.0\n"


def test_help_imports_neither_arrays_nor_prefect():
    code = (
        "import sys; from flows.cli import app\n"
        "try: app(['--help'])\n"
        "except SystemExit: pass\n"
        "print({'numpy', 'torch', 'dask', 'prefect', 'pandas', 'pyarrow', 'pydantic'} & set(sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=SOURCE_ROOT)
    assert done.stdout.endswith("set()\n"), done.stdout[-300:] + done.stderr


@pytest.mark.parametrize(
    ("typed", "found"),
    [
        ("musync validate sev", ["severity"]),
        ("musync generate demo --runner pro", ["processes"]),
        ("musync lab audit-p", ["audit-physics"]),
    ],
)
def test_the_shell_completes_commands_names_and_choices(typed, found):
    answer = CliRunner().invoke(
        app,
        prog_name="musync",
        env={
            "_MUSYNC_COMPLETE": "complete_bash",
            "COMP_WORDS": typed,
            "COMP_CWORD": str(len(typed.split()) - 1),
        },
    )
    assert answer.output.split() == found


def test_only_what_may_lie_in_an_object_store_may_be_an_address():
    command = Command(
        name="copy",
        group="Datasets",
        sentence="",
        function="builtins:dict",
        options=(define_argument("dataset", str, "", in_store=True), define_option("out", str, "")),
    )
    assert parser.run_function(command, {"dataset": "s3://a/b", "out": "folder"}, False)["out"] == "folder"
    with pytest.raises(InputError, match="--out s3://a/b: must be a folder"):
        parser.run_function(command, {"dataset": "s3://a/b", "out": "s3://a/b"}, False)
