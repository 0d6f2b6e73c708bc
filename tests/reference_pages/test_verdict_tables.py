"""Tables of the page on a verdict's rules: every number with meaning and reason, each where the page asks for it."""

import re

import yaml

from catalogs.entries import find_entry
from reference_pages.markdown import format_cell
from reference_pages.pages import ASKED, TABLES, insert_tables
from reference_pages.verdict_rules import read_meanings
from tasks.identification.rules import DecisionRules
from tests.documents import DOCS

PAGE = insert_tables((DOCS / "reference" / "verdict-rules.md").read_text())


def rows_of(heading: str) -> dict[str, list[str]]:
    section = PAGE.split(f"\n## {heading}\n")[1].split("\n## ")[0]
    lines = [
        re.split(r" (?<!\\)\| ", line.strip("| ")) for line in section.splitlines() if line.startswith("| `")
    ]
    return {row[0].strip("`"): row[1:] for row in lines}


def test_every_number_of_a_decision_stands_on_the_page_with_meaning_and_reason() -> None:
    numbers, meanings = (
        yaml.safe_load(find_entry("set of decision rules").read_text()),
        read_meanings(DecisionRules),
    )
    rows = rows_of("Numbers of the decision")
    assert rows.keys() == numbers.keys() == meanings.keys() and len(numbers) <= 30
    for name, entry in numbers.items():
        value, unit, meaning, reason = rows[name]
        assert [value, unit] == [format_cell(entry["value"]), entry["unit"]]
        assert meaning == format_cell(meanings[name]) and not meaning.endswith("]")
        assert reason == format_cell(entry["source"])


def test_every_table_is_asked_for_once_and_none_that_is_not_there() -> None:
    asked = [name for page in DOCS.rglob("*.md") for name in ASKED.findall(page.read_text())]
    assert sorted(asked) == sorted(TABLES)
    assert "<!-- table" not in PAGE
