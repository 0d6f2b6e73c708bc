"""Scores of learned judges for a dataset's pictures; where weights are missing, a row that says so."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from catalogs.clip_prompts import load_prompts
from catalogs.learned_judges import LoadedJudge
from flows.judging.evaluation_rows import figure_row, find_control, group_weather_families
from flows.judging.judged_clip import JudgedClip, Row, View
from tasks.eval.learned_scores import (
    ClipWeather,
    FlowAlignedDistance,
    VideoJudge,
    WholeVideo,
    dover_scores,
)
from tasks.eval.severity import severity_agreement
from tasks.surface.weather import DRY


def learned_rows(view: View, clips: list[JudgedClip], judges: dict[str, LoadedJudge]) -> Iterator[Row]:
    """Scores of each clip, and how CLIP's order of the weathers agrees with their rates.

    Parameters
    ----------
    view : of the dataset
    clips : as the other judges saw them
    judges : from `catalogs.learned_judges.load_judges`
    """
    yield from _score_with_dover(view, clips, judges["dover"])
    yield from _fast_vqa(view, clips, judges["fast_vqa"])
    yield from _temporal_lpips(view, clips, judges["lpips"])
    yield from _score_severity(view, clips, judges["clip"])


def _score_with_dover(view: View, clips: list[JudgedClip], loaded: LoadedJudge) -> Iterator[Row]:
    names = ("dover_overall", "dover_technical", "dover_aesthetic")
    if loaded.network is None:
        yield from _list_missing(names, loaded.note)
        return
    judge = WholeVideo(network=loaded.network)
    scores = {
        clip.facts["label"]: dover_scores(judge.evaluate_network(_read_pictures(view, clip)))
        for clip in clips
    }
    for name in names:
        given = {label: found[name] for label, found in scores.items() if name in found}
        if not given:
            yield from _list_missing((name,), "not run: the checkpoint gives the overall score alone")
        for label, value in given.items():
            yield figure_row(name, "TorchScript", label, value, "1", note=loaded.note)


def _fast_vqa(view: View, clips: list[JudgedClip], loaded: LoadedJudge) -> Iterator[Row]:
    if loaded.network is None:
        yield from _list_missing(("fast_vqa",), loaded.note)
        return
    judge = WholeVideo(network=loaded.network)
    for clip in clips:
        value = _score_clip(view, clip, judge)
        yield figure_row("fast_vqa", "TorchScript", clip.facts["label"], value, "1", note=loaded.note)


def _temporal_lpips(view: View, clips: list[JudgedClip], loaded: LoadedJudge) -> Iterator[Row]:
    """Yield the severity of each clip, and its difference to that of the dry control."""
    names = ("temporal_lpips", "temporal_lpips_excess")
    if loaded.network is None:
        yield from _list_missing(names, loaded.note)
        return
    judge = FlowAlignedDistance(network=loaded.network)
    scores = {clip.facts["clip_id"]: _score_clip(view, clip, judge) for clip in clips}
    for clip in clips:
        label, value = clip.facts["label"], scores[clip.facts["clip_id"]]
        yield figure_row(names[0], "TorchScript", label, value, "1", note=loaded.note)
        control = find_control(clip, clips, weather=True)
        if control is not None:
            excess = value - scores[control.facts["clip_id"]]
            yield figure_row(names[1], "TorchScript", label, excess, "1", note=loaded.note)


def _list_missing(names: tuple[str, ...], note: str) -> Iterator[Row]:
    for name in names:
        yield figure_row(name, "-", "-", None, "1", note=note)


def _score_severity(view: View, clips: list[JudgedClip], clip_judge: LoadedJudge) -> Iterator[Row]:
    names = ("clip_severity_rho", "clip_adjacent_accuracy")
    if clip_judge.network is None or clip_judge.text_features is None:
        yield from _list_missing(names, clip_judge.note)
        return
    network = clip_judge.network
    features = dict(zip(load_prompts(), clip_judge.text_features, strict=True))
    for kind, condition, levels in group_weather_families(clips):
        if kind not in features:
            for name in names:
                note = f"not run: the catalogue has no CLIP prompts of {kind}"
                yield figure_row(name, "TorchScript", condition, None, "1", note=note)
            continue
        judge = weather_judge(network, features, kind)
        rates = {c.facts["clip_id"]: c.facts["precipitation_mm_h"] for c in levels}
        scores = {c.facts["clip_id"]: _score_clip(view, c, judge) for c in levels}
        for name, value in zip(names, rank_weathers(rates, scores), strict=True):
            yield figure_row(name, "TorchScript", condition, value, "1", note=clip_judge.note)


def weather_judge(network: Any, features: Mapping[str, NDArray[np.floating]], kind: str) -> ClipWeather:
    """Return CLIP's judge of one kind of weather.

    Parameters
    ----------
    network : of the pictures, or a module with ``encode_image``
    features : mean text features by kind of weather
    kind : of weather
    """
    return ClipWeather(
        encode_image=getattr(network, "encode_image", network), weather=features[kind], dry=features[DRY]
    )


def rank_weathers(rates: Mapping[str, float], scores: Mapping[str, float]) -> tuple[float, float]:
    """Return Spearman's rank correlation of scores and rates, and the share of neighbouring levels whose score rises.

    The paper counts pairs whose score rises, whatever the correlation's sign.

    Parameters
    ----------
    rates : of each clip [mm/h]
    scores : of the same clips [1]
    """
    rising = np.diff([scores[key] for key in sorted(rates, key=lambda key: rates[key])]) > 0
    return severity_agreement(dict(rates), dict(scores))[0], float(np.mean(rising))


def score_pictures(
    frames: NDArray[np.uint8], judges: Mapping[str, LoadedJudge], kinds: Sequence[str]
) -> dict[str, float]:
    """Return the score of every learned judge that has weights, for the frames of one video.

    Parameters
    ----------
    frames : uint8 [F, H, W, 3] sRGB
    judges : from `catalogs.learned_judges.load_judges`
    kinds : of weather that CLIP tells from dry: ``clip_KIND`` is its similarity less the dry one
    """
    scores: dict[str, float] = {}
    if (dover := judges["dover"].network) is not None:
        scores |= dover_scores(WholeVideo(network=dover).evaluate_network(frames))
    if (fast := judges["fast_vqa"].network) is not None:
        scores["fast_vqa"] = WholeVideo(network=fast).score(frames)
    if (lpips := judges["lpips"].network) is not None:
        scores["temporal_lpips"] = FlowAlignedDistance(network=lpips).score(frames)
    clip = judges["clip"]
    if clip.network is not None and clip.text_features is not None:
        features = dict(zip(load_prompts(), clip.text_features, strict=True))
        scores |= {
            f"clip_{kind}": weather_judge(clip.network, features, kind).score(frames)
            for kind in kinds
            if kind in features
        }
    return scores


def _score_clip(view: View, clip: JudgedClip, judge: VideoJudge) -> float:
    return judge.score(_read_pictures(view, clip))


def _read_pictures(view: View, clip: JudgedClip) -> NDArray[np.uint8]:
    return view.arrays(clip.facts["index"], "rgb")[0]
