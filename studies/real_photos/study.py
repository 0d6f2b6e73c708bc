"""The study: photographs and datasets read, networks trained and judged, report and page written."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import torch

import musync
from flows.store.outputs import Outputs
from studies.real_photos.comparison import COUNTS, DEVELOPMENT, HELD_OUT, STEPS, compare_trainings
from studies.real_photos.page import list_scores, write_study_page
from studies.real_photos.pictures import (
    CLASSES,
    join_pictures,
    read_frames,
    read_photographs,
    split_photographs,
)

REPORT, PAGE = "real_photos.json", "real_photos.html"


def compare_with_photographs(
    photos: str,
    dataset: list[str],
    *,
    out: str,
    folder: list[str] | None = None,
    seeds: int = 3,
    frames: int = 21,
    counts: Sequence[int] = COUNTS,
    steps: int = STEPS,
) -> dict[str, Any]:
    """Train small networks with our frames, with photographs and with both, and judge them on photographs held out.

    No photographs are shipped: bring your own, and keep the page to yourself where you may not pass them on.

    Parameters
    ----------
    photos : folder with a subfolder of photographs for each class
    dataset : datasets with frames, in several weathers
    out : folder for ``real_photos.json`` and ``real_photos.html``
    folder : subfolders of other names, CLASS=NAME
    seeds : networks of each kind of training [1]
    frames : of each clip at most [1]
    counts : real photographs of a class to add [1]
    steps : of each training [1]

    Returns
    -------
    ``facts``; ``unread``, files that are no pictures; ``rows[]`` of `studies.real_photos.page.list_scores`.

    Raises
    ------
    InputError
        If photographs or datasets lack a class, or a subfolder is named wrongly.
    """
    results = Outputs(out, "lab real-photos", REPORT, PAGE)
    torch.set_num_threads(1)  # small pictures; a second thread sums in another order
    torch.use_deterministic_algorithms(True)
    photographs, unread = read_photographs(Path(photos), read_folder_names(folder or []))
    held_out, development, rest = split_photographs(photographs)
    ours = join_pictures(
        [read_frames(musync.open(place), Path(place).name, of_a_clip=frames) for place in dataset]
    )
    scores = compare_trainings(
        ours, rest, {HELD_OUT: held_out, DEVELOPMENT: development},
        seeds=range(seeds), counts=counts, steps=steps, say=lambda _: None,
    )  # fmt: skip
    facts = {
        "photographs": len(photographs),
        "unread": len(unread),
        "held out": len(held_out),
        "for development": len(development),
        "to train": len(rest),
        "our frames": len(ours),
        "datasets": ", ".join(dataset),
        "seeds": seeds,
    }
    result = {"facts": facts, "unread": unread, "rows": list_scores(scores)}
    results.write_json(REPORT, result)
    results.write(PAGE, write_study_page(scores, ours, held_out, facts))
    return result | {"page": str(results.path(PAGE))}


def read_folder_names(given: list[str]) -> dict[str, str]:
    """Return the subfolder of each class that ``--folder`` names.

    Raises
    ------
    InputError
        If one is not of the form CLASS=NAME with a class that exists.
    """
    pairs = [text.partition("=") for text in given]
    wrong = [
        f"--folder {kind}{sign}{name}: must be CLASS=NAME, CLASS one of {', '.join(CLASSES)}"
        for kind, sign, name in pairs
        if kind not in CLASSES or not name
    ]
    if wrong:
        raise musync.InputError(wrong)
    return {kind: name for kind, _, name in pairs}
