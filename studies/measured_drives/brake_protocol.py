"""The brake-dive protocol on a campaign: selection with attrition, leave-one-drive-out, scores."""

import csv
import io
from dataclasses import asdict
from math import isnan
from typing import Any

from catalogs.entries import load
from flows.pages.figures import Figure
from flows.pages.static import as_svg
from flows.pages.writer import Section, Table, write_page
from flows.store.outputs import Outputs
from studies.measured_drives.brake_dive import pitch_mode, with_model
from studies.measured_drives.dive_figure import draw_dives
from studies.measured_drives.drives import read_drives
from studies.measured_drives.leave_one_out import VARIANTS, Fold, Score, leave_one_drive_out, macro_mean
from studies.measured_drives.plans import load_plan
from studies.measured_drives.selection import Judged, select_events, tabulate_attrition
from tasks.vehicle.parameters import Vehicle

SCORE_UNITS = {
    "pitch_rmse": "deg", "pitch_correlation": "1", "rate_rmse": "deg/s", "rate_correlation": "1", "no_dive_rmse": "deg",
}  # fmt: skip


DIVES, PAGE = "dives.svg", "brake_protocol.html"


def brake_protocol(
    campaign: str,
    *,
    protocol: str = "brake-dive",
    vehicle: str | None = None,
    all_events: bool = False,
    out: str | None = None,
) -> dict[str, Any]:
    """Select braking events by rule and predict each drive from a calibration on the others.

    Parameters
    ----------
    campaign : campaign folder with brake pressure, speed, acceleration and pitch
    protocol : protocol by name or YAML file
    vehicle : to start from, by name or YAML file; None takes the campaign's
    all_events : go on with every candidate, whatever rules it breaks; the table stays as it is
    out : folder for ``brake_protocol.json``, ``brake_protocol.html``, ``attrition.csv`` and, where two drives have
        events, ``dives.svg``; None writes none

    Returns
    -------
    ``episodes``, ``candidates``, ``retained``, ``used``, ``unassessed``, ``attrition[]``, ``events[]``, ``folds[]``,
    ``macro[]`` and ``units``; a figure that cannot be had is null.

    Raises
    ------
    InputError
        If the campaign lacks what the protocol needs.
    """
    results = Outputs(out, "lab brake-protocol", "brake_protocol.json", "attrition.csv", DIVES, PAGE)
    rules = load_plan("protocol", protocol)
    recorded = read_drives(campaign)
    base = load("vehicle", vehicle or recorded.vehicle)
    selection = select_events(recorded.drives, rules)
    used = tuple(judged.event for judged in selection.judged) if all_events else selection.retained
    folds = leave_one_drive_out(used, base, load("surface", "dense-asphalt"))
    table = [asdict(row) for row in tabulate_attrition(selection, rules)]
    result: dict[str, Any] = {
        "campaign": recorded.name,
        "vehicle": base.name,
        "drives": len({drive.drive for drive in recorded.drives}),
        "episodes": selection.episodes,
        "candidates": len(selection.judged),
        "retained": len(selection.retained),
        "used": len(used),
        "unassessed": list(selection.unassessed),
        "attrition": table,
        "events": [_event_row(judged) for judged in selection.judged],
        "folds": [_fold_row(fold, base) for fold in folds],
        "macro": [
            {"variant": variant, **_score_row(macro_mean(folds, variant))}
            for variant in VARIANTS
            if any(fold.variant == variant for fold in folds)
        ],
        "units": SCORE_UNITS,
    }
    if not folds:
        result["note"] = "leaving a drive out needs events in at least two drives"
    results.write_json("brake_protocol.json", result)
    text = io.StringIO()
    writer = csv.DictWriter(text, list(table[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(table)
    results.write("attrition.csv", text.getvalue())
    figures = []
    if folds:
        # of the last variant pitch and its rate calibrate, where the rate was measured
        variant = result["macro"][-1]["variant"]
        figures = [draw_dives([fold for fold in result["folds"] if fold["variant"] == variant])]
        results.write(DIVES, as_svg(figures[0]))
    results.write(PAGE, _write_page(result, figures))
    return result


def _write_page(result: dict[str, Any], figures: list[Figure]) -> str:
    folds = [
        {name: value for name, value in fold.items() if name != "mean_trajectory"} for fold in result["folds"]
    ]
    units = ", ".join(f"{name} [{unit}]" for name, unit in SCORE_UNITS.items() if unit != "1")
    return write_page(
        "muSync: brake dives",
        f"Brake dives of {result['campaign']}",
        [
            Section(title="Dives", parts=figures),
            Section(title="Predictions", parts=[
                Table(title="Mean over drives", rows=result["macro"], note=units), Table(title="Drives", rows=folds),
            ]),
            Section(title="Rules, and how many events break each",
                    parts=[Table(rows=result["attrition"])]),
        ],
        lead=[f"The paper's Appendix C.5: of {result['candidates']} candidate events in {result['drives']} drives"
        f" {result['retained']} keep all rules. Each drive is predicted from a calibration on the others."
        f" {result.get('note', '')}"],
    )  # fmt: skip


def _event_row(judged: Judged) -> dict[str, Any]:
    event = judged.event
    return {
        "drive": event.drive,
        "run": event.run,
        "at_s": event.at,
        "start_speed_km_h": event.start_speed * 3.6,
        "failed": list(judged.failed),
        "values": {name: _number(value) for name, value in judged.values.items()},
    }


def _fold_row(fold: Fold, base: Vehicle) -> dict[str, Any]:
    frequency, _ = pitch_mode(with_model(base, fold.model))
    return {
        "variant": fold.variant,
        "drive": fold.drive,
        "events": len(fold.scores),
        "trained_on": fold.trained_on,
        **_score_row(fold.mean),
        "peak_ratio": _number(fold.peak_ratio),
        "brake_gain_n_m_per_mpa": fold.model.brake_gain,
        "pitch_gain": fold.model.pitch_gain,
        "pitch_frequency_hz": frequency,
        "damping_ratio": fold.model.damping_ratio,
        "mean_trajectory": {
            "time_s": fold.time.round(6).tolist(),
            "dive_deg": fold.dive.tolist(),
            "predicted_dive_deg": fold.predicted_dive.tolist(),
        },
    }


def _score_row(score: Score) -> dict[str, float | None]:
    return {name: _number(value) for name, value in asdict(score).items()}


def _number(value: float) -> float | None:
    return None if isnan(value) else value
