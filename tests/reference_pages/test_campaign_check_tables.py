"""The table of the page on checks: every check of the catalogue, as the file has it."""

import re

import yaml

from catalogs.entries import find_entry
from reference_pages.markdown import format_cell
from reference_pages.pages import insert_tables
from tests.documents import DOCS

PAGE = insert_tables((DOCS / "reference" / "campaign-checks.md").read_text())
CONTENT = yaml.safe_load(find_entry("table of checks").read_text())
CHECKS = {
    name: check for group, checks in CONTENT.items() if group != "spans" for name, check in checks.items()
}


def rows_of(heading: str) -> list[list[str]]:
    section = PAGE.split(f"\n## {heading}\n")[1].split("\n## ")[0]
    lines = [line for line in section.splitlines() if line.startswith("| `")]
    return [re.split(r" (?<!\\)\| ", line.strip("| ")) for line in lines]


def test_every_check_stands_on_the_page_with_its_limits_its_sentence_and_where_they_come_from() -> None:
    rows = {row[0].strip("`"): row[1:] for row in rows_of("Checks")}
    assert list(rows) == list(CHECKS)
    for name, check in CHECKS.items():
        _, fault, channels, limits, unit, sentence, source = rows[name]
        assert fault == check["fault"] and (channels == "any") == ("channels" not in check)
        for limit in (check[key] for key in ("lowest", "highest") if key in check):
            assert format_cell(limit["value"]) in limits.split() and unit == format_cell(limit["unit"])
            assert format_cell(limit["source"]) in source
        words = max(re.split(r"\{.*?\}+", check["sentence"]), key=len)
        assert format_cell(words).strip() in sentence and not re.search(r"\{\w+:\.", sentence)
