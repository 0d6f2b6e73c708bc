"""The page of effects is the table of effects."""

from pathlib import Path

from tasks.vehicle.effects.table import EFFECT_TABLE

PAGE = Path(__file__).parents[2] / "docs" / "reference" / "effects.md"


def test_the_page_lists_the_table():
    rows = [
        f"| `{row.name}` | {row.effect} | {row.unit} | {row.port.replace('_', ' ')} | {row.kind} |"
        f" {', '.join(f'`{field}`' for field in row.fields)} | {row.lower:g} to {row.upper:g} | {row.source} |"
        for row in EFFECT_TABLE
    ]
    lines = PAGE.read_text(encoding="utf-8").splitlines()
    assert [line for line in lines if line.startswith("| `")] == rows
