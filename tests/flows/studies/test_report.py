"""The page of a study: what is in its tables, and that text is nothing but text."""

import json
from pathlib import Path

import pytest

from flows.pages import make_policy
from flows.studies.report import Drawing, StudyTable, write_study_page
from flows.studies.vehicle_model import run_sensitivity
from tests.flows.judging.test_pages import HOSTILE, assert_text_alone

ROWS = [{"figure": "stop", "mean": 1.23456, "note": ""}, {"figure": "pitch", "mean": None, "note": ""}]


def test_a_column_that_no_row_fills_is_left_out_and_words_stand_to_the_left():
    table = StudyTable(title="Figures", rows=ROWS)
    assert table.columns == ("figure", "mean")
    assert table.is_text("figure") and not table.is_text("mean")


def test_the_page_has_four_digits_a_dash_for_nothing_and_the_drawing_with_its_words():
    drawing = Drawing(caption="Two curves", svg="<svg><path/></svg>")
    page = write_study_page("Study", "What it asks.", [StudyTable(title="Figures", rows=ROWS)], [drawing])
    assert "<td>1.235</td>" in page and "<td>-</td>" in page and '<td class="text">stop</td>' in page
    assert 'aria-label="Two curves"' in page and drawing.svg in page
    assert "<script" not in page and f'content="{make_policy()}"' in page


def test_a_table_without_rows_is_left_out():
    assert "Figures" not in write_study_page("Study", "", [StudyTable(title="Figures", rows=[])])


@pytest.mark.parametrize("hostile", HOSTILE)
def test_a_study_takes_names_as_text(hostile):
    table = StudyTable(title=hostile, rows=[{hostile: hostile}], note=hostile)
    page = write_study_page(hostile, hostile, [table], [Drawing(caption=hostile, svg="<svg></svg>")])
    assert_text_alone(page, hostile)


def test_the_sensitivity_has_its_page_with_every_printed_figure(tmp_path: Path):
    result = run_sensitivity(out=str(tmp_path))
    page = (tmp_path / "sensitivity.html").read_text()
    assert len(result["beside_print"]) == 17
    assert all(f">{row['figure']}<" in page for row in result["beside_print"])
    assert page.count("<svg") == 1 and (tmp_path / "sensitivity.svg").read_text() in page
    assert json.loads((tmp_path / "sensitivity.json").read_text())["beside_print"] == result["beside_print"]
