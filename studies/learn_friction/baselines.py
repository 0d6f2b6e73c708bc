"""Predictors to be beaten: the mean, the brake command alone, and the command with statistics of the picture."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from studies.learn_friction.samples import Samples

Numbers = NDArray[np.float64]
Describe = Callable[[Samples], Numbers]
STRENGTHS = 10.0 ** np.arange(-2, 4)
"""Ridge strengths to choose from [1]."""


def predict_mean(train: Samples, test: Samples) -> Numbers:
    """Return the mean deceleration of training for every sample [m/s2]."""
    return np.full(len(test), train.deceleration.mean())


def describe_command(samples: Samples) -> Numbers:
    """Return speed and brake pressure, a row a sample."""
    return samples.command


def describe_picture(samples: Samples) -> Numbers:
    """Return the command, and mean and deviation of every colour above and below the middle of the picture."""
    pictures = samples.pictures.numpy() / 255.0
    middle = pictures.shape[2] // 2
    halves = (pictures[:, :, :middle], pictures[:, :, middle:])
    statistics = [measure(half, axis=(2, 3)) for half in halves for measure in (np.mean, np.std)]
    return np.concatenate([samples.command, *statistics], axis=1)


def predict_by_ridge(describe: Describe, train: Samples, test: Samples) -> Numbers:
    """Return the deceleration by ridge regression on features, their squares and products [m/s2].

    Its strength is the one with the least error on training drives that are left out, one after the other.

    Parameters
    ----------
    describe : features of samples
    train : what is fitted
    test : what is asked
    """
    known, asked = describe(train), describe(test)

    def error(strength: float) -> float:
        missed = []
        for drive in np.unique(train.drive):
            out = train.drive == drive
            answer = fit_ridge(known[~out], train.deceleration[~out], strength)(known[out])
            missed.append(answer - train.deceleration[out])
        return float(np.mean(np.concatenate(missed) ** 2))

    return fit_ridge(known, train.deceleration, min(STRENGTHS, key=error))(asked)


def fit_ridge(features: Numbers, labels: Numbers, strength: float) -> Callable[[Numbers], Numbers]:
    """Return the predictor whose weights solve the ridge problem of second order.

    Parameters
    ----------
    features : a row a sample
    labels : to be met
    strength : of the penalty on weights of standardised features [1]
    """
    centre, scale = features.mean(axis=0), features.std(axis=0) + 1e-9
    upper = np.triu_indices(features.shape[1])

    def expand(values: Numbers) -> Numbers:
        x = np.clip((values - centre) / scale, -3, 3)
        return np.concatenate([x, (x[:, :, None] * x[:, None])[:, *upper]], axis=1)

    design = expand(features)
    middle, mean = design.mean(axis=0), labels.mean()
    centred = design - middle
    weights = np.linalg.solve(
        centred.T @ centred + strength * np.eye(centred.shape[1]), centred.T @ (labels - mean)
    )
    return lambda values: mean + (expand(values) - middle) @ weights
