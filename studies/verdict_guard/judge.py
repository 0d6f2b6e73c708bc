"""Verdicts on labelled campaigns, in processes of their own."""

import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import yaml

RECORDED = Path(__file__).with_name("recorded.yaml")
"""Truth and outcome of every campaign: by folder and name."""
RANKED = ("wrong", "nothing", "set", "exact")
"""Outcomes from worst to best; nothing named where nothing is missing is exact."""


def find_outcome(truth: list[str], verdict: dict[str, Any]) -> str:
    """Return how a verdict stands to the truth, one of `RANKED`.

    Parameters
    ----------
    truth : names of the effects in the data, "form PORT(VARIABLE)" for one outside the library; none where nothing is
        missing
    verdict : content of verdict.json
    """
    told = [sorted(row["names"]) for row in verdict["odds"] or [{"names": []}]]
    if not verdict["effects"]:
        return "nothing" if truth else "exact"
    if not truth:
        return "wrong"
    if len(told) == 1:
        return "exact" if told[0] == sorted(truth) else "wrong"
    return "set" if any(set(truth) <= set(names) for names in told) else "wrong"


def judge_one(folder: Path, out: Path) -> dict[str, Any]:
    """Return the verdict on one campaign with the processor time that it took [s].

    Parameters
    ----------
    folder : of the campaign
    out : folder of the verdict
    """
    from flows.measured.closing import close_loop

    began = time.process_time()
    verdict = close_loop(str(folder), out=str(out))
    return {**verdict, "cpu_s": time.process_time() - began}


def judge_all(measured: Path, out: Path, workers: int) -> Iterator[tuple[str, str, str, dict[str, Any]]]:
    """Yield set, name, recorded outcome and row of every campaign as it is judged.

    Parameters
    ----------
    measured : folder that holds the sets of campaigns
    out : folder of the verdicts
    workers : processes
    """
    recorded = yaml.safe_load(RECORDED.read_text(encoding="utf-8"))
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        jobs = {
            pool.submit(judge_one, measured / group / name, out / group / name): (group, name, entry)
            for group, campaigns in recorded.items()
            for name, entry in campaigns.items()
            if (measured / group / name).is_dir()
        }
        for job in as_completed(jobs):
            group, name, entry = jobs[job]
            verdict = job.result()
            outcome = find_outcome(entry["truth"], verdict)
            yield group, name, entry["outcome"], {
                "outcome": outcome, "cpu_s": verdict["cpu_s"], "odds": verdict["odds"], "sentence": verdict["sentence"],
            }  # fmt: skip
