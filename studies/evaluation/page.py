"""The evaluation as one HTML page that needs no other file: figures, tables, thumbnails."""

from collections.abc import Mapping, Sequence

import numpy as np

from flows.pages.figures import Figure, Line, Panel, Style, pick_style
from flows.pages.writer import Picture, Section, Table, encode_picture, write_page
from studies.evaluation.judged_clip import JudgedClip, Row
from studies.evaluation.motion_curves import MotionPanel, draw_motion

SHOWN_CLIPS = 12
MEANING = {
    "pitch_rmse": "RMSE of recovered pitch against the telemetry, from frame 0",
    "pitch_relative_error": "the same over the RMS of the claimed pitch",
    "normalised_progress_rmse": "RMSE of progress over the whole way",
    "progress_rmse": "RMSE of forward progress; only a method that knows the scale",
    "e_weather": "Appendix A.5: change of normalised progress against the dry control",
    "e_geometry_hump": "Appendix A.5: pitch in the event window, from the feature's near edge on",
    "e_geometry_depression": "Appendix A.5: as above",
    "e_path": "Appendix A.6: normalised lateral path against the dry control",
    "localised_edit_rate": "Appendix A.6: active frames with a change where the feature is",
    "anchor_error": "Appendix A.6: distance of centroids over the diagonal",
    "temporal_iou": "Appendix A.6: overlap of masks along the optical flow",
    "edit_outside": "share of the changed pixels that lie off the dilated target, which the three above do not see",
    "twin_ssim": "feature clip against its flat twin off the feature, before contact; 1: nothing else changed",
    "twin_flip": "the same by FLIP; 0: nothing else changed",
    "piqe": "share of distortion in the blocks that are looked at, 0 to 100",
    "temporal_error": "mean square of a frame less its flow-warped successor",
    "severity_rank_correlation": "Spearman of an image statistic with the rate; a stand-in for CLIP",
    "severity_adjacent_accuracy": "neighbouring levels in that order; a stand-in for CLIP",
    "clip_severity_rho": "Appendix D: Spearman of CLIP's weather-minus-dry similarity with the rate",
    "clip_adjacent_accuracy": "Appendix D: share of neighbouring levels whose similarity rises",
    "dover_overall": "Appendix D: DOVER's fused score",
    "dover_technical": "Appendix D: DOVER's raw technical field",
    "dover_aesthetic": "Appendix D: DOVER's raw aesthetic field",
    "temporal_lpips": "Appendix D: flow-aligned neighbours, two roadside regions",
    "temporal_lpips_excess": "the same less that of the dry control; visible rain and snow raise it",
}


LEAST_SWING_DEG = 0.25
"""Half of the least pitch that a plot spans, so that a drift of hundredths looks like one [deg]."""


def describe_metric(name: str) -> str:
    """Return what a metric is, in a sentence; empty for one that needs none.

    Parameters
    ----------
    name : of the metric
    """
    own = name.removesuffix("_reference")
    meaning = MEANING.get(own, "")
    return f"{meaning}; against independent traces" if own != name and meaning else meaning


def render_page(
    clips: Sequence[JudgedClip],
    rows: Sequence[Row],
    curves: Mapping[str, Sequence[MotionPanel]],
    run_id: str,
    codec: str,
) -> str:
    """Return the HTML of the whole page.

    Parameters
    ----------
    clips : as their judges saw them
    rows : every figure
    curves : panels of recovered motion, by what it is compared with
    run_id : of the dataset
    codec : what the pictures went through before they were judged
    """
    names = list(dict.fromkeys(row["metric"] for row in rows))
    pictures = [
        Picture(caption=clip.facts["label"], sources=list(map(encode_picture, clip.thumbnails)))
        for clip in clips[:SHOWN_CLIPS]
    ]
    return write_page(
        "muSync evaluation",
        f"Judged from the pixels: {run_id}",
        [
            Section(title="Summary", parts=[
                "Without smoothing: means over all clips, and over the clips that the paper's protocol takes, within"
                " each visual seed and then over seeds.",
                Table(rows=_list_summary(rows, names)),
            ]),
            Section(title="Pitch: claimed and recovered", parts=[_draw_pitch(clips)]),
            # a dataset without a dry twin or a feature has no panel
            Section(title="Response to weather and road",
                    parts=[draw_motion(panels, meant) for meant, panels in curves.items() if panels]),
            Section(title="E_geometry and its floor", parts=_draw_geometry(rows)),
            Section(title="Clips", parts=[pictures]),
            Section(title="Every figure", parts=[
                Table(title=name, rows=_list_figures(rows, name), note=describe_metric(name)) for name in names
            ]),
        ],
        lead=[f"{len(clips)} clips; pictures: {codec}. Smoothing acts on the estimate alone, so even a perfect pose"
        " scores its floor: read no figure without it. Window 0 is none. The paper's figures come from VGGT on other"
        " videos, and those of e_weather and e_geometry are against CarSim, which only the rows that end in"
        " _reference ask too."],
    )  # fmt: skip


def _list_summary(rows: Sequence[Row], names: Sequence[str]) -> list[Row | str]:
    listed: list[Row | str] = []
    for name in names:
        mine = [row for row in rows if row["metric"] == name and row["window"] == 0]
        means = [r for r in mine if r["condition"] == "all" or r["condition"].startswith("paper/")]
        meaning = describe_metric(name)
        listed.append(f"{name}: {meaning}" if meaning else name)
        for row in means or mine[:1]:
            single = [r["value"] for r in mine if r["method"] == row["method"] and _is_single(r)]
            scored = [value for value in single if value is not None]
            listed.append({
                "method": row["method"], "clips": row["condition"], "mean": row["value"], "floor": row["floor"],
                "SD over seeds": row["seed_std"],
                "largest": max(scored) if scored and row["condition"] == "all" else None,
                "unit": _name_unit(row), "paper": row["paper"], "note": row["note"],
            })  # fmt: skip
    return listed


def _list_figures(rows: Sequence[Row], name: str) -> list[Row]:
    """Return the rows of a metric, means first."""
    shown = (
        "condition", "method", "window", "value", "seed_std", "floor", "uncertainty", "unit", "paper", "note",
    )  # fmt: skip
    mine = sorted((row for row in rows if row["metric"] == name), key=_is_single)
    return [{key: row[key] for key in shown} | {"unit": _name_unit(row)} for row in mine]


def _is_single(row: Row) -> bool:
    """Whether a row is one clip's or family's figure, not a mean."""
    return row["averaged"] is None


def _name_unit(row: Row) -> str:
    return "" if row["unit"] == "1" else row["unit"]


def _draw_pitch(clips: Sequence[JudgedClip]) -> Figure:
    panels = []
    for clip in clips[:SHOWN_CLIPS]:
        claimed = np.rad2deg(clip.frames["pitch"] - clip.frames["pitch"][0])
        lines = [Line(name="claimed", x=clip.times, y=claimed)]
        for place, (method, motion) in enumerate(clip.motions.items()):
            lines.append(Line(name=method, x=clip.times, y=np.rad2deg(motion.pitch), style=pick_style(place)))
        panels.append(Panel(title=clip.facts["label"], y="pitch [deg]", lines=lines, least=LEAST_SWING_DEG))
    caption = f"Claimed and recovered pitch; the first {SHOWN_CLIPS} clips at most."
    return Figure(caption=caption, panels=panels, columns=3)


def _draw_geometry(rows: Sequence[Row]) -> list[Figure]:
    """Return the figure of road features; nothing for a dataset without one that was scored."""
    panels = []
    for name in ("e_geometry_hump", "e_geometry_depression"):
        mine = [r for r in rows if r["metric"] == name and r["value"] is not None and _is_single(r)]
        windows = sorted({r["window"] for r in mine})
        lines = []
        for place, method in enumerate(dict.fromkeys(r["method"] for r in mine)):
            means = [
                np.mean([r["value"] for r in mine if (r["window"], r["method"]) == (w, method)])
                for w in windows
            ]
            lines.append(Line(name=method, x=windows, y=means, marked=True, style=pick_style(place)))
        floors = [np.mean([r["floor"] for r in mine if r["window"] == w]) for w in windows]
        lines.append(Line(name="perfect pose", x=windows, y=floors, style=Style("ink", "dashed")))
        if mine:
            panels.append(
                Panel(title=name, x="smoothing window [frames]", y="error over response", lines=lines)
            )
    caption = "Mean over clips; dashed: a perfect pose."
    return [Figure(caption=caption, panels=panels, columns=2)] if panels else []
