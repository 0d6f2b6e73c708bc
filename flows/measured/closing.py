"""Closing the loop: a measured campaign in, a verdict, a grown vehicle and a report out."""

from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from catalogs.campaigns import read_campaign
from catalogs.entries import find_entry, load
from catalogs.vehicles import VehicleFile, open_vehicle
from flows.measured.closing_ledger import count_readings, record_reading
from flows.measured.friction_pulls import compute_friction_pulls, describe_friction_pulls
from flows.measured.grown_vehicle import grown_vehicle, tyre_beside
from flows.measured.residuals import compute_residual_rmse, predict_runs
from flows.measured.verdict_report import write_verdict_page
from flows.store.outputs import Outputs
from manifests.canonical import sha256_of, sha256_of_file
from manifests.provenance import code_version
from tasks.campaign.braking_heat import estimate_disc_temperatures
from tasks.campaign.campaign import CHANNELS, FILE_NUMBERS, SESSION, Campaign
from tasks.identification.decision.answer import ChannelError, NamedEffect, Parameter, Verdict
from tasks.identification.decision.excitation import find_reached_range
from tasks.identification.decision.settling import measure_force
from tasks.identification.decision.verdict import Outcome, judge_runs
from tasks.identification.decision.words import describe_effect, describe_verdict, join_phrases, list_unshared
from tasks.vehicle.effects.library import Effect
from tasks.vehicle.effects.table import PARAMETERS

CARRIED = {name: set(PARAMETERS[name].fields) for name in SESSION if PARAMETERS[name].kind == "scaled"}
"""Fields of a vehicle whose tolerance is that of a number of the session."""


def close_loop(
    campaign: str, *, out: str, vehicle: str | None = None, surface: str = "dense-asphalt"
) -> dict[str, Any]:
    """Trace what a measured campaign shows that the model lacks, and write the model with it.

    The split is hashed and written before anything is fitted. Every reading of held-out runs goes into a ledger before
    a result is written; a call that ends before it has one has read nothing.

    Parameters
    ----------
    campaign : folder with campaign.yaml, runs.csv and runs/*.parquet
    out : folder for ``verdict.json``, ``split.json``, ``report.html`` and the grown vehicle
    vehicle : catalogue name or file; None takes the campaign's
    surface : pavement of the weather mapping, by catalogue name or file

    Raises
    ------
    InputError
        Listing every problem of the campaign, the vehicle or the surface.
    """
    measured = read_campaign(Path(campaign))
    name = vehicle or measured.vehicle
    judged, library = open_vehicle(name), load("library of effects")
    model, road = judged.build(), load("surface", surface)
    measured = estimate_disc_temperatures(measured, model.mass)
    grown = f"{judged.source.stem}-grown.yaml"
    beside = tyre_beside(judged)
    results = Outputs(out, "close-loop", "split.json", "verdict.json", "report.html", grown, *beside)
    results.write_json("split.json", split_of(measured))
    count_readings(measured)  # a faulty ledger is reported before the fit
    measured = replace(measured, tolerances=measured.tolerances.with_session(session_tolerances(judged)))
    outcome = judge_runs(measured, model, road, library, load("set of decision rules"))
    earlier = record_reading(measured, sha256_of([judged.content]))
    result = verdict_json(outcome.verdict, library) | describe_search(outcome, library)
    result = describe_friction_pulls(result, measured.tolerances.friction)
    result["held_out_readings_before"] = earlier
    if earlier:
        result["reasons"].append(
            f"the held-out runs of this campaign have been read {earlier} time(s) before: this is no first look"
        )
    if held := find_unused_tolerances(judged):
        result["reasons"].append(
            f"the file's tolerances of {', '.join(held)} move nothing: a verdict holds these numbers"
        )
    found = replace(outcome.verdict, effects=(*outcome.verdict.effects, *outcome.calibrated))
    text, missing = grown_vehicle(judged, found, _reached_ranges(outcome))
    result["vehicle_file"] = None
    if text is not None:
        for file, content in beside.items():
            results.write(file, content)
        results.write(grown, text)
        load("vehicle", results.path(grown))
        result["vehicle_file"] = str(results.path(grown))
    result["not_carried_by_coupled_mode"] = missing
    results.write_json("verdict.json", result)
    results.write("report.html", write_verdict_page(outcome, result, replace(measured, vehicle=name)))
    result["report"] = str(results.path("report.html"))
    return result


def session_tolerances(file: VehicleFile) -> dict[str, float]:
    """Return the tolerances that a vehicle file gives the numbers that a session may be off by.

    A file that says how well it knows its own numbers knows it better than a campaign does.

    Parameters
    ----------
    file : of the vehicle
    """
    given = file.tolerances
    return {
        name: max(given[f] for f in fields if f in given)
        for name, fields in CARRIED.items()
        if given.keys() & fields
    }


def find_unused_tolerances(file: VehicleFile) -> list[str]:
    """Return the numbers and effects of a vehicle file whose tolerances are those of no number that a session moves.

    Parameters
    ----------
    file : of the vehicle
    """
    moved = set().union(*CARRIED.values())
    return [name for name in file.tolerances if name not in moved]


def _reached_ranges(outcome: Outcome) -> dict[str, tuple[float, float]]:
    """Return what the training runs reached of the variable of each form that is named."""
    verdict, runs = outcome.verdict, [run.model for run in outcome.finding.evidence.train]
    forms = {effect.variable for effect in verdict.effects if effect.effect_class == "form"}
    return {variable: find_reached_range(runs, verdict.theta, verdict.slots, variable) for variable in forms}


def describe_search(outcome: Outcome, library: Sequence[Effect]) -> dict[str, Any]:
    """Return what a search says beside its verdict, as plain values: in words, and what is left over.

    Parameters
    ----------
    outcome : the verdict and what it stands on
    library : of effects
    """
    verdict = outcome.verdict
    train, held_out = predict_runs(outcome)
    planned_for = verdict.experiment.between[0] if verdict.experiment else None
    suggested = next((effect for effect in verdict.tried if effect.name == planned_for), None)
    force = 0.0
    if len(verdict.odds) > 1:
        apart = [effect.name for effect in list_unshared(verdict.effects, verdict.odds)]
        force = measure_force(outcome.finding, outcome.fitted, apart)
    sentence = describe_verdict(verdict, library, suggested, _describe_own_numbers(outcome, library), force)
    return {
        "channels": [CHANNELS[c] for c in train[0].channels],
        "sentence": sentence,
        "calibrated": [effect_json(effect, library) for effect in outcome.calibrated],
        "numbers": _number_json(FILE_NUMBERS, outcome.fitted.session, outcome.fitted.session_error),
        "residual_rmse": compute_residual_rmse((*train, *held_out)),
        "friction_pulls_sigma": compute_friction_pulls(outcome),
    }


def _number_json(
    names: Sequence[str], values: NDArray[np.float64], errors: NDArray[np.float64]
) -> dict[str, dict[str, Any]]:
    """Return fitted numbers of the vehicle, which are added to its file's, as plain values."""
    return {
        name: {"value": float(value), "standard_error": float(error), "unit": PARAMETERS[name].unit}
        for name, value, error in zip(names, values, errors, strict=True)
    }


def _describe_own_numbers(outcome: Outcome, library: Sequence[Effect]) -> str:
    """Return what the numbers that the file hardly knew say of the car, else the one pulled most beside no name."""
    rivals = {rival.name for _, rival in outcome.verdict.rivals}
    if own := [effect for effect in outcome.calibrated if effect.name not in rivals]:
        return join_phrases(describe_effect(effect, library) for effect in own)
    if outcome.verdict.effects or outcome.verdict.experiment is not None:
        return ""
    base = outcome.fitted
    index = int(np.argmax(base.pulls[: len(SESSION)]))
    number = next(e for e in library if e.effect_class == "retune" and e.parameters[0].name == SESSION[index])
    return f"most: {number.describe({SESSION[index]: float(base.session[index])})}"


def split_of(campaign: Campaign) -> dict[str, Any]:
    """Return the facts that are fixed before any fit: hashes and the two parts of the split."""
    return {
        "campaign": campaign.name,
        "content_sha256": campaign.content_hash,
        "split_sha256": campaign.split_hash,
        "train": [run.name for run in campaign.train],
        "held_out": [run.name for run in campaign.held_out],
    }


def verdict_json(verdict: Verdict, library: Sequence[Effect]) -> dict[str, Any]:
    """Return a verdict as plain values."""
    experiment = verdict.experiment
    return {
        "campaign": verdict.campaign,
        "verdict": verdict.verdict,
        "effects": [effect_json(effect, library) for effect in verdict.effects],
        "rivals": [{"of": of, **effect_json(effect, library)} for of, effect in verdict.rivals],
        "odds": [{"names": list(o.names), "odds": o.odds} for o in verdict.odds],
        "discriminating_experiment": None
        if experiment is None
        else {
            "plan": experiment.plan,
            "between": list(experiment.between),
            "expected_d2": experiment.expected_d2,
        },
        "error": {channel: _error(e) for channel, e in verdict.error.items()},
        "manoeuvre_error": {figure: _error(e) for figure, e in verdict.manoeuvre_error.items()},
        "residual_input_correlation": {
            channel: {
                "input": "brake_pressure",
                "lag_s": c.lags.tolist(),
                "frozen": c.frozen.tolist(),
                "after": c.after.tolist(),
                "band": c.band,
            }
            for channel, c in verdict.correlation.items()
        },
        "disagreement": verdict.disagreement,
        "reasons": list(verdict.reasons),
        "tried": [effect_json(effect, library) for effect in verdict.tried],
        "session_pulls_sigma": {
            name: {"before": before, "after": after}
            for name, (before, after) in verdict.session_pulls.items()
        },
        "noise": {name: {"ar1": r, "sigma": s} for name, (r, s) in verdict.noise.items()},
        "disturbance": asdict(verdict.disturbance),
        "runs_left_out": list(verdict.step_sensitive),
        # JSON has no infinity: an effect that this campaign cannot show at any size is null
        "minimum_detectable": {
            name: value if np.isfinite(value) else None for name, value in verdict.detectable.items()
        },
        "content_sha256": verdict.content_hash,
        "split_sha256": verdict.split_hash,
        "library_sha256": sha256_of_file(find_entry("library of effects")),
        "made_with": code_version(),
    }


def _error(e: ChannelError) -> dict[str, Any]:
    return {
        **{key: getattr(e, key) for key in ("frozen", "retuned", "after", "ci_low", "ci_high", "unit")},
        "change_ci_low": e.change_low,
        "change_ci_high": e.change_high,
        "runs_better": e.wins,
        "worst_run": e.worst_run,
    }


def effect_json(effect: NamedEffect, library: Sequence[Effect]) -> dict[str, Any]:
    """Return a named effect as plain values."""
    return {
        "name": effect.name,
        "says": describe_effect(effect, library),
        "class": effect.effect_class,
        "port": effect.port,
        "variable": effect.variable,
        "parameters": {p.name: _parameter(p) for p in effect.parameters},
        "score": effect.score,
        "gain": effect.gain,
        "spread": effect.spread,
    }


def _parameter(p: Parameter) -> dict[str, Any]:
    return {
        "value": p.value, "ci_low": p.ci_low, "ci_high": p.ci_high, "unit": p.unit,
        "lower_bound": p.lower, "upper_bound": p.upper,
    }  # fmt: skip
