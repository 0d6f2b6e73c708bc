"""The page of a verdict: one HTML file that needs no other."""

import re
import shlex
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from flows.measured.closing_error_rates import describe_error_rates
from flows.measured.friction_pulls import find_pulled_runs
from flows.measured.residuals import predict_runs
from flows.measured.verdict_figures import (
    draw_brake_curve,
    draw_correlation,
    draw_run,
    draw_splines,
    format_plain_unit,
)
from flows.pages.writer import Cell, Command, Part, Section, Table, write_page
from tasks.campaign.campaign import Campaign
from tasks.identification.decision.verdict import Outcome
from tasks.identification.decision.words import MOST_WORDS
from tasks.vehicle.effects.library import Effect

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

    Parameters
    ----------
    outcome : the verdict and what it stands on
    result : the verdict as plain values
    campaign : measured runs
    """
    heading, lead = _open_page(result)
    train, held_out = predict_runs(outcome)
    gains, spline = draw_splines(outcome)
    correlation = result["residual_input_correlation"]
    rates = describe_error_rates([effect["name"] for effect in result["effects"]])
    return write_page(
        f"{campaign.name}: close-loop",
        heading,
        [
            Section(title="Verdict", parts=_list_verdict(result)),
            Section(title="Do next", parts=[
                part for sentence, command in find_next_steps(result, campaign)
                for part in (sentence, Command(text=command))
            ]),
            Section(title="What this rests on", parts=[[
                *result["reasons"],
                *(f"left out, because halving the integration step changes its prediction: {name}"
                  for name in result["runs_left_out"]),
            ]]),
            Section(title="Error on held-out runs", parts=[_tabulate_errors(result, len(held_out))]),
            Section(title="Measured and predicted on held-out runs", parts=[
                "Measured, the vehicle file's model (frozen), and the model with what was found (after), beside what"
                " each leaves. A model that is right leaves noise about zero, within the band. Drag over a figure to"
                " zoom, double-click for the whole; with the keyboard, focus a figure: + and − zoom, arrows move, 0"
                " shows the whole.",
                *(draw_run(run, result["noise"], result["residual_rmse"][run.model.run.name]) for run in held_out),
            ]),
            Section(title="Deceleration against brake pressure", parts=[
                "Training runs, medians by pressure; the band holds nine tenths of what was measured. Where the fitted"
                " line leaves the band, the brake does something else than the model says.",
                draw_brake_curve(train),
            ]),
            Section(title="Explanations and their odds", parts=_list_odds(outcome, result)),
            Section(title="Where the residual of the training runs lies", parts=[
                "A spline of each variable at each port, fitted to what the model leaves over: how much it gains,"
                " before and after.",
                spline, Table(title="Gains of splines", rows=gains, digits=3),
            ]),
            Section(title="Correlation of the held-out residual with brake pressure", parts=[
                "Both whitened by the channel's noise, over the time by which the residual follows. Inside the band the"
                " two are compatible with independence. The runs' offsets and smooth disturbances are not removed, so"
                " that a correct model can leave the band slightly.",
                draw_correlation(correlation),
            ] if correlation else []),
            Section(title="The vehicle's own numbers", parts=[_tabulate_own_numbers(result)]),
            Section(title="Smallest effects that this campaign can show",
                    parts=[_tabulate_detectable(outcome, result)]),
            Section(title="How often this method is right", parts=[list(rates)]),
            Section(title="Data and split, fixed before any fit", parts=[{
                "training runs": ", ".join(run.name for run in campaign.train),
                "held-out runs": ", ".join(run.name for run in campaign.held_out),
                "earlier readings": f"{result['held_out_readings_before']} of these held-out runs",
                "campaign": result["content_sha256"], "split": result["split_sha256"],
                "library": result["library_sha256"], "source": result["made_with"]["source_sha256"],
            }]),
        ],
        lead=[*lead, f"{campaign.name} against {campaign.vehicle}"],
    )  # fmt: skip


def _open_page(result: Mapping[str, Any]) -> tuple[str, list[str]]:
    """Return the sentence that a page opens with, and what follows it."""
    first, _, rest = re.sub(r"(?<=\w\.) (?=[A-Z])", "\n", result["sentence"], count=1).partition("\n")
    if len(first.split()) <= MOST_WORDS:
        return first, [rest] if rest else []
    meaning = _describe_meaning(result)
    return f"{meaning[0].upper()}{meaning[1:]}.", [result["sentence"]]


def _list_verdict(result: Mapping[str, Any]) -> list[Part]:
    """Return the verdict's name, what was found, and what it cannot be distinguished from."""
    found = [
        {"in words": "" if k else effect["says"], "kind": "" if k else effect["class"], "number": _as_words(name),
         "value": Cell(value=p["value"], tone="strong"), "95 % interval": _as_range(p),
         "unit": format_plain_unit(p["unit"])}
        for effect in result["effects"]
        for k, (name, p) in enumerate(effect["parameters"].items())
    ]  # fmt: skip
    how = (
        " beside it, and within what the vehicle file and these runs know of it"
        if found
        else ", a number of the vehicle file"
    )
    calibrated = [
        f"Fitted{how}: {effect['says']} ({p['value']:.3g}, 95 % interval {_as_interval(p)})."
        for effect in result["calibrated"]
        for p in effect["parameters"].values()
    ]
    rivals = [
        f"{_as_words(rival['of'])} and {_as_words(rival['name'])} ({rival['says']}; "
        + ", ".join(f"{_as_words(name)} {_as_interval(p)}" for name, p in rival["parameters"].items())
        + ")."
        for rival in result["rivals"]
    ]
    missing = ", ".join(result["not_carried_by_coupled_mode"])
    return [
        f"{result['verdict']}: {_describe_meaning(result)}",
        Table(title="Numbers that were found", rows=found, digits=3,
              note="With the interval that holds the true one in 95 % of cases; shares, which have no unit, and other"
              " numbers are on top of the vehicle file's."),
        *calibrated,
        *(["These runs cannot tell apart:", rivals] if rivals else []),
        *([f"No part of the vehicle, so not in the grown one: {missing}."] if missing else []),
    ]  # fmt: skip


def _tabulate_errors(result: Mapping[str, Any], runs: int) -> Table:
    rows = [
        {"channel": _as_words(name), "frozen": e["frozen"], "re-tuned": e["retuned"],
         "after": Cell(value=e["after"], tone="strong"),
         "after, 95 %": _as_range(e) if e["ci_low"] < e["ci_high"] else "one run",
         "unit": format_plain_unit(e["unit"]), "runs better": e["runs_better"], "worst run": e["worst_run"]}
        for errors in (result["error"], result["manoeuvre_error"])
        for name, e in errors.items()
    ]  # fmt: skip
    note = (
        f"Root mean square over {runs} run{'' if runs == 1 else 's'} to which no number was fitted. Frozen: the vehicle"
        " file. Re-tuned: no effect, with the tolerances of the vehicle's own numbers widened tenfold. After: with all"
        " that was found. These runs had no say in what is named."
    )
    return Table(rows=rows, note=note, digits=3)


def _list_odds(outcome: Outcome, result: Mapping[str, Any]) -> list[Part]:
    """Return what the training runs leave open, what is named of it, and what is not."""
    odds = [
        {"explanation": _as_words(" and ".join(row["names"])) or "nothing",
         "odds": f"{row['odds']:.3g} : 1"}
        for row in result["odds"]
    ]  # fmt: skip
    named = [
        {"named": _as_words(effect["name"]), "log odds": effect["score"], "gain": effect["gain"],
         "scatter of runs": effect["spread"]}
        for effect in result["effects"]
    ]  # fmt: skip
    tried = []
    for effect in outcome.verdict.tried:
        first, *_ = effect.parameters
        value = f"{first.value:.3g} {format_plain_unit(first.unit)}".rstrip()
        tried.append(
            {
                "candidate": _as_words(effect.name),
                "log odds": effect.score,
                "gain": effect.gain,
                "value": value,
            }
        )
    return [
        Table(rows=odds, note="What the training runs leave open, against the first. A name needs 20 : 1, and 20 : 1"
              " that it is larger than what matters."),
        Table(title="What is named", rows=named, digits=3, note="By how much its logarithmic odds and the likelihood"
              " fall without it, and how far the runs scatter about its size."),
        Table(title="Candidates that are not named, beside what is", rows=tried, digits=3),
    ]  # fmt: skip


def _tabulate_own_numbers(result: Mapping[str, Any]) -> Table:
    rows = [
        {"number": _as_words(name), "moved by": f"{result['numbers'][name]['value']:+.4f}",
         "standard error": f"{result['numbers'][name]['standard_error']:.4f}", "before": f"{pull['before']:+.1f}",
         "after": f"{pull['after']:+.1f}"}
        for name, pull in result["session_pulls_sigma"].items()
    ]  # fmt: skip
    note = (
        "By how much these runs move each from the vehicle file, and how far that is in its tolerances: before and"
        " after what is named. Beyond 4 the number is wrong, or stands for something that is missing."
    )
    return Table(rows=rows, note=note)


def _tabulate_detectable(outcome: Outcome, result: Mapping[str, Any]) -> Table:
    rows = []
    for effect in _list_effects(outcome):
        number = effect.parameters[0]
        smallest = result["minimum_detectable"].get(effect.name)
        unit = format_plain_unit(number.unit)
        rows.append(
            {
                "effect": _as_words(effect.name),
                "number": _as_words(number.name),
                "smallest": smallest,
                "unit": unit,
            }
        )
    note = "Of each effect's first number; – where no value within its bounds would be named."
    return Table(rows=rows, note=note, digits=3)


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


def _describe_meaning(result: Mapping[str, Any]) -> str:
    missed = result["verdict"] == "NOTHING" and result["disagreement"]
    return MISSED if missed else MEANING[result["verdict"]]


def _list_effects(outcome: Outcome) -> list[Effect]:
    """Return every effect that was weighed, once."""
    candidates = outcome.finding.grams.columns.candidates
    return list({c.name: c.effect for c in candidates if c.effect is not None}.values())


def _as_range(numbers: Mapping[str, Any]) -> str:
    return f"{numbers['ci_low']:.3g} to {numbers['ci_high']:.3g}"


def _as_interval(parameter: Mapping[str, Any]) -> str:
    return f"{_as_range(parameter)} {format_plain_unit(parameter['unit'])}".rstrip()


def _as_words(name: str) -> str:
    return name.replace("_", " ")
