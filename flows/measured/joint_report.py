"""The page of a verdict by a joint fit: one HTML file that needs no other."""

import base64
import hashlib
import shlex
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from flows.measured.closing_report import MEANING
from flows.measured.joint_report_figures import (
    alike_numbers,
    brake_curve,
    plain_unit,
    residuals_by_run,
    separating_run,
)
from flows.reading.report import PAGE as DATASET_PAGE
from tasks.campaign.campaign import Campaign
from tasks.identification.joint.verdict import JointTrace

PAGE = Path(__file__).parent / "joint_report_page"
IMPORT = "musync import-measurements RECORDINGS --map MAP.yaml --out CAMPAIGN"


def joint_report_html(trace: JointTrace, result: Mapping[str, Any], campaign: Campaign) -> str:
    """Return the page.

    Scripts run by their hashes alone: one that got in with a name of the campaign would not, and nothing is fetched.

    Parameters
    ----------
    trace : the verdict and what it stands on
    result : the verdict as plain values
    campaign : measured runs
    """
    pages = Environment(loader=FileSystemLoader(PAGE), autoescape=True, undefined=StrictUndefined)
    pages.filters |= {"digits": _digits, "words": _words, "unit": plain_unit}
    scripts = (_read_plotly(), (PAGE / "page.js").read_text())
    style = "\n".join(sheet.read_text() for sheet in (DATASET_PAGE / "report.css", PAGE / "page.css"))
    residuals = residuals_by_run(trace)
    return pages.get_template("page.html").render(
        campaign=campaign,
        result=result,
        meaning=MEANING[result["verdict"]],
        says=_plain_words(trace),
        separate=_separations(trace),
        alike=alike_numbers(trace.fitted),
        steps=next_steps(result, campaign),
        runs=residuals,
        held_out=len(trace.held_out),
        figures={"runs": residuals, "curve": brake_curve(trace)},
        style=style,
        scripts=scripts,
        policy=_policy(scripts),
    )


def next_steps(result: Mapping[str, Any], campaign: Campaign) -> list[tuple[str, str]]:
    """Return what to do next: a sentence and a command each.

    Parameters
    ----------
    result : the verdict as plain values
    campaign : that was judged
    """
    steps = []
    if result["rivals"]:
        steps.append(
            (
                "Record the run that tells the explanations apart (above), and import it with the others:",
                IMPORT,
            )
        )
    elif result["verdict"] == "NOTHING":
        steps.append(
            (
                "Record runs that reach further than these, faster and harder, and import them with the others:",
                IMPORT,
            )
        )
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


def _plain_words(trace: JointTrace) -> dict[str, str]:
    """Return the finding in plain words for each number of the fit and of its rivals."""
    fits = (trace.fitted, *(other.fitted for other in trace.substitutes))
    return {n.name: n.say(fit.by_name[n.name]) for fit in reversed(fits) for n in fit.numbers}


def _separations(trace: JointTrace) -> list[str | None]:
    """Return the run that tells each rival from what is named, in the order of the rivals."""
    named = {effect.name: effect.parameters[0].name for effect in trace.verdict.effects}
    return [
        separating_run([n for n in trace.fitted.numbers if n.name == named.get(of)])
        for of, _ in trace.verdict.rivals
    ]


def _policy(scripts: tuple[str, ...]) -> str:
    """Return the content-security policy under which these scripts run, and no other."""
    hashes = " ".join(
        f"'sha256-{base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()}'"
        for script in scripts
    )
    return (
        f"default-src 'none'; script-src {hashes}; style-src 'unsafe-inline'; img-src data: blob:;"
        " base-uri 'none'; form-action 'none'"
    )


def _digits(value: float | None) -> str:
    return "–" if value is None else f"{value:.3g}"


def _words(name: str) -> str:
    return name.replace("_", " ")


def _read_plotly() -> str:
    # its import takes a second, which no other verdict should pay
    from plotly.offline import get_plotlyjs

    source: str = get_plotlyjs()
    return source
