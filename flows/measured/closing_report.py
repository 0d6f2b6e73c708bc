"""The close-loop report: one self-contained HTML page."""

from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

from flows.drawing import NO_SCRIPTS
from flows.measured import closing_figures as figures
from flows.measured.closing_error_rates import error_rates_html
from flows.measured.closing_residuals import residuals_over_time
from tasks.campaign.campaign import Campaign
from tasks.identification.decision.verdict import Trace
from tasks.vehicle.effects.library import Effect

STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; max-width: 68rem; margin: 2rem auto; padding: 0 1rem; color: #1b1b1b; }
h1 { font-size: 1.5rem; } h2 { font-size: 1.1rem; margin-top: 2rem; border-bottom: 1px solid #ddd; }
table { border-collapse: collapse; font-size: 13px; margin: .6rem 0; }
th, td { padding: .2rem .6rem; text-align: right; border-bottom: 1px solid #eee; }
th:first-child, td:first-child { text-align: left; }
.verdict { font-size: 1.25rem; padding: .7rem 1rem; background: #eef4fa; border-left: 5px solid #1f6fb2; }
img { max-width: 100%; } code { font-size: 12px; overflow-wrap: anywhere; }
.pair { display: flex; flex-wrap: wrap; gap: 1rem; }
"""
CORRELATION = (
    "<p>Correlation of the held-out residual with brake pressure, both whitened by the channel's noise, over the delay"
    " of the residual. Inside the band the two are compatible with independence. The runs' offsets and smooth"
    " disturbances are not removed, so the correlation of a correct model can leave the band slightly.</p>"
)
MEANING = {
    "FOUND": "the model lacks this",
    "SET": "one of several explanations that these runs cannot tell apart",
    "UNKNOWN_FORM": "the model lacks a term outside the library: this port, this variable, this shape",
    "RETUNE": "no physics is missing; a number of the vehicle is wrong",
    "SENSOR": "no physics is missing; an instrument has an error",
    "NOTHING": "these runs show nothing that the model lacks",
}


def report_html(trace: Trace, result: Mapping[str, Any], campaign: Campaign) -> str:
    """Return the page as HTML.

    Parameters
    ----------
    trace : the verdict with the fits behind it
    result : content of ``verdict.json``
    campaign : the campaign
    """
    parts = [
        _verdict(result),
        _section("Error on held-out runs", _errors({**result["error"], **result["manoeuvre_error"]})),
        _section("Candidates", _ladder(trace)),
        _section("Residual force of the training runs", _image(figures.residual_force(trace))),
        _section(
            "Splines of the residual, frozen and after",
            f'<div class="pair">{_image(figures.draw_residual_spline(trace))}'
            f"{_image(figures.draw_spline_gains(trace))}</div>",
        ),
        _section(
            "Correlation of the residual with brake pressure",
            _image(figures.draw_correlations(trace)) + CORRELATION,
        ),
        _section("Residual of the training runs over time", _image(residuals_over_time(trace))),
        _section("Held-out runs", _image(figures.draw_traces(trace))),
        _section("Pulls of the session", _image(figures.draw_session_pulls(trace))),
        _section("Next experiment", _experiment(result["discriminating_experiment"])),
        _section(
            "Smallest effects that this campaign can show",
            _detectable(result["minimum_detectable"], trace.start.evidence.effects),
        ),
        _section("Error rates of the method", error_rates_html([e["name"] for e in result["effects"]])),
        _section("Data and split, fixed before any fit", _data(result, campaign)),
    ]
    return (
        f'<!doctype html><html lang="en"><head><meta charset="utf-8">{NO_SCRIPTS}<title>{escape(campaign.name)}:'
        f" close-loop</title><style>{STYLE}</style></head><body><h1>Campaign {escape(campaign.name)} against"
        f" {escape(campaign.vehicle)}</h1>{''.join(parts)}</body></html>\n"
    )


def _section(title: str, content: str) -> str:
    return f"<h2>{escape(title)}</h2>{content}"


def _image(data: str) -> str:
    return f'<img alt="" src="data:image/png;base64,{data}">'


def _table(head: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    cells = "".join(
        "<tr>" + "".join(f"<td>{escape(_text(value))}</td>" for value in row) + "</tr>" for row in rows
    )
    return f"<table><tr>{''.join(f'<th>{escape(h)}</th>' for h in head)}</tr>{cells}</table>"


def _text(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.4g}"
    return "-" if value is None else str(value)


def _verdict(result: Mapping[str, Any]) -> str:
    kind = result["verdict"]
    effects = [
        f"<li><b>{escape(e['name'])}</b> ({escape(e['class'])}, at {escape(e['port'])}): {_parameters(e)}</li>"
        for e in result["effects"]
    ]
    rivals = [
        f"<li>cannot be told from {escape(r['of'])}: <b>{escape(r['name'])}</b>, {_parameters(r)}</li>"
        for r in result["rivals"]
    ]
    notes = [f"<li>{escape(reason)}</li>" for reason in result["reasons"]]
    notes += [
        f"<li>left out, because halving the integration step changes its prediction: {escape(name)}</li>"
        for name in result["runs_left_out"]
    ]
    notes += [
        f"<li>no part of the vehicle, so not in the grown one: {escape(name)}</li>"
        for name in result["not_carried_by_coupled_mode"]
    ]
    return (
        f'<p class="verdict"><b>{escape(kind)}</b>: {escape(MEANING[kind])}</p>'
        f"<ul>{''.join(effects)}{''.join(rivals)}</ul><ul>{''.join(notes)}</ul>"
    )


def _parameters(effect: Mapping[str, Any]) -> str:
    return "; ".join(
        f"{escape(name)} = {p['value']:.4g} [{p['ci_low']:.4g}, {p['ci_high']:.4g}] {escape(p['unit'])}"
        f" (bounds {p['lower_bound']:g} to {p['upper_bound']:g})"
        for name, p in effect["parameters"].items()
    )


def _errors(error: Mapping[str, Mapping[str, Any]]) -> str:
    rows = [
        (
            f"{channel} [{e['unit']}]", e["frozen"], e["retuned"], e["after"],
            f"{e['ci_low']:.4g} to {e['ci_high']:.4g}", f"{e['change_ci_low']:.4g} to {e['change_ci_high']:.4g}",
            e["runs_better"], e["worst_run"],
        )
        for channel, e in error.items()
    ]  # fmt: skip
    head = (
        "RMSE",
        "frozen",
        "re-tuned",
        "after",
        "after, 95 %",
        "after - frozen, 95 %",
        "runs better",
        "worst run",
    )
    return _table(head, rows) + (
        "<p>Re-tuned: no effect, the session's tolerances widened tenfold. Intervals: bootstrap over held-out runs."
        " Stopping distance: from the first brake pressure to the lowest speed that all reach; peak pitch: of 0.1 s"
        " means; both over the runs that brake.</p>"
    )


def _ladder(trace: Trace) -> str:
    rows: list[tuple[Any, ...]] = []
    for place, compared in enumerate(trace.compared, start=1):
        near = {id(c) for c, _ in compared.near}
        for candidate, share in ((compared.own, compared.share), *compared.others):
            mark = "named" if candidate is compared.own else "rival" if id(candidate) in near else ""
            rows.append(
                (
                    f"{place}. {candidate.hypothesis.name}", mark, candidate.gain, candidate.inflation,
                    candidate.score, candidate.held_out_gain, share,
                )
            )  # fmt: skip
    for effect in trace.verdict.tried:
        rows.append(
            (
                effect.name,
                "not named",
                effect.gain,
                effect.inflation,
                effect.score,
                effect.held_out_gain,
                None,
            )
        )
    head = ("candidate", "", "log-likelihood gain", "inflation", "score", "held-out gain", "bootstrap share")
    return (
        _table(head, rows)
        if rows
        else "<p>No candidate gained enough in the linear screening to be refined.</p>"
    )


def _experiment(plan: Mapping[str, Any] | None) -> str:
    if plan is None:
        return "<p>Nothing is named, or no planned run would separate the explanations better than this campaign.</p>"
    return (
        f"<p>{escape(plan['plan'])}: tells {escape(plan['between'][0])} from {escape(plan['between'][1])} by an"
        f" expected D&sup2; of {plan['expected_d2']:.3g} per run, with session and disturbances projected out.</p>"
    )


def _detectable(values: Mapping[str, float | None], effects: Sequence[Effect]) -> str:
    rows = [(e.name, e.parameters[0].name, values[e.name], e.parameters[0].unit) for e in effects]
    text = "Smallest first parameter of each library effect that would pass the score; - if no value in bounds would."
    return f"<p>{text}</p>" + _table(("effect", "parameter", "smallest", "unit"), rows)


def _data(result: Mapping[str, Any], campaign: Campaign) -> str:
    lines = [
        f"campaign <code>{escape(result['content_sha256'])}</code>",
        f"split <code>{escape(result['split_sha256'])}</code>",
        f"library <code>{escape(result['library_sha256'])}</code>",
        f"source <code>{escape(result['made_with']['source_sha256'])}</code>",
        f"training runs: {escape(', '.join(run.name for run in campaign.train))}",
        f"held-out runs: {escape(', '.join(run.name for run in campaign.held_out))}",
        f"earlier readings of these held-out runs: {result['held_out_readings_before']}",
    ]
    return f"<ul>{''.join(f'<li>{line}</li>' for line in lines)}</ul>"
