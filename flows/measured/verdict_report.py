"""The page of a verdict: one HTML file that needs no other."""

import shlex
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from flows.measured.closing_error_rates import tell_error_rates
from flows.measured.friction_pulls import find_pulled_runs
from flows.measured.residuals import predict_runs
from flows.measured.verdict_figures import (
    format_plain_unit,
    make_brake_curve,
    make_residual_figures,
    make_spline_figures,
)
from flows.pages import DATASET_PAGE, make_policy, read_plotly
from tasks.campaign.campaign import Campaign
from tasks.identification.decision.verdict import Outcome
from tasks.vehicle.effects.library import Effect

PAGE = Path(__file__).parent / "verdict_page"
IMPORT = "musync import-measurements RECORDINGS --map MAP.yaml --out CAMPAIGN"
MEANING = {
    "FOUND": "the model lacks this",
    "SET": "one of several explanations that these runs cannot tell apart",
    "UNKNOWN_FORM": "the model lacks a term outside the library: this port, this variable, this shape",
    "RETUNE": "no physics is missing; a number of the vehicle is wrong",
    "SENSOR": "no physics is missing; an instrument has an error",
    "NOTHING": "nothing is proven to be missing",
}
MISSED = "what is missing cannot be named"
"""Meaning of NOTHING where the runs disagree with the model by more than their noise."""


def write_verdict_page(outcome: Outcome, result: Mapping[str, Any], campaign: Campaign) -> str:
    """Return the page.

    Scripts run by their hashes alone: one that got in with a name of the campaign would not, and nothing is fetched.

    Parameters
    ----------
    outcome : the verdict and what it stands on
    result : the verdict as plain values
    campaign : measured runs
    """
    pages = Environment(loader=FileSystemLoader(PAGE), autoescape=True, undefined=StrictUndefined)
    pages.filters |= {"digits": _format_digits, "words": _format_name, "unit": format_plain_unit}
    scripts = (read_plotly(), (PAGE / "page.js").read_text())
    style = "\n".join(sheet.read_text() for sheet in (DATASET_PAGE / "report.css", PAGE / "page.css"))
    train, held_out = predict_runs(outcome)
    figures = {"runs": make_residual_figures(held_out), "curve": make_brake_curve(train)}
    figures |= make_spline_figures(outcome) | {"correlation": result["residual_input_correlation"]}
    detectable = [
        (e.name, e.parameters[0], result["minimum_detectable"].get(e.name)) for e in _list_effects(outcome)
    ]
    return pages.get_template("verdict.html").render(
        campaign=campaign, result=result, meaning=_tell_meaning(result), steps=find_next_steps(result, campaign),
        figures=figures, style=style, scripts=scripts, policy=make_policy(scripts=scripts),
        tried=outcome.verdict.tried, detectable=detectable,
        error_rates=tell_error_rates([effect["name"] for effect in result["effects"]]),
    )  # fmt: skip


def find_next_steps(result: Mapping[str, Any], campaign: Campaign) -> list[tuple[str, str]]:
    """Return what to do next: a sentence and a command each.

    Parameters
    ----------
    result : the verdict as plain values
    campaign : that was judged
    """
    steps = []
    experiment = result["discriminating_experiment"]
    if experiment is not None:
        between = " from ".join(name.replace("_", " ") for name in experiment["between"])
        steps.append(
            (f"Record “{experiment['plan']}”, which tells {between}, and import it with the others:", IMPORT)
        )
    elif result["rivals"]:
        steps.append(
            (
                "Record the run that tells the explanations apart (above), and import it with the others:",
                IMPORT,
            )
        )
    elif result["verdict"] == "NOTHING":
        if result["disagreement"]:
            wanted = "more runs in the conditions of those that the model misses, at several speeds,"
        elif find_pulled_runs(result):
            wanted = "stops at the limit of friction, from several speeds on each surface,"
        else:
            wanted = "runs that reach further than these, faster and harder,"
        steps.append((f"Record {wanted} and import them with the others:", IMPORT))
    grown = result["vehicle_file"]
    name = grown or campaign.vehicle
    if grown is not None:
        steps.append(
            ("See whether the grown vehicle is plausible:", f"musync vehicle check {shlex.quote(name)}")
        )
    car = "the grown vehicle" if grown is not None else "the vehicle as it is"
    out = shlex.quote(f"datasets/{Path(name).stem}")
    steps.append(
        (
            f"Make a dataset of telemetry with {car}:",
            f"musync generate demo --vehicle {shlex.quote(name)} --no-frames --out {out}",
        )
    )
    return steps


def _tell_meaning(result: Mapping[str, Any]) -> str:
    missed = result["verdict"] == "NOTHING" and result["disagreement"]
    return MISSED if missed else MEANING[result["verdict"]]


def _list_effects(outcome: Outcome) -> list[Effect]:
    """Return every effect that was weighed, once."""
    candidates = outcome.finding.grams.columns.candidates
    return list({c.name: c.effect for c in candidates if c.effect is not None}.values())


def _format_digits(value: float | None) -> str:
    return "–" if value is None else f"{value:.3g}"


def _format_name(name: str) -> str:
    return name.replace("_", " ")
