"""The evaluation as one HTML page that needs no other file: plots as SVG, tables, thumbnails."""

import base64
from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

import cv2
import numpy as np
from matplotlib.figure import Figure

from flows.drawing import as_svg, escape_formulas
from flows.judging.judged_clip import JudgedClip, Row
from flows.judging.motion_curves import COLOURS, MotionPanel, draw_motion
from flows.pages import make_policy

STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; max-width: 70rem; margin: 2rem auto; padding: 0 1rem; color: #1b1b1b; }
h1 { font-size: 1.5rem; } h2 { font-size: 1.1rem; margin-top: 2rem; border-bottom: 1px solid #ddd; }
table { border-collapse: collapse; font-size: 12.5px; } th, td { padding: .15rem .6rem; border-bottom: 1px solid #eee; }
td.n { text-align: right; font-variant-numeric: tabular-nums; } th { text-align: left; } .wide { overflow-x: auto; }
.metric th { padding-top: .8rem; border-bottom-color: #bbb; }
small { margin-left: .8rem; font-weight: 400; color: #555; }
svg { max-width: 100%; height: auto; } .clips { display: grid; grid-template-columns: 1fr 1fr; gap: .2rem 1rem; }
.clips p { margin: .3rem 0; font-size: 13px; } .clips img { width: 32.5%; margin-right: .5%; }
.none { color: #999; text-align: right; } figure { margin: .5rem 0; } figcaption { font-size: 13px; color: #444; }
"""
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
    parts = [
        f"<h1>Judged from the pixels: {escape(run_id)}</h1>",
        f"<p>{len(clips)} clips; pictures: {escape(codec)}.</p>",
        "<p>Smoothing acts on the estimate alone, so even a perfect pose scores its floor: read no figure without"
        " it. Window 0 is none. The paper's figures come from VGGT on other videos, and those of e_weather"
        " and e_geometry are against CarSim, which only the rows that end in _reference ask too.</p>",
        "<h2>Summary</h2>",
        "<p>Without smoothing: means over all clips, and over the clips that the paper's protocol takes, within each"
        " visual seed and then over seeds.</p>", _render_summary(rows, names),
        "<h2>Pitch: claimed and recovered</h2>",
        _render_figure(_pitch_plot(clips), f"Claimed (black) and recovered; the first {SHOWN_CLIPS} clips at most."),
        *_render_motion(curves),
        *_render_geometry(rows),
        "<h2>Clips</h2>", _render_thumbnails(clips),
        "<h2>Every figure</h2>",
        *(f"<h3>{escape(name)}</h3><p>{escape(describe_metric(name))}</p>"
          f"{_render_table([row for row in rows if row['metric'] == name])}" for name in names),
    ]  # fmt: skip
    return (
        f'<!doctype html><html lang="en"><head><meta charset="utf-8">'
        f'<meta http-equiv="Content-Security-Policy" content="{make_policy()}"><title>muSync evaluation</title>'
        f"<style>{STYLE}</style></head><body>{''.join(parts)}</body></html>"
    )


def _render_summary(rows: Sequence[Row], names: Sequence[str]) -> str:
    head = ("method", "clips", "mean", "floor", "SD over seeds", "largest", "unit", "paper", "note")
    groups = []
    for name in names:
        mine = [row for row in rows if row["metric"] == name and row["window"] == 0]
        means = [r for r in mine if r["condition"] == "all" or r["condition"].startswith("paper/")]
        lines = []
        for row in means or mine[:1]:
            single = [r["value"] for r in mine if r["method"] == row["method"] and _is_single(r)]
            scored = [value for value in single if value is not None]
            lines.append(
                (row["method"], row["condition"], row["value"], row["floor"], row["seed_std"],
                 max(scored) if scored and row["condition"] == "all" else None,
                 row["unit"], row["paper"], row["note"])
            )  # fmt: skip
        title = f"{escape(name)}<small>{escape(describe_metric(name))}</small>"
        groups.append(
            f'<tbody><tr class="metric"><th colspan="{len(head)}">{title}</th></tr>{_html_rows(lines)}</tbody>'
        )
    return _html_table(head, "".join(groups))


def _is_single(row: Row) -> bool:
    """Whether a row is one clip's or family's figure, not a mean."""
    return row["averaged"] is None


def _render_table(rows: Sequence[Row]) -> str:
    head = (
        "condition",
        "method",
        "window",
        "value",
        "seed_std",
        "floor",
        "uncertainty",
        "unit",
        "paper",
        "note",
    )
    means_first = sorted(rows, key=_is_single)
    return _html_table(head, _html_rows([tuple(row[key] for key in head) for row in means_first]))


def _html_table(head: Sequence[str], body: str) -> str:
    titles = "".join(f"<th>{escape(title)}</th>" for title in head)
    return f'<div class="wide"><table><thead><tr>{titles}</tr></thead>{body}</table></div>'


def _html_rows(rows: Sequence[Sequence[Any]]) -> str:
    return "".join(f"<tr>{''.join(map(_html_cell, row))}</tr>" for row in rows)


def _html_cell(value: Any) -> str:
    if value is None:
        return '<td class="none">-</td>'
    if isinstance(value, float):
        return f'<td class="n">{value:.4g}</td>'
    return f"<td>{escape(str(value))}</td>"


def _pitch_plot(clips: Sequence[JudgedClip]) -> Figure:
    shown = clips[:SHOWN_CLIPS]
    lines = -(-len(shown) // 3)
    figure = Figure(figsize=(11, 2.1 * lines), layout="constrained")
    axes = figure.subplots(lines, 3, squeeze=False, sharex=True).ravel()
    for axis, clip in zip(axes, shown, strict=False):
        claimed = np.rad2deg(clip.frames["pitch"] - clip.frames["pitch"][0])
        axis.plot(clip.times, claimed, color="black", lw=1.6, label="claimed")
        for method, motion in clip.motions.items():
            axis.plot(
                clip.times,
                np.rad2deg(motion.pitch),
                color=COLOURS.get(method),
                lw=0.8,
                label=escape_formulas(method),
            )
        axis.set_title(escape_formulas(clip.facts["label"]), fontsize=9)
        axis.tick_params(labelsize=7)
        low, high = axis.get_ylim()
        axis.set_ylim(min(low, -LEAST_SWING_DEG), max(high, LEAST_SWING_DEG))
        axis.set_ylabel("pitch [deg]", fontsize=7)
    for axis in axes[max(len(shown) - 3, 0) : len(shown)]:
        axis.set_xlabel("time [s]", fontsize=7)
        axis.tick_params(labelbottom=True)
    for axis in axes[len(shown) :]:
        axis.set_axis_off()
    axes[0].legend(fontsize=6)
    return figure


def _render_motion(curves: Mapping[str, Sequence[MotionPanel]]) -> list[str]:
    """The section on the response to weather and road; nothing for a dataset without a dry twin or a feature."""
    shown = {meant: panels for meant, panels in curves.items() if panels}
    caption = "Mean over visual seeds, with one standard deviation where there are several; shaded: the event window."
    figures = [_render_figure(draw_motion(panels, meant), caption) for meant, panels in shown.items()]
    return ["<h2>Response to weather and road</h2>", *figures] if figures else []


def _render_geometry(rows: Sequence[Row]) -> list[str]:
    """The section on road features; nothing for a dataset without one that was scored."""
    scored = [
        name
        for name in ("e_geometry_hump", "e_geometry_depression")
        if any(row["metric"] == name and row["value"] is not None for row in rows)
    ]
    if not scored:
        return []
    caption = "Mean over clips; dashed: a perfect pose."
    return ["<h2>E_geometry and its floor</h2>", _render_figure(_window_plot(rows, scored), caption)]


def _window_plot(rows: Sequence[Row], names: Sequence[str]) -> Figure:
    figure = Figure(figsize=(4.5 * len(names), 3), layout="constrained")
    for axis, name in zip(figure.subplots(1, len(names), squeeze=False)[0], names, strict=True):
        mine = [r for r in rows if r["metric"] == name and r["value"] is not None and _is_single(r)]
        windows = sorted({r["window"] for r in mine})
        for method in dict.fromkeys(r["method"] for r in mine):
            means = [
                np.mean([r["value"] for r in mine if (r["window"], r["method"]) == (w, method)])
                for w in windows
            ]
            axis.plot(windows, means, "o-", color=COLOURS.get(method), ms=3, label=escape_formulas(method))
        floors = [np.mean([r["floor"] for r in mine if r["window"] == w]) for w in windows]
        axis.plot(windows, floors, "--", color="black", label="perfect pose")
        axis.set_title(name, fontsize=9)
        axis.set_xlabel("smoothing window [frames]", fontsize=8)
        axis.set_ylabel("error over response [1]", fontsize=8)
        axis.set_ylim(bottom=0)
    axis.legend(fontsize=7)
    return figure


def _render_figure(figure: Figure, caption: str) -> str:
    return f"<figure>{as_svg(figure)}<figcaption>{escape(caption)}</figcaption></figure>"


def _render_thumbnails(clips: Sequence[JudgedClip]) -> str:
    parts = []
    for clip in clips[:SHOWN_CLIPS]:
        pictures = []
        for picture in clip.thumbnails:
            coded = cv2.imencode(
                ".jpg", cv2.cvtColor(picture, cv2.COLOR_RGB2BGR), [cv2.IMWRITE_JPEG_QUALITY, 80]
            )[1]
            pictures.append(
                f'<img alt="" src="data:image/jpeg;base64,{base64.b64encode(coded.tobytes()).decode()}">'
            )
        parts.append(f"<p>{escape(clip.facts['label'])}<br>{''.join(pictures)}</p>")
    return f'<div class="clips">{"".join(parts)}</div>'
