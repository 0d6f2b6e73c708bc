"""The files of deploy/ start commands that exist, with options that exist, and hold no password."""

import configparser
import re
import shlex

import yaml
from typer.testing import CliRunner

from flows.cli import app
from manifests.provenance import SOURCE_ROOT

DEPLOY = SOURCE_ROOT / "deploy"


def refuse_unknown(words: list[str]) -> None:
    """Options are parsed before anything runs; an unknown one, or a word too many, ends with 2 and its name."""
    help_text = CliRunner().invoke(app, [words[0], "--help"], terminal_width=200).output
    for word in words[1:]:
        assert not word.startswith("--") or word.partition("=")[0] in help_text, word


def test_the_worker_and_the_unit_start_a_schedule_with_options_that_exist():
    services = yaml.safe_load((DEPLOY / "compose.yaml").read_text())["services"]
    refuse_unknown(services["worker"]["command"])
    unit = configparser.ConfigParser(strict=False, interpolation=None, delimiters="=")
    unit.optionxform = str
    unit.read(DEPLOY / "musync-schedule.service")
    program, *words = shlex.split(unit["Service"]["ExecStart"])
    assert program.endswith("/bin/musync")
    refuse_unknown(words)


def test_every_setting_of_the_compose_file_is_in_the_example_and_no_password_is():
    named = set(re.findall(r"(?<!\$)\$\{(\w+)", (DEPLOY / "compose.yaml").read_text()))
    example = dict(re.findall(r"^(\w+)=(.*)$", (DEPLOY / "example.env").read_text(), flags=re.M))
    assert named == set(example)
    assert not [
        name for name in example if name.startswith(("POSTGRES", "STORE", "PREFECT")) and example[name]
    ]


def test_the_server_of_the_compose_file_asks_for_the_password_that_the_worker_gives():
    services = yaml.safe_load((DEPLOY / "compose.yaml").read_text())["services"]
    asked, given = (services[name]["environment"] for name in ("prefect", "worker"))
    assert asked["PREFECT_SERVER_API_AUTH_STRING"].startswith("${PREFECT_PASSWORD:?")
    assert given["PREFECT_API_AUTH_STRING"] == "${PREFECT_PASSWORD}"
    assert asked["PREFECT_SERVER_CORS_ALLOWED_ORIGINS"] == "http://127.0.0.1:4200"


def test_services_that_wait_for_another_wait_for_one_that_can_be_healthy():
    services = yaml.safe_load((DEPLOY / "compose.yaml").read_text())["services"]
    for service in services.values():
        for name, rule in service.get("depends_on", {}).items():
            assert rule["condition"] != "service_healthy" or "healthcheck" in services[name]
