"""``python -m studies.real_photos PHOTOS DATASET... --out DIR``: what are our frames worth on real photographs?

PHOTOS holds labelled photographs in the subfolders dry, wet and snow; ``--folder wet=rainy_roads`` names another. None
are shipped: bring your own, and keep the page to yourself where you may not pass them on.
"""

import argparse
from pathlib import Path

import torch

import musync
from flows.cli import run_to_end
from flows.store.outputs import Outputs
from studies.real_photos.comparison import COUNTS, DEVELOPMENT, HELD_OUT, STEPS, compare_trainings
from studies.real_photos.page import format_scores, list_scores, write_study_page
from studies.real_photos.pictures import (
    CLASSES,
    join_pictures,
    read_frames,
    read_photographs,
    split_photographs,
)

REPORT, PAGE = "real-photos.json", "real-photos.html"


def read_folder_names(given: list[str]) -> dict[str, str]:
    """Return the subfolder of each class that ``--folder`` names.

    Raises
    ------
    InputError
        If one is not of the form CLASS=NAME with a class that exists.
    """
    pairs = [text.partition("=") for text in given]
    wrong = [f"--folder {c}{s}{n}: must be CLASS=NAME, CLASS one of {', '.join(CLASSES)}" for c, s, n in pairs
             if c not in CLASSES or not n]  # fmt: skip
    if wrong:
        raise musync.InputError(wrong)
    return {kind: name for kind, _, name in pairs}


def run_study() -> None:
    """Read the command line, train and judge, and write the report and the page."""
    parser = argparse.ArgumentParser(prog="python -m studies.real_photos", description=__doc__)
    parser.add_argument("photos", type=Path, help="folder with a subfolder of photographs for each class")
    parser.add_argument(
        "datasets", nargs="+", metavar="DATASET", help="datasets with frames, in several weathers"
    )
    parser.add_argument("--out", required=True, help=f"folder for {REPORT} and {PAGE}")
    parser.add_argument(
        "--folder", action="append", default=[], metavar="CLASS=NAME", help="subfolder of a class"
    )
    parser.add_argument("--seeds", type=int, default=3, help="networks of each kind of training")
    parser.add_argument("--frames", type=int, default=21, help="frames of each clip at most")
    parser.add_argument(
        "--counts", type=int, nargs="*", default=COUNTS, help="real photographs of a class to add"
    )
    parser.add_argument("--steps", type=int, default=STEPS, help="of each training")
    asked = parser.parse_args()
    results = Outputs(asked.out, "studies.real_photos", REPORT, PAGE)
    torch.set_num_threads(1)  # small pictures; a second thread sums in another order
    torch.use_deterministic_algorithms(True)
    photographs, unread = read_photographs(asked.photos, read_folder_names(asked.folder))
    held_out, development, rest = split_photographs(photographs)
    ours = join_pictures(
        [
            read_frames(musync.open(place), Path(place).name, of_a_clip=asked.frames)
            for place in asked.datasets
        ]
    )
    scores = compare_trainings(
        ours, rest, {HELD_OUT: held_out, DEVELOPMENT: development},
        seeds=range(asked.seeds), counts=asked.counts, steps=asked.steps,
        say=lambda training: print(f"trained with {training}", flush=True),
    )  # fmt: skip
    facts = {
        "photographs": len(photographs),
        "unread": len(unread),
        "held out": len(held_out),
        "for development": len(development),
        "to train": len(rest),
        "our frames": len(ours),
        "datasets": ", ".join(asked.datasets),
        "seeds": asked.seeds,
    }
    results.write_json(REPORT, {"facts": facts, "unread": unread, "scores": list_scores(scores)})
    results.write(PAGE, write_study_page(scores, ours, held_out, facts))
    print(format_scores(scores), f"page: {results.path(PAGE)}", sep="\n\n")


if __name__ == "__main__":
    run_to_end(run_study)
