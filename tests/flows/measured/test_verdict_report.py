"""The page of a joint fit: what an engineer reads first, nothing from outside, and no text that is more than text."""

import base64
import hashlib
import json
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from catalogs.decision_rules import load_decision_rules
from catalogs.entries import load
from catalogs.joint_numbers import load_joint_numbers
from flows.measured.closing import tell_search, verdict_json
from flows.measured.residuals import predict_runs
from flows.measured.verdict_figures import find_alike_numbers, format_plain_unit, make_brake_curve
from flows.measured.verdict_report import MISSED, find_next_steps, write_verdict_page
from tasks.campaign.campaign import Campaign
from tasks.campaign.planned_runs import RunPlan
from tasks.identification.benchmark import make_synthetic_campaign
from tasks.identification.joint.verdict import JointOutcome, judge_jointly
from tests.browsers import find_barriers, open_chromium

VEHICLE, SURFACE = load("vehicle", "paper-reference"), load("surface", "dense-asphalt")
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


def facts(outcome: JointOutcome, **more: Any) -> dict[str, Any]:
    told: dict[str, Any] = {
        "held_out_readings_before": 0,
        "vehicle_file": "out/car-grown.yaml",
        "not_carried_by_coupled_mode": [],
    }
    return verdict_json(outcome.verdict) | tell_search(outcome) | told | more


@pytest.fixture(scope="module")
def judged() -> tuple[JointOutcome, Campaign]:
    """A campaign of three stops with a lag, whose runs, vehicle and name would like to be more than text."""
    made = make_synthetic_campaign(VEHICLE, SURFACE, {"lag": 0.1}, 7, design=STOPS)
    runs = tuple(replace(r, name=f"{HOSTILE} {k}", held_out=k == 2) for k, r in enumerate(made.runs))
    campaign = replace(made, runs=runs, name=HOSTILE, vehicle=HOSTILE)
    numbers = [n for n in load_joint_numbers() if n.name in {"pressure_gain", "lag", "dead_time"}]
    return judge_jointly(campaign, VEHICLE, SURFACE, numbers, load_decision_rules()), campaign


@pytest.fixture(scope="module")
def text(judged: tuple[JointOutcome, Campaign]) -> str:
    outcome, campaign = judged
    return write_verdict_page(outcome, facts(outcome), campaign)


def test_where_nothing_is_named_the_verdict_says_whether_the_model_misses_the_runs(
    judged: tuple[JointOutcome, Campaign],
) -> None:
    nothing = replace(judged[0].verdict, effects=(), rivals=())
    sentences = [
        tell_search(replace(judged[0], verdict=replace(nothing, disagreement=why)))["sentence"]
        for why in ("", "the runs disagree")
    ]
    assert sentences[0].startswith("These runs show nothing that the model lacks; its own numbers, fitted to")
    assert sentences[1].startswith("The model misses these runs")
    missed = replace(judged[0], verdict=replace(nothing, verdict="NOTHING", disagreement="the runs disagree"))
    page = write_verdict_page(missed, facts(missed), judged[1])
    assert MISSED in page and "more runs in the conditions of those that the model misses" in page


def test_the_first_sentence_says_whether_stops_are_missed_beside_what_is_named(
    judged: tuple[JointOutcome, Campaign],
) -> None:
    """A gain 15 % off took the stops from 7 to 2.6 m, twelve times the noise, and read as if that were all."""
    rest = "The speed is still missed by more than its noise: more is lacking than that."
    for misses in (False, True):
        outcome = replace(judged[0], verdict=replace(judged[0].verdict, misses=misses))
        assert tell_search(outcome)["sentence"].endswith(rest) is misses


def test_the_page_says_the_verdict_its_numbers_rivals_and_what_to_do_next(
    text: str, judged: tuple[JointOutcome, Campaign]
) -> None:
    outcome, _ = judged
    words = " ".join(Page(text).words.split())
    assert words.index(facts(outcome)["sentence"]) < words.index("Verdict SET")
    lag = facts(outcome)["effects"][0]["parameters"]["lag"]
    assert f"lag {lag['value']:.3g} {lag['ci_low']:.3g} to {lag['ci_high']:.3g} s" in words
    (gain,) = facts(outcome)["calibrated"]
    assert f"within what the vehicle file and these runs know of it: {gain['says']}" in words
    assert "brake lag and brake dead time" in words
    assert "The run that separates them: press the brake in steps" in words
    assert "musync generate demo --vehicle out/car-grown.yaml --no-frames --out datasets/car-grown" in words
    distance = outcome.verdict.manoeuvre_error["stopping_distance"]
    told = f"stopping distance {distance.frozen:.3g} {distance.retuned:.3g} {distance.after:.3g} one run m"
    assert told in words
    assert all(reason in words for reason in outcome.verdict.reasons)


def test_names_of_a_campaign_are_text_and_nothing_comes_from_outside(text: str) -> None:
    page = Page(text)
    assert page.words.count(HOSTILE) >= 4
    assert len(page.scripts) == 3 and "img" not in [tag for tag, _ in page.elements]
    addresses = [v for _, a in page.elements for k, v in a.items() if k in {"src", "href", "action"}]
    assert addresses == ["data:,"]


def test_the_policy_runs_the_scripts_of_the_page_by_hash_and_no_other(text: str) -> None:
    page = Page(text)
    (policy,) = (a["content"] for _, a in page.elements if a.get("http-equiv") == "Content-Security-Policy")
    hashes = {base64.b64encode(hashlib.sha256(s.encode()).digest()).decode() for s in page.scripts[1:]}
    rules = dict(rule.strip().split(" ", 1) for rule in str(policy).split(";"))
    assert set(rules["script-src"].split()) == {f"'sha256-{h}'" for h in hashes}
    assert rules["default-src"] == "'none'" and "http" not in str(policy)


def test_figures_are_of_residuals_and_have_a_text(text: str, judged: tuple[JointOutcome, Campaign]) -> None:
    outcome, _ = judged
    page = Page(text)
    (run,) = json.loads(page.scripts[0])["runs"]
    speed = run["channels"][0]
    left = outcome.held_out[0].model.measured[:, 0] - outcome.predicted[0][:, :, 0]
    shown = np.array([speed[key] for key in ("frozen", "retuned", "after")])
    assert speed["name"] == "speed" and np.allclose(shown, left, rtol=1e-4, atol=1e-6)
    plots = [a for _, a in page.elements if a.get("class") == "plot"]
    assert len(plots) == 2 and all(a["tabindex"] == "0" and a["aria-label"] for a in plots)


def test_the_curve_follows_what_was_measured_where_the_frozen_model_does_not(
    judged: tuple[JointOutcome, Campaign],
) -> None:
    curve = {
        name: np.array(values, float) for name, values in make_brake_curve(predict_runs(judged[0])[0]).items()
    }
    off = {name: np.abs(curve[name] - curve["measured"]).mean() for name in ("frozen", "fitted")}
    assert len(curve["low"]) > 4 and off["fitted"] < 0.5 * off["frozen"]
    assert np.all(curve["low"] <= curve["measured"]) and np.all(curve["measured"] <= curve["high"])
    assert np.all(np.diff(curve["pressure_mpa"]) > 0)


def test_numbers_that_stand_in_for_each_other_are_told_with_the_run_that_separates_them(
    judged: tuple[JointOutcome, Campaign],
) -> None:
    fitted = judged[0].fitted
    gain, lag = fitted.numbers
    assert (gain.name, lag.name) == ("pressure_gain", "lag")
    near = replace(fitted, information=np.linalg.inv(np.array([[1.0, -0.095], [-0.095, 0.01]])))
    (pair,) = find_alike_numbers(near)
    assert pair["names"] == ("lag", "pressure_gain") and pair["correlation"] == pytest.approx(-0.95)
    assert "press the brake in steps" in pair["separate"]
    far = replace(fitted, information=np.linalg.inv(np.array([[1.0, -0.085], [-0.085, 0.01]])))
    assert find_alike_numbers(far) == []


@pytest.mark.parametrize(
    ("more", "commands"),
    [
        ({"verdict": "NOTHING", "rivals": [], "vehicle_file": None}, ["import-measurements", "generate"]),
        ({"verdict": "FOUND", "rivals": []}, ["vehicle", "generate"]),
        ({}, ["import-measurements", "vehicle", "generate"]),
    ],
)
def test_the_next_step_follows_from_the_verdict(
    judged: tuple[JointOutcome, Campaign], more: dict[str, Any], commands: list[str]
) -> None:
    outcome, campaign = judged
    steps = find_next_steps(facts(outcome, **more), replace(campaign, vehicle="a car; rm -r x"))
    assert [command.split()[1] for _, command in steps] == commands
    assert all("; rm" not in command or "'a car; rm -r x'" in command for _, command in steps)


def test_runs_that_do_not_grip_as_the_mapping_says_ask_for_more_stops_at_the_limit(
    judged: tuple[JointOutcome, Campaign],
) -> None:
    outcome, campaign = judged
    nothing = facts(outcome, verdict="NOTHING", rivals=[], vehicle_file=None)
    first = {
        pull: find_next_steps(nothing | {"friction_pulls_sigma": {"run-1": pull}}, campaign)[0][0]
        for pull in (-2.4, -2.6)
    }
    assert "runs that reach further" in first[-2.4] and "stops at the limit of friction" in first[-2.6]


def test_a_browser_draws_zooms_by_key_fetches_nothing_and_keeps_nobody_out(text: str, tmp_path: Path) -> None:
    (tmp_path / "report.html").write_text(text)
    with open_chromium() as browser:
        page = browser.new_page(viewport={"width": 400, "height": 800}, color_scheme="dark")
        asked: list[str] = []
        wrong: list[str] = []
        page.on("request", lambda request: asked.append(request.url))
        page.on("console", lambda message: wrong.append(message.text))
        page.on("pageerror", lambda error: wrong.append(str(error)))
        page.goto((tmp_path / "report.html").as_uri())
        plot = page.locator(".plot").first
        plot.focus()
        whole = plot.evaluate("p => p.layout.xaxis.range")
        page.keyboard.press("+")
        half = plot.evaluate("p => p.layout.xaxis.range")
        page.keyboard.press("Home")
        page.locator("[data-model=frozen]").click()
        lines = plot.evaluate("p => p.data.map(line => line.name)")
        wide = page.evaluate("document.documentElement.scrollWidth")
        back = plot.evaluate("p => p.layout.xaxis.range")
        barriers = find_barriers(browser, tmp_path / "report.html")
    assert barriers == []
    assert half[1] - half[0] == pytest.approx(0.5 * (whole[1] - whole[0])) and back == pytest.approx(whole)
    assert not any("frozen" in line for line in lines) and any("after" in line for line in lines)
    assert wide <= 400 and wrong == [] and [a for a in asked if not a.startswith(("file:", "data:"))] == []


@pytest.mark.parametrize(
    ("unit", "read"),
    [("m2", "m²"), ("m/s^2", "m/s²"), ("(100 K)-1", "(100 K)⁻¹"), ("N s2 m-2", "N s² m⁻²"), ("1", "1")],
)
def test_a_unit_has_its_powers_raised_and_its_numbers_not(unit: str, read: str) -> None:
    assert format_plain_unit(unit) == read
