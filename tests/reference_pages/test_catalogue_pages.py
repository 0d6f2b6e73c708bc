"""Pages of the catalogues hold every entry of every file, as the file has it, and nothing of it as markup."""

import re
from pathlib import Path

import pytest
import yaml

from catalogs.entries import CATALOGUE, entry_names
from catalogs.vehicles import open_vehicle
from reference_pages import catalogues
from reference_pages.markdown import format_cell, format_table, format_value

PAGES = {name.split("/")[-1]: write() for name, write in catalogues.WRITERS.items()}


def rows_of(page: str) -> list[list[str]]:
    return [
        re.split(r" (?<!\\)\| ", line.strip("| ")) for line in page.splitlines() if line.startswith("| `")
    ]


@pytest.mark.parametrize("path", sorted((CATALOGUE / "weather").glob("*.yaml")), ids=lambda path: path.stem)
def test_every_number_of_a_weather_stands_on_its_page_with_value_unit_and_source(path: Path) -> None:
    entries = dict(catalogues.list_quantities(yaml.safe_load(path.read_text())))
    section = PAGES["weather.md"].split(f"\n## {path.stem}\n")[1].split("\n## ")[0]
    rows = {row[0].strip("`"): row for row in rows_of(section)}
    assert rows.keys() == entries.keys() and entries
    for name, entry in entries.items():
        assert rows[name][1:3] == [format_cell(entry["value"]), entry["unit"]]
        assert rows[name][-1] == format_cell(entry["source"])


def test_vehicles_stand_side_by_side_to_the_last_digit_the_papers_first() -> None:
    table = PAGES["vehicles.md"].split("\n## ")[1]
    head = next(line for line in table.splitlines() if line.startswith("| number"))
    names = re.findall("`(.*?)`", head)
    assert names[0] == "paper-reference" and set(names) == set(entry_names("vehicle"))
    rows = {row[0].strip("`"): row[2:] for row in rows_of(table)}
    for column, name in enumerate(names):
        for number, entry in open_vehicle(name).numbers.items():
            assert float(rows[number][column]) == entry.value, f"{name} {number}"


def test_what_a_source_says_is_text_and_its_doi_leads_to_the_work() -> None:
    doi = "doi:10.1175/1520-0469(1948)005<0165:TDORWS>2.0.CO;2"
    cell = format_cell(f"a_b *c* [d] | <e>, {doi}, 1 % `x_y|z`")
    assert cell.startswith(r"a\_b \*c\* \[d\] \| &lt;e>, [doi:10.1175/")
    assert "(https://doi.org/10.1175/1520-0469%281948%29005%3C0165%3ATDORWS%3E2.0.CO" in cell
    assert r"`x_y\|z`" in cell


def test_values_are_short_and_exact_and_empty_columns_are_left_out() -> None:
    assert [format_value(v) for v in (193268.620855, 1e6, [1, 2.5], None, True)] == [
        "193268.620855",
        "1000000",
        "1, 2.5",
        "",
        "yes",
    ]
    assert format_table(("a", "b", "c"), [("1", "", "3"), ("2", None, "4")]).splitlines()[0] == "| a | c |"
