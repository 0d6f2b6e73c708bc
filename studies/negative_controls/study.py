"""Negative controls: desynchronised claims and false motions of a dataset's clips, and which metric sees which."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from catalogs.entries import load
from catalogs.grids.form import TICK_RATE_HZ
from catalogs.studies.ablation import cut_coupling
from catalogs.variants import VARIANTS, Variant
from flows.making.catalogue import Catalogue, catalogue_of
from flows.making.driven import refuse_driven
from flows.making.driving import simulate_drive
from flows.making.locations import refuse_changed_scene
from flows.making.plan import Plan, read_plan
from flows.making.traced import refuse_traced
from flows.pages.static import as_svg
from flows.running.orchestration import run_as_stage
from flows.store.address import open_for_reading
from flows.store.outputs import Outputs
from flows.store.sealed import read_manifest, refuse_changed_content, require_frames
from manifests.manifest import list_scenes
from studies.evaluation.judged_clip import METHODS, JudgedClip, View, judge_clip
from studies.evaluation.metrics.video_motion import path_error, weather_error
from studies.evaluation.rows import find_control
from studies.negative_controls.claims import (
    Claim,
    claims_differ,
    compute_separation,
    delay_claim,
    scale_claimed_pitch,
    score_claim,
    shows_another_rig,
)
from studies.negative_controls.false_rigs import FALSE_RIGS
from studies.negative_controls.figure import draw_roc
from studies.physics_judge.audit_physics import clip_facts
from tasks.errors import InputError
from tasks.eval.body_agreement import BodyClaim
from tasks.eval.motion_agreement import PoseThresholds

CUTS: tuple[Variant, ...] = ("appearance-only", "vertical-only", "fixed-mu")
"""The paper's ablations, as false claims."""
CONTROLS: dict[str, str] = {
    **{name: VARIANTS[name] for name in CUTS},
    "one-frame-delay": "telemetry a frame late",
    "amplitude-0.8": "pitch at 80 %",
    "sign-flip": "pitch upside down",
    "other-clip": "telemetry of another clip",
    "no-heave": "pictures without heave",
    "heave-flip": "pictures with heave upside down",
    "heave-3": "pictures with heave three times",
    "roll": "pictures that roll by 3 deg",
    "yaw": "pictures that yaw by 2 deg",
    "aside": "pictures turned by 3 deg all along",
    "sway": "pictures that sway by 0.3 m",
}
UNREAD: dict[str, str] = {
    **dict.fromkeys(("localised_edit_rate", "anchor_error", "temporal_iou", "edit_outside"), "paired-lab"),
    **dict.fromkeys(("twin_ssim", "twin_flip"), "off the feature"),
    **dict.fromkeys(("severity_rank_correlation", "severity_adjacent_accuracy"), "image statistics"),
    **dict.fromkeys(("piqe", "temporal_error"), "no reference"),
}
"""Metrics of the evaluation that no claim enters, by their method."""
BLIND_BY_DESIGN = "never reads the claim"
LEAST_PITCH, LEAST_WAY, LEAST_MOVE = np.deg2rad(0.05), 0.2, 0.005
"""A copy that differs by less in angles [rad], in way [m], and to the side and upward [m] is no fault."""


def run_controls(dataset: str, *, out: str | None = None) -> dict[str, Any]:
    """Desynchronise a dataset in seven ways, falsify its rig's motion in seven, and report which metric detects which.

    All are detected only if each could be tried; `undetected` says of the others what kept them.

    Parameters
    ----------
    dataset : a finished dataset folder
    out : folder for controls.json and, if any control was tried, controls.svg

    Raises
    ------
    InputError
        If the folder is no finished dataset with frames, or holds fewer than two clips, or these or the scene are not
        as recorded.
    """
    results = Outputs(out, "lab controls", "controls.json", "controls.svg")
    layout = open_for_reading(dataset)
    root, manifest = layout.root, read_manifest(layout)
    inputs = read_plan(root).inputs
    refuse_traced(inputs, dataset, "lab controls")
    refuse_driven(inputs, dataset, "lab controls")
    require_frames(manifest, dataset, stored=True)
    refuse_changed_content(layout, manifest, manifest["clips"])
    for scene in list_scenes(manifest):
        refuse_changed_scene(scene)
    facts = clip_facts(root)
    if len(facts) < 2:
        raise InputError(f"{root}: negative controls need at least two clips; there are {len(facts)}.")
    clips = [run_as_stage(judge_clip)(View(root=root), row) for row in facts]
    false = make_false_claims(clips, read_plan(root), catalogue_of(root))
    rows = list(score_controls(clips, false))
    result = {**summarise_controls(rows, list_untried(clips, false)), "rows": [*rows, *list_unread_rows()]}
    results.write_json("controls.json", result)
    if rows and out is not None:
        results.write("controls.svg", as_svg(draw_roc(rows, CONTROLS)))
    return result


def summarise_controls(rows: list[dict[str, Any]], kept: dict[str, str]) -> dict[str, Any]:
    """Return the outcome of every control: the metrics that detect it, or why none could.

    Parameters
    ----------
    rows : of `score_controls`
    kept : controls that could not be tried, and why
    """
    seen: dict[str, list[str]] = {name: [] for name in CONTROLS}
    for row in rows:
        if row["verdict"] == "sees":
            seen[row["control"]].append(f"{row['metric']} by {row['method']}")
    reasons = {name: kept.get(name, "" if seen[name] else "no metric sees it") for name in CONTROLS}
    return {
        "controls": [
            {
                "control": name,
                "meaning": meaning,
                "tried": name not in kept,
                "seen_by": seen[name],
                "reason": reasons[name],
            }
            for name, meaning in CONTROLS.items()
        ],
        "all_detected": not any(reasons.values()),
        "undetected": [f"{name}: {reason}" for name, reason in reasons.items() if reason],
        "blind": [f"{r['metric']} by {r['method']}: {r['control']}" for r in rows if r["verdict"] == "blind"]
        + [f"{metric} by {method}: every control, it {BLIND_BY_DESIGN}" for metric, method in UNREAD.items()],
    }


def make_false_claims(clips: list[JudgedClip], plan: Plan, catalogue: Catalogue) -> list[dict[str, Claim]]:
    """Return the faulty claims of each clip by control, without those that equal the true claim.

    Parameters
    ----------
    clips : as their judges saw them
    plan, catalogue : the dataset's
    """
    true = _true_claims(clips)
    return [dict(_make_faulty_claims(k, clips, true, plan, catalogue)) for k in range(len(clips))]


def list_untried(clips: list[JudgedClip], false: list[dict[str, Claim]]) -> dict[str, str]:
    """Return the controls that no method could be applied to, with the reason.

    Parameters
    ----------
    clips : as their judges saw them
    false : of `make_false_claims`
    """
    kept = {}
    for name in CONTROLS:
        changed = [clip for clip, claims in zip(clips, false, strict=True) if name in claims]
        if not changed:
            kept[name] = (
                f"not tried: in none of {len(clips)} clips does it change the motion by"
                f" {np.rad2deg(LEAST_PITCH):.2g} deg, {LEAST_WAY:g} m of way or {LEAST_MOVE:g} m across; add clips in"
                " which it does"
            )
        elif not any(_is_whole(clip, method) for clip in changed for method in METHODS):
            kept[name] = (
                f"not tried: in the {len(changed)} clips whose motion it changes every method misses the pose of a"
                " frame; add clips that can be tracked"
            )
    return kept


def score_controls(clips: list[JudgedClip], false: list[dict[str, Claim]]) -> Iterator[dict[str, Any]]:
    """One row for each control, method and metric.

    Parameters
    ----------
    clips : as their judges saw them
    false : of `make_false_claims`
    """
    gates = load("gate file")
    true = _true_claims(clips)
    dry = [find_control(clip, clips, weather=True) for clip in clips]

    def scores(k: int, method: str, claim: Claim) -> dict[str, float]:
        return _score_claim(clips[k], dry[k], method, claim, gates)

    for method in METHODS:
        whole = [k for k, clip in enumerate(clips) if _is_whole(clip, method)]
        sound = [scores(k, method, true[k]) for k in whole]
        for name in CONTROLS:
            faulty = [scores(k, method, false[k][name]) for k in whole if name in false[k]]
            for metric in sorted({m for scored in faulty for m in scored}):
                good = [scored[metric] for scored in sound if metric in scored]
                bad = [scored[metric] for scored in faulty if metric in scored]
                if not good:
                    continue
                found = compute_separation(good, bad)
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
                    "reason": BLIND_BY_DESIGN if metric == "e_path" else "",
                    "roc": {"false_alarms": list(found.false_alarms), "detections": list(found.detections)},
                }


def list_unread_rows() -> Iterator[dict[str, Any]]:
    """One row for each control and metric that no claim enters: blind, whatever the pixels are."""
    for name in CONTROLS:
        for metric, method in UNREAD.items():
            yield {
                "control": name,
                "metric": metric,
                "method": method,
                "sound": 0,
                "faulty": 0,
                "threshold": None,
                "detection_rate": 0.0,
                "auc": 0.5,
                "verdict": "blind",
                "reason": BLIND_BY_DESIGN,
                "roc": {"false_alarms": [0.0, 1.0], "detections": [0.0, 1.0]},
            }


def _true_claims(clips: list[JudgedClip]) -> list[Claim]:
    return [
        Claim(pitch=clip.frames["pitch"], station=clip.frames["station"], body=_true_body(clip))
        for clip in clips
    ]


def _true_body(clip: JudgedClip) -> BodyClaim:
    return BodyClaim(T_world_rig=clip.frames["T_world_rig"].reshape(-1, 4, 4), heave=clip.frames["heave"])


def _is_whole(clip: JudgedClip, method: str) -> bool:
    return not clip.motions[method].failed.any()


def _score_claim(
    clip: JudgedClip, dry: JudgedClip | None, method: str, claim: Claim, gates: PoseThresholds
) -> dict[str, float]:
    """Scores of a claim on its clip and, where both were tracked, on the clip and its dry sibling."""
    motion = clip.motions[method]
    response, certain = float(np.deg2rad(gates.response_deg)), gates.heave_gain_std or 0.0
    scores = score_claim(motion, claim, response, clip.times, clip.opening, certain)
    if dry is None or not _is_whole(dry, method) or not claim.station[-1] > claim.station[0]:
        return scores
    seen, control = motion.normalised_path, dry.motions[method].normalised_path
    if min(np.ptp(seen[:, 0]), np.ptp(control[:, 0])) > 0:  # neither stands
        scores["e_weather"] = weather_error(
            seen[:, 0], control[:, 0], claim.station, dry.frames["station"], None
        )
        scores["e_path"] = path_error(seen[:, :2], control[:, :2])
    return scores


def _make_faulty_claims(
    k: int, clips: list[JudgedClip], true: list[Claim], plan: Plan, catalogue: Catalogue
) -> Iterator[tuple[str, Claim]]:
    """Faulty claims of one clip that differ from its true one."""
    scenario = next(c.scenario for c in plan.clips if c.clip_id == clips[k].facts["clip_id"])
    made = {"one-frame-delay": delay_claim(true[k], 1), "amplitude-0.8": scale_claimed_pitch(true[k], 0.8),
            "sign-flip": scale_claimed_pitch(true[k], -1.0)}  # fmt: skip
    made["other-clip"] = replace(true[(k + 1) % len(true)], body=None)
    ticks = np.rint(np.arange(plan.settings.frames) * TICK_RATE_HZ / plan.settings.frame_rate_hz).astype(int)
    for variant in CUTS:
        _, ride = simulate_drive(
            cut_coupling(scenario, variant),
            catalogue.vehicle,
            catalogue.surface,
            plan.settings.vehicle_mode,
            plan.duration_s,
            catalogue.steady,
            catalogue.grade_of(scenario.scene),
        )
        made[variant] = Claim(pitch=ride.columns["pitch"][ticks], station=ride.columns["station"][ticks])
    for name, move in FALSE_RIGS.items():
        falsified = replace(true[k], shown=move(_true_body(clips[k]), clips[k].times))
        if shows_another_rig(falsified, LEAST_PITCH, LEAST_MOVE):
            yield name, falsified
    for name, claim in made.items():
        if claims_differ(claim, true[k], LEAST_PITCH, LEAST_WAY):
            yield name, claim
