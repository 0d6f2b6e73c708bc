"""The page of a verdict: what an engineer reads first, nothing from outside, and no text that is more than text."""

import json
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from catalogs.entries import load
from flows.measured.closing import describe_search, verdict_json
from flows.measured.residuals import predict_runs
from flows.measured.verdict_figures import format_plain_unit, make_brake_curve
from flows.measured.verdict_report import MISSED, find_next_steps, write_verdict_page
from studies.closing_benchmark.synthetic import make_synthetic_campaign
from tasks.campaign.campaign import Campaign
from tasks.campaign.planned_runs import RunPlan
from tasks.identification.decision.verdict import Outcome, judge_runs
from tests.browsers import find_barriers, open_chromium

VEHICLE, SURFACE = load("vehicle", "paper-reference"), load("surface", "dense-asphalt")
LIBRARY = load("library of effects")
STOPS = tuple(
    RunPlan(speed=speed, peak=peak, duration=2.6, disc_rise=20.0)
    for speed, peak in ((16.0, 1.2), (20.0, 1.8), (12.0, 0.8))
)
HOSTILE = "</script><script>alert('1')</script>\"><img src=https://a.example/x onerror=alert(2)>{{ 7 * 7 }}"


class Page(HTMLParser):
    """Elements, the text of scripts, and all other text."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.scripts: list[str] = []
        """Of the figures, and after them the page's own two."""
        self.words = ""
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attrs)))
        if tag == "script":
            self.scripts.append("")

    def handle_data(self, data: str) -> None:
        if self.cdata_elem == "script":
            self.scripts[-1] += data
        elif self.cdata_elem is None:
            self.words += f"{data} "


def facts(outcome: Outcome, **more: Any) -> dict[str, Any]:
    told: dict[str, Any] = {
        "held_out_readings_before": 0,
        "vehicle_file": "out/car-grown.yaml",
        "not_carried_by_coupled_mode": [],
    }
    return verdict_json(outcome.verdict, LIBRARY) | describe_search(outcome, LIBRARY) | told | more


@pytest.fixture(scope="module")
def judged() -> tuple[Outcome, Campaign]:
    """A campaign of three stops with a lag, whose runs, vehicle and name would like to be more than text."""
    made = make_synthetic_campaign(VEHICLE, SURFACE, {"lag": 0.1, "pressure_gain": 0.2}, 7, design=STOPS)
    runs = tuple(replace(r, name=f"{HOSTILE} {k}", held_out=k == 2) for k, r in enumerate(made.runs))
    campaign = replace(made, runs=runs, name=HOSTILE, vehicle=HOSTILE)
    campaign = replace(campaign, tolerances=campaign.tolerances.with_session({"pressure_gain": 0.2}))
    library = tuple(
        e
        for e in load("library of effects")
        if e.name in {"brake_lag", "brake_dead_time", "retuned_pressure_gain"}
    )
    outcome = judge_runs(campaign, VEHICLE, SURFACE, library, load("set of decision rules"))
    (lag,) = outcome.verdict.effects
    rival = replace(
        lag, name="brake_dead_time", parameters=(replace(lag.parameters[0], name="dead_time", value=0.08),)
    )
    verdict = replace(outcome.verdict, verdict="SET", rivals=(("brake_lag", rival),))
    return replace(outcome, verdict=verdict), campaign


@pytest.fixture(scope="module")
def text(judged: tuple[Outcome, Campaign]) -> str:
    outcome, campaign = judged
    return write_verdict_page(outcome, facts(outcome), campaign)


def test_where_nothing_is_named_the_verdict_says_whether_the_model_misses_the_runs(
    judged: tuple[Outcome, Campaign],
) -> None:
    nothing = replace(judged[0].verdict, effects=(), rivals=())
    sentences = [
        describe_search(replace(judged[0], verdict=replace(nothing, disagreement=why)), LIBRARY)["sentence"]
        for why in ("", "the runs disagree")
    ]
    assert sentences[0].startswith("These runs show nothing that the model lacks. Its own numbers, fitted to")
    assert sentences[1].startswith("The model misses these runs")
    missed = replace(judged[0], verdict=replace(nothing, verdict="NOTHING", disagreement="the runs disagree"))
    page = write_verdict_page(missed, facts(missed), judged[1])
    assert MISSED in page and "more runs in the conditions of those that the model misses" in page


def test_the_first_sentence_says_whether_stops_are_missed_beside_what_is_named(
    judged: tuple[Outcome, Campaign],
) -> None:
    """A gain 15 % off took the stops from 7 to 2.6 m, twelve times the noise, and read as if that were all."""
    rest = "The speed is still missed by more than its noise: more is lacking than that."
    for misses in (False, True):
        outcome = replace(judged[0], verdict=replace(judged[0].verdict, misses=misses))
        assert describe_search(outcome, LIBRARY)["sentence"].endswith(rest) is misses


def test_the_page_says_the_verdict_its_numbers_rivals_and_what_to_do_next(
    text: str, judged: tuple[Outcome, Campaign]
) -> None:
    outcome, _ = judged
    words = " ".join(Page(text).words.split())
    assert words.index(facts(outcome)["sentence"]) < words.index("Verdict SET")
    lag = facts(outcome)["effects"][0]["parameters"]["lag"]
    assert f"lag {lag['value']:.3g} {lag['ci_low']:.3g} to {lag['ci_high']:.3g} s" in words
    (gain,) = facts(outcome)["calibrated"]
    assert f"within what the vehicle file and these runs know of it: {gain['says']}" in words
    assert "brake lag and brake dead time" in words
    assert "musync generate demo --vehicle out/car-grown.yaml --no-frames --out datasets/car-grown" in words
    distance = outcome.verdict.manoeuvre_error["stopping_distance"]
    told = f"stopping distance {distance.frozen:.3g} {distance.retuned:.3g} {distance.after:.3g} one run m"
    assert told in words
    assert all(reason in words for reason in outcome.verdict.reasons)


def test_names_of_a_campaign_are_text_and_nothing_comes_from_outside(text: str) -> None:
    page = Page(text)
    assert page.words.count(HOSTILE) >= 4
    assert "img" not in [tag for tag, _ in page.elements]
    addresses = [v for _, a in page.elements for k, v in a.items() if k in {"src", "href", "action"}]
    assert addresses == ["data:,"]


def test_figures_show_what_was_measured_predicted_and_left_and_have_a_text(
    text: str, judged: tuple[Outcome, Campaign]
) -> None:
    outcome, _ = judged
    page = Page(text)
    run, *rest = (json.loads(text) for text in page.scripts[:-2])
    assert run["layout"]["annotations"][0]["text"] == "speed" and len(rest) > 1
    drawn = {(line["xaxis"], line["legendgroup"]): line["y"] for line in run["data"] if line.get("name")}
    ((predicted,), (model,)) = predict_runs(outcome)[1], outcome.finding.evidence.held_out
    for key in ("frozen", "after"):
        left = model.measured[:, 0] - predicted.predicted[key][:, 0]
        assert np.allclose(drawn["x", key], predicted.predicted[key][:, 0], rtol=1e-4, atol=1e-6)
        assert np.allclose(drawn["x2", key], left, rtol=1e-4, atol=1e-6)
    assert np.allclose(drawn["x", "measured"], model.measured[:, 0], rtol=1e-4, atol=1e-6)
    low, high = (
        line["y"]
        for line in run["data"]
        if line["xaxis"] == "x2" and line["y"].count(None) == 0 and len(line["y"]) == 2
    )
    assert high[0] == -low[0] == pytest.approx(1.96 * facts(outcome)["noise"]["speed"]["sigma"], rel=1e-3)
    plots = [a for _, a in page.elements if a.get("class") == "plot"]
    assert len(plots) == len(page.scripts) - 2 and all(
        a["tabindex"] == "0" and a["aria-label"] for a in plots
    )


def test_the_curve_follows_what_was_measured_where_the_frozen_model_does_not(
    judged: tuple[Outcome, Campaign],
) -> None:
    curve = {
        name: np.array(values, float) for name, values in make_brake_curve(predict_runs(judged[0])[0]).items()
    }
    off = {name: np.abs(curve[name] - curve["measured"]).mean() for name in ("frozen", "fitted")}
    assert len(curve["low"]) > 4 and off["fitted"] < 0.5 * off["frozen"]
    assert np.all(curve["low"] <= curve["measured"]) and np.all(curve["measured"] <= curve["high"])
    assert np.all(np.diff(curve["pressure_mpa"]) > 0)


@pytest.mark.parametrize(
    ("more", "commands"),
    [
        ({"verdict": "NOTHING", "rivals": [], "vehicle_file": None}, ["import-measurements", "generate"]),
        ({"verdict": "FOUND", "rivals": []}, ["vehicle", "generate"]),
        ({}, ["import-measurements", "vehicle", "generate"]),
    ],
)
def test_the_next_step_follows_from_the_verdict(
    judged: tuple[Outcome, Campaign], more: dict[str, Any], commands: list[str]
) -> None:
    outcome, campaign = judged
    steps = find_next_steps(facts(outcome, **more), replace(campaign, vehicle="a car; rm -r x"))
    assert [command.split()[1] for _, command in steps] == commands
    assert all("; rm" not in command or "'a car; rm -r x'" in command for _, command in steps)


def test_the_page_fits_a_narrow_screen_fetches_nothing_and_keeps_nobody_out(
    text: str, tmp_path: Path
) -> None:
    (tmp_path / "report.html").write_text(text)
    heard: list[str] = []
    with open_chromium() as browser:
        page = browser.new_page(viewport={"width": 400, "height": 800}, color_scheme="dark")
        page.on("request", lambda request: heard.append(request.url))
        page.on("console", lambda message: heard.append(message.text))
        page.on("pageerror", lambda error: heard.append(str(error)))
        page.goto((tmp_path / "report.html").as_uri())
        assert page.evaluate("document.documentElement.scrollWidth") <= 400
        assert find_barriers(browser, tmp_path / "report.html") == []
    assert [word for word in heard if not word.startswith(("file:", "data:"))] == []


@pytest.mark.parametrize(
    ("unit", "read"),
    [("m2", "m²"), ("m/s^2", "m/s²"), ("(100 K)-1", "(100 K)⁻¹"), ("N s2 m-2", "N s² m⁻²"), ("1", "")],
)
def test_a_unit_has_its_powers_raised_and_its_numbers_not(unit: str, read: str) -> None:
    assert format_plain_unit(unit) == read
