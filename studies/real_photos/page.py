"""The page of the study: accuracies, confusions, and pictures beside each other. It shows the user's photographs."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from flows.pages.writer import Part, Picture, Section, Table, encode_picture, write_page
from studies.real_photos.comparison import DEVELOPMENT, HELD_OUT, ZERO_SHOT, Score
from studies.real_photos.pictures import CLASSES, Pictures

SHOWN = 8
"""Pictures in a row of the page [1]."""


def list_scores(scores: Sequence[Score]) -> list[dict[str, Any]]:
    """Return a row for each kind of training and judged part: ``part``, ``trained_on``, ``real_per_class``,
    ``accuracy_mean`` and ``accuracy_sd`` over the seeds, and ``by_class``.
    """
    return [
        {
            "part": score.part,
            "trained_on": score.training,
            "real_per_class": score.count,
            "accuracy_mean": float(score.accuracies.mean()),
            "accuracy_sd": float(score.accuracies.std(ddof=1)) if len(score.accuracies) > 1 else None,
            "by_class": {kind: float(share) for kind, share in zip(CLASSES, score.by_class, strict=True)},
        }
        for score in scores
    ]


def write_study_page(
    scores: Sequence[Score], ours: Pictures, held_out: Pictures, facts: dict[str, Any]
) -> str:
    """Return the page as one file.

    Parameters
    ----------
    scores : of every kind of training
    ours : frames
    held_out : photographs, of which the page shows some
    facts : what was read, by name
    """
    zero = next(score for score in scores if score.training == ZERO_SHOT and score.part == HELD_OUT)
    rows = [row | row["by_class"] for row in list_scores(scores)]
    tables = [
        Table(
            title=f"Photographs: {part}",
            rows=[
                {k: v for k, v in row.items() if k not in {"part", "by_class"}}
                for row in rows
                if row["part"] == part
            ],
            digits=3,
        )
        for part in (HELD_OUT, DEVELOPMENT)
    ]
    confusion = zero.confusion.mean(axis=0)
    return write_page(
        "muSync: real photographs",
        "Dry, wet or snow, told on real photographs",
        [
            Section(title="Accuracy", parts=[
                "Mean over the classes of the share that is told right, mean over seeds; guessing gives .33. Nothing is"
                " chosen by the held-out photographs.", *tables,
            ]),
            Section(title=f"Confusion: {ZERO_SHOT}, held-out photographs", parts=[
                Table(
                    rows=[
                        {"true class": kind, **{f"told {told}": float(v) for told, v in zip(CLASSES, row, strict=True)}}
                        for kind, row in zip(CLASSES, confusion, strict=True)
                    ],
                    digits=2,
                ),
            ]),
            Section(title="Pictures, as the network gets them", parts=[_show_pictures(zero, ours, held_out)]),
            Section(title="What was read", parts=[facts]),
        ],
        lead=["This page holds the photographs that it was made with: pass it on only if you may pass them on."],
    )  # fmt: skip


def _show_pictures(zero: Score, ours: Pictures, held_out: Pictures) -> Part:
    right = (zero.answers == held_out.label).mean(axis=0)
    shown = []
    for number, kind in enumerate(CLASSES):
        own, real = (np.flatnonzero(pictures.label == number) for pictures in (ours, held_out))
        order = real[np.argsort(right[real], kind="stable")]
        for caption, pictures, rows in (
            (f"{kind}: ours", ours, own[np.linspace(0, len(own) - 1, SHOWN).round().astype(int)]),
            (f"{kind}: photographs that are told wrong most often", held_out, order[:SHOWN]),
            (f"{kind}: photographs that are told right most often", held_out, order[-SHOWN:]),
        ):
            sources = [encode_picture(pictures.pixels[row]) for row in rows]
            shown.append(Picture(caption=caption, sources=sources))
    return shown
