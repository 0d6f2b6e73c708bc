"""Pages and figures that we write: text of users and datasets is text in them."""

from html.parser import HTMLParser
from types import SimpleNamespace

import numpy as np
import pytest

from flows.drawing import NO_SCRIPTS
from flows.judging.evaluation_page import render_page
from flows.judging.evaluation_rows import figure_row
from flows.measured import closing_report

HOSTILE = [
    '<img src=x onerror="alert(1)">', "</title></style><script>alert(1)</script>", "\"'><svg onload=alert(1)>",
    "<a href=javascript:alert(1)>", r"$\frac$", r"\$x$", "&lt;b&gt;",
]  # fmt: skip


class Elements(HTMLParser):
    """Tags, attributes and text of a page."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.attributes: list[tuple[str, str | None]] = []
        self.text: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.attributes += attributes

    def handle_data(self, text: str) -> None:
        self.text.append(text)


def assert_text_alone(html: str, hostile: str) -> Elements:
    found = Elements(html)
    assert not {"script", "iframe", "object", "a", "form"} & set(found.tags)
    assert not [name for name, _ in found.attributes if name.startswith("on")]
    assert not [
        value for name, value in found.attributes if name == "src" and not (value or "").startswith("data:")
    ]
    assert NO_SCRIPTS in html
    assert any(hostile in text for text in found.text)
    return found


@pytest.mark.parametrize("hostile", HOSTILE)
def test_the_evaluation_takes_labels_as_text(hostile):
    times = np.linspace(0, 1, 5)
    motion = SimpleNamespace(pitch=np.zeros(5))
    clip = SimpleNamespace(
        facts={"label": hostile}, frames={"pitch": np.zeros(5)}, times=times, motions={hostile: motion},
        thumbnails=[np.zeros((4, 6, 3), np.uint8)],
    )  # fmt: skip
    rows = [
        figure_row("pitch_rmse", hostile, hostile, 1.0, "deg", note=hostile),
        figure_row("e_geometry_hump", hostile, hostile, 1.0, "1", floor=0.5, note=hostile),
    ]
    found = assert_text_alone(render_page([clip], rows, hostile, hostile), hostile)
    assert sum(text == hostile for text in found.text) > 5


@pytest.mark.parametrize("hostile", HOSTILE)
def test_the_close_loop_report_takes_names_as_text(monkeypatch, hostile):
    drawn = dict.fromkeys(
        (
            "residual_force",
            "draw_residual_spline",
            "draw_spline_gains",
            "draw_correlations",
            "draw_traces",
            "draw_session_pulls",
        ),
        lambda trace: "",
    )
    monkeypatch.setattr(closing_report, "figures", SimpleNamespace(**drawn))
    monkeypatch.setattr(closing_report, "residuals_over_time", lambda trace: "")
    number = {
        "value": 1.0,
        "ci_low": 0.0,
        "ci_high": 2.0,
        "unit": hostile,
        "lower_bound": 0.0,
        "upper_bound": 3.0,
    }
    effect = {"name": hostile, "class": hostile, "port": hostile, "parameters": {hostile: number}}
    error = dict.fromkeys(
        ("frozen", "retuned", "after", "ci_low", "ci_high", "change_ci_low", "change_ci_high"), 1.0
    )
    hashes = dict.fromkeys(("content_sha256", "split_sha256", "library_sha256", "source_sha256"), hostile)
    result = hashes | {
        "verdict": "FOUND", "effects": [effect], "rivals": [effect | {"of": hostile}], "reasons": [hostile],
        "runs_left_out": [hostile], "not_carried_by_coupled_mode": [hostile], "manoeuvre_error": {},
        "error": {hostile: error | {"unit": hostile, "runs_better": hostile, "worst_run": hostile}},
        "discriminating_experiment": {"plan": hostile, "between": [hostile, hostile], "expected_d2": 1.0},
        "minimum_detectable": {}, "made_with": hashes, "held_out_readings_before": 0,
    }  # fmt: skip
    trace = SimpleNamespace(
        compared=[], verdict=SimpleNamespace(tried=[]),
        start=SimpleNamespace(evidence=SimpleNamespace(effects=[])),
    )  # fmt: skip
    run = SimpleNamespace(name=hostile)
    campaign = SimpleNamespace(name=hostile, vehicle=hostile, train=[run], held_out=[run])
    assert_text_alone(closing_report.report_html(trace, result, campaign), hostile)
