"""Tables that pages ask for: every command, effect, grid key, field and input has its row, as the code has it."""

import re

import yaml

from catalogs.entries import find_entry
from catalogs.grids import GridFile
from catalogs.scenario import OPTIONAL_FIELDS, SCENARIO_FIELDS, Scenario, find_range_problems, list_ranges
from flows.registry import COMMANDS
from reference_pages import commands, grids, vehicle
from tasks.vehicle.effects.table import PARAMETERS


def rows_of(table: str) -> dict[str, list[str]]:
    lines = [
        re.split(r" (?<!\\)\| ", line.strip("| ")) for line in table.splitlines() if line.startswith("| `")
    ]
    return {row[0].strip("`"): row[1:] for row in lines}


def test_every_command_stands_in_its_section_with_all_its_options() -> None:
    page = commands.write_commands()
    for command in COMMANDS:
        word = command.name.rpartition(" ")[0] or "Daily work"
        group = page.split(f"\n## {word}\n")[1].split("\n## ")[0]
        section = group.split(f"\n### {command.name}\n")[1].split("\n### ")[0]
        assert command.sentence in section and f"    musync {command.name} " in section
        assert len(rows_of(section)) == len(command.options)
    audit = page.split("\n### audit\n")[1]
    assert rows_of(audit)["--share"][:2] == ["number", "`0.1`"]


def test_every_effect_and_every_number_of_a_fit_has_its_row() -> None:
    library = yaml.safe_load(find_entry("library of effects").read_text())
    assert list(rows_of(vehicle.write_effect_table())) == [entry["name"] for entry in library]
    rows = rows_of(vehicle.write_number_table())
    assert list(rows) == list(PARAMETERS)
    assert rows["drag_area"][1:3] == ["m2", "0 to 10"] and rows["drag_area"][4] == "under `effects`"
    assert rows["mass"][4] == "`sprung_mass`, `pitch_inertia`, by a share of it" and rows["slope"][4] == ""


def test_every_key_of_a_grid_has_its_row_with_the_default_that_the_reader_takes() -> None:
    rows = rows_of(grids.write_key_table())
    assert rows.keys() == GridFile.model_fields.keys()
    read = GridFile(name="t", scenarios={"a": {}})
    assert rows["frames"][:3] == [str(read.frames), "", "2 to 600000"]
    assert rows["frame_rate_hz"][:2] == ["10", "Hz"] and rows["name"][0] == "required"
    assert [name for name, row in rows.items() if not row[-1]] == []


def test_a_number_of_a_scenario_may_reach_the_ends_of_its_range_and_go_no_further() -> None:
    rows = rows_of(grids.write_field_table())
    assert {*rows} == {*SCENARIO_FIELDS, *OPTIONAL_FIELDS, "objects"}
    assert rows["precipitation_mm_h"][:3] == ["0", "mm h-1", "rain: 0 to 1872, snow: 0 to 50"]
    for name, (least, most) in list_ranges().items():
        beyond = {most: most * 1.001} | ({} if least is None else {least: least - 0.001})
        assert [find_range_problems(Scenario(**{name: end})) for end in beyond] == [[]] * len(beyond), name
        assert all(find_range_problems(Scenario(**{name: value})) for value in beyond.values()), name
