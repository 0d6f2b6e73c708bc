"""Negative controls: desynchronised copies of a dataset's claims, and which metric sees which."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from catalogs.gates import load_gates
from catalogs.studies.ablation import VARIANTS, Variant, cut
from flows.drawing import as_svg
from flows.judging.controls_figure import roc_figure
from flows.judging.judged_clip import METHODS, JudgedClip, View, judge_clip
from flows.judging.physics import clip_facts
from flows.making.clip import TICK_RATE_HZ, Catalogue, catalogue_of
from flows.making.driving import drive
from flows.making.plan import Plan, read_plan
from flows.running.orchestration import stage
from flows.store.address import reading
from flows.store.layout import write_atomically, write_json
from tasks.errors import InputError
from tasks.eval.negative_controls import Claim, claim_scores, delayed, differs, scaled, separate

CUTS: tuple[Variant, ...] = ("appearance-only", "vertical-only", "fixed-mu")
"""The paper's ablations, as false claims."""
CONTROLS: dict[str, str] = {
    **{name: VARIANTS[name] for name in CUTS},
    "one-frame-delay": "telemetry a frame late",
    "amplitude-0.8": "pitch at 80 %",
    "sign-flip": "pitch upside down",
    "other-clip": "telemetry of another clip",
}
LEAST_PITCH, LEAST_WAY = np.deg2rad(0.05), 0.2
"""A copy that differs by less in pitch [rad] and way [m] is no fault."""


def controls(dataset: str, *, out: str | None = None) -> dict[str, Any]:
    """Desynchronise a dataset in seven ways and say which metric sees which fault, and from what threshold.

    Parameters
    ----------
    dataset : a finished dataset folder
    out : folder for controls.json and controls.svg

    Raises
    ------
    InputError
        If the folder is no finished dataset, or holds fewer than two clips.
    """
    root = reading(dataset).root
    facts = clip_facts(root)
    if len(facts) < 2:
        raise InputError(f"{root}: negative controls need at least two clips; there are {len(facts)}.")
    clips = [stage(judge_clip)(View(root=root), row) for row in facts]
    rows = list(score_controls(clips, read_plan(root), catalogue_of(root)))
    seen: dict[str, list[str]] = {name: [] for name in CONTROLS}
    for row in rows:
        if row["verdict"] == "sees":
            seen[row["control"]].append(f"{row['metric']} by {row['method']}")
    tried = {row["control"] for row in rows}
    result = {
        "controls": [
            {"control": name, "meaning": meaning, "tried": name in tried, "seen_by": seen[name]}
            for name, meaning in CONTROLS.items()
        ],
        "all_detected": all(seen[name] for name in tried),
        "blind": [f"{r['metric']} by {r['method']}: {r['control']}" for r in rows if r["verdict"] == "blind"],
        "rows": rows,
    }
    if out is not None:
        write_json(Path(out) / "controls.json", result)
        write_atomically(Path(out) / "controls.svg", as_svg(roc_figure(rows, CONTROLS)).encode())
    return result


def score_controls(clips: list[JudgedClip], plan: Plan, catalogue: Catalogue) -> Iterator[dict[str, Any]]:
    """One row for each control, method and metric.

    Parameters
    ----------
    clips : as their judges saw them
    plan, catalogue : the dataset's
    """
    response = float(np.deg2rad(load_gates().response_deg))
    true = [Claim(pitch=c.frames["pitch"], station=c.frames["station"]) for c in clips]
    false = [dict(_copies(k, clips, true, plan, catalogue)) for k in range(len(clips))]
    for method in METHODS:
        whole = [k for k, c in enumerate(clips) if not c.motions[method].failed.any()]
        sound = [_scores(clips[k], method, true[k], response) for k in whole]
        for name in CONTROLS:
            faulty = [_scores(clips[k], method, false[k][name], response) for k in whole if name in false[k]]
            for metric in sorted({m for scores in faulty for m in scores}):
                good = [scores[metric] for scores in sound if metric in scores]
                bad = [scores[metric] for scores in faulty if metric in scores]
                if not good:
                    continue
                found = separate(good, bad)
                yield {
                    "control": name,
                    "metric": metric,
                    "method": method,
                    "sound": len(good),
                    "faulty": len(bad),
                    "threshold": found.threshold,
                    "detection_rate": found.detection_rate,
                    "auc": found.auc,
                    "verdict": found.verdict,
                    "roc": {"false_alarms": list(found.false_alarms), "detections": list(found.detections)},
                }


def _scores(clip: JudgedClip, method: str, claim: Claim, response: float) -> dict[str, float]:
    return claim_scores(clip.motions[method], claim, response, clip.times, clip.opening)


def _copies(
    k: int, clips: list[JudgedClip], true: list[Claim], plan: Plan, catalogue: Catalogue
) -> Iterator[tuple[str, Claim]]:
    """Faulty claims of one clip; those that say what the true one says are left out."""
    scenario = next(c.scenario for c in plan.clips if c.clip_id == clips[k].facts["clip_id"])
    made = {"one-frame-delay": delayed(true[k], 1), "amplitude-0.8": scaled(true[k], 0.8),
            "sign-flip": scaled(true[k], -1.0), "other-clip": true[(k + 1) % len(true)]}  # fmt: skip
    ticks = np.rint(np.arange(plan.settings.frames) * TICK_RATE_HZ / plan.settings.frame_rate_hz).astype(int)
    for variant in CUTS:
        _, ride = drive(
            cut(scenario, variant),
            catalogue.vehicle,
            catalogue.surface,
            plan.settings.vehicle_mode,
            plan.duration_s,
        )
        made[variant] = Claim(pitch=ride.columns["pitch"][ticks], station=ride.columns["station"][ticks])
    for name, claim in made.items():
        if differs(claim, true[k], LEAST_PITCH, LEAST_WAY):
            yield name, claim
