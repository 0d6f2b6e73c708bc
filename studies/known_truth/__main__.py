"""``python -m studies.known_truth``: does ``calibrate --procedure paper-staged`` know what it knows?

The 19 development conditions with drawn scalars: whole fits without and with errors of the traces, and many draws of
errors refitted by the derivatives at the truth.
"""

import argparse
from concurrent.futures import ProcessPoolExecutor
from functools import partial

from catalogs.entries import load
from studies.known_truth.coverage import FitOutcome, fit_known_truth, format_coverage, refit_linearly
from studies.known_truth.traces import list_development_cases


def print_fits(title: str, fits: list[FitOutcome]) -> None:
    """Print the coverage of whole fits, and the pairs that most of them name as confounded.

    Parameters
    ----------
    title : heading
    fits : outcomes
    """
    print(f"## {title}: {len(fits)} fits, at most {max(fit.turns for fit in fits)} passes")
    print(format_coverage(scalar for fit in fits for scalar in fit.scalars))
    for pair in sorted({pair[:2] for fit in fits for pair in fit.confounded}):
        print("confounded:", *pair, sum(pair in [p[:2] for p in fit.confounded] for fit in fits), flush=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(prog="python -m studies.known_truth", description=__doc__)
    parser.add_argument("--draws", type=int, default=200, help="draws of errors that are refitted linearly")
    parser.add_argument("--truths", type=int, default=4, help="vehicles that these draws are spread over")
    parser.add_argument("--fits", type=int, default=14, help="whole fits of traces with errors")
    parser.add_argument("--exact", type=int, default=2, help="whole fits of traces without errors")
    parser.add_argument("--procedure", default="paper-staged")
    parser.add_argument("--workers", type=int, default=2)
    asked = parser.parse_args()
    procedure, interval = load("calibration procedure", asked.procedure)
    inputs = (load("vehicle", "paper-reference"), list_development_cases(), procedure, interval)
    with ProcessPoolExecutor(asked.workers) as pool:
        each = asked.draws // asked.truths
        linear = [
            pool.submit(partial(refit_linearly, *inputs, seed=seed, draws=each))
            for seed in range(1, asked.truths + 1)
        ]
        exact, wrong = (
            [
                pool.submit(partial(fit_known_truth, *inputs, seed=seed, errors=errors))
                for seed in range(1, count + 1)
            ]
            for errors, count in ((False, asked.exact), (True, asked.fits))
        )
        print(f"## refitted linearly: {each * asked.truths} draws of {asked.truths} vehicles")
        print(format_coverage(scalar for part in linear for scalar in part.result()), flush=True)
        print_fits("without errors", [part.result() for part in exact])
        print_fits("with errors", [part.result() for part in wrong])
