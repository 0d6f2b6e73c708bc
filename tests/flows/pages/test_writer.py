"""A page: what is in its tables and figures, what its policy lets run, and that text is nothing but text."""

import json
import re
from html.parser import HTMLParser
from pathlib import Path

import pytest

from flows.pages.figures import Figure, Line, Panel, Style, as_plotly
from flows.pages.writer import Cell, Command, Picture, Section, Table, make_policy, write_page
from studies.paper.sensitivity import run_sensitivity
from tests.browsers import find_barriers, open_chromium

HOSTILE = [
    '<img src=x onerror="alert(1)">', "</title></style><script>alert(1)</script>", "\"'><svg onload=alert(1)>",
    "<a href=javascript:alert(1)>", r"$\frac$", r"\$x$", "&lt;b&gt;", "{{ 7 * 7 }}", "var(--a)",
]  # fmt: skip
ROWS = [{"figure": "stop", "mean": 1.23456, "note": ""}, {"figure": "pitch", "mean": None, "note": ""}]


class Elements(HTMLParser):
    """Tags, attributes, text and scripts of a page."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.attributes: list[tuple[str, str | None]] = []
        self.scripts: list[str] = []
        self.text: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.attributes += attributes
        if tag == "script":
            self.scripts.append("")

    def handle_data(self, text: str) -> None:
        if self.cdata_elem == "script":
            self.scripts[-1] += text
        else:
            self.text.append(text)


def assert_text_alone(html: str, hostile: str) -> Elements:
    """The page has no element but the writer's, and its policy runs no script but plotly and the writer's own."""
    found = Elements(html)
    assert not {"iframe", "object", "a", "form", "svg"} & set(found.tags)
    assert not [name for name, _ in found.attributes if name.startswith("on")]
    assert not [
        value for name, value in found.attributes if name == "src" and not (value or "").startswith("data:")
    ]
    data = [text for text in found.scripts if text.startswith("{")]
    own = [text for text in found.scripts if not text.startswith("{")]
    assert all(json.loads(text).keys() == {"data", "layout"} for text in data)
    assert len(own) == (2 if data else 0) and not any(hostile in text for text in own)
    (policy,) = (
        value for name, value in found.attributes if name == "content" and "default-src" in str(value)
    )
    assert set(make_policy(scripts=own).split("; ")) - set(str(policy).split("; ")) <= {
        "style-src 'unsafe-inline'"
    }
    assert any(hostile in text for text in found.text)
    return found


def draw(name: str) -> Figure:
    line = Line(name=name, x=[0.0, 1.0, 2.0], y=[1.0, None, float("nan")], low=[0, 0, 0], high=[2, 2, 2])
    other = Line(name="other", x=[0.0, 2.0], y=[1.23456789, 0.0], style=Style("b", "dotted"))
    panels = [Panel(title=name, x=name, y=name, lines=[line, other], shaded=[(0.5, 1.0)]) for _ in range(2)]
    return Figure(caption=name, panels=panels, columns=2)


def test_a_policy_runs_the_pages_own_scripts_and_fetches_nothing():
    own = "'sha256-5KYv+PUboo5h+0+YAtGRPbwv5d/QxzHslP4YGnUaxRw='"  # openssl dgst -sha256 -binary | base64
    closed = {"default-src 'none'", "base-uri 'none'", "form-action 'none'", "img-src data:"}
    assert set(make_policy().split("; ")) == closed | {"style-src 'unsafe-inline'"}
    assert f"style-src {own}" in make_policy(style="go()").split("; ")
    assert set(make_policy(scripts=["go()"]).split("; ")) == {f"script-src {own}", *make_policy().split("; ")}


def test_a_column_that_no_row_fills_is_left_out_and_words_stand_to_the_left():
    table = Table(rows=ROWS)
    assert table.columns == ["figure", "mean"]
    assert table.is_text("figure") and not table.is_text("mean")


def test_the_page_has_four_digits_a_dash_for_nothing_marks_and_hashes():
    rows = [*ROWS, "group", {"figure": Cell(value="x", tone="bad"), "mean": "ab" * 32}]
    page = write_page(
        "t", "Study", [Section(title="s", parts=[Table(rows=rows)]), Section(title="none", parts=[])]
    )
    cells = re.findall(r'<t[dh][^>]*?class="(.*?)"[^>]*>(.*?)</', page)
    assert {
        ("text", "1.235"),
        ("text", "–"),
        ("bad text", "x"),
        ("hash text", "ab" * 32),
        ("text", "group"),
    } - {(" ".join(look.split()), text) for look, text in cells} == set()
    assert "<script" not in page and "none</h2>" not in page


def test_a_table_without_rows_is_left_out():
    assert "Figures" not in write_page("t", "", [Section(title="s", parts=[Table(title="Figures", rows=[])])])


def test_a_figure_names_each_line_once_and_rounds_what_json_can_hold():
    figure = draw("one")
    assert [line.name for line in figure.key] == ["one", "other"]
    drawn = json.loads(json.dumps(as_plotly(figure), allow_nan=False))
    assert [trace["y"] for trace in drawn["data"][2:4]] == [[1.0, None, None], [1.23457, 0.0]]
    assert {trace["legendgroup"] for trace in drawn["data"][:3]} == {"one"}


@pytest.mark.parametrize("hostile", HOSTILE)
def test_a_page_takes_names_as_text(hostile):
    parts = [
        hostile, [hostile], {hostile: hostile}, Command(text=hostile), draw(hostile),
        Table(title=hostile, rows=[{hostile: hostile}, hostile], note=hostile),
        [Picture(caption=hostile, sources=["data:,"])],
    ]  # fmt: skip
    section = Section(title=hostile, parts=parts)
    assert_text_alone(write_page(hostile, hostile, [section], lead=[hostile], above=hostile), hostile)


def test_a_browser_shows_names_as_text_in_figures_too(tmp_path):
    (tmp_path / "page.html").write_text(
        write_page("t", "h", [Section(title="s", parts=list(map(draw, HOSTILE)))])
    )
    with open_chromium() as browser:
        page = browser.new_page()
        page.goto((tmp_path / "page.html").as_uri())
        assert page.locator(".plot a").count() == 0
        shown = page.locator(".plot .annotation-text").all_text_contents()
    assert shown == [name for name in HOSTILE for _ in range(2)]


def test_figures_are_drawn_for_the_screen_and_the_keys_and_keep_nobody_out(tmp_path):
    section = Section(title="s", parts=[draw("one"), draw("one")])
    (tmp_path / "page.html").write_text(write_page("t", "h", [section]))
    with open_chromium() as browser:
        page = browser.new_page(viewport={"width": 400, "height": 800}, color_scheme="dark")
        heard: list[str] = []
        page.on("request", lambda request: heard.append(request.url))
        page.on("console", lambda message: heard.append(message.text))
        page.on("pageerror", lambda error: heard.append(str(error)))
        page.goto((tmp_path / "page.html").as_uri())
        plot = page.locator(".plot").first
        axis = "p => p._fullLayout.xaxis.range.map(Number)"
        assert plot.evaluate("p => p.layout.grid.columns") == 1
        assert page.evaluate("document.documentElement.scrollWidth") <= 400
        plot.focus()
        for key, wanted in (("+", [0.5, 1.5]), ("ArrowRight", [0.75, 1.75]), ("Home", [0.0, 2.0])):
            page.keyboard.press(key)
            assert plot.evaluate(axis) == pytest.approx(wanted)
        page.locator("[data-act=in]").first.click()
        page.locator("[data-line=other]").first.click()
        assert plot.evaluate(axis) == pytest.approx([0.5, 1.5]), "what is zoomed to stays"
        shown = page.locator(".plot").last.evaluate(
            "p => p.data.filter((l) => l.visible).map((l) => l.legendgroup)"
        )
        assert set(shown) == {"one"}, "a line is hidden in all figures"
        page.set_viewport_size({"width": 1200, "height": 800})
        # asked again and again from here: the page's policy lets no text of the browser's own waiting be evaluated
        for _ in range(200):
            if plot.evaluate("p => p.layout.grid.columns") == 2:
                break
            page.wait_for_timeout(20)
        assert plot.evaluate("p => p.layout.grid.columns") == 2
        assert find_barriers(browser, tmp_path / "page.html") == []
    assert [word for word in heard if not word.startswith(("file:", "data:"))] == []


def test_the_sensitivity_has_its_page_with_every_printed_figure(tmp_path: Path):
    result = run_sensitivity(out=str(tmp_path))
    page = (tmp_path / "sensitivity.html").read_text()
    assert len(result["beside_print"]) == 17
    assert all(f">{row['figure']}<" in page for row in result["beside_print"])
    assert page.count('class="plot"') == 1 and (tmp_path / "sensitivity.svg").read_text().startswith("<svg")
    assert json.loads((tmp_path / "sensitivity.json").read_text())["beside_print"] == result["beside_print"]
