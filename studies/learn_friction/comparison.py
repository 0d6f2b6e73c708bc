"""Baselines, the network, and the network of a world without physics, on drives that none of them has seen."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from studies.learn_friction.baselines import (
    describe_command,
    describe_picture,
    predict_by_ridge,
    predict_mean,
)
from studies.learn_friction.network import Trained, train_network
from studies.learn_friction.samples import Samples, split_samples

NETWORK, PAINTED = "network", "network, appearance-only world"
BASELINES: Mapping[str, Callable[[Samples, Samples], NDArray[np.float64]]] = {
    "mean of training": predict_mean,
    "brake command alone": partial(predict_by_ridge, describe_command),
    "command and picture statistics": partial(predict_by_ridge, describe_picture),
}


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """Answers on the test drives.

    Parameters
    ----------
    test : a sample of each clip, with what the car really does
    painted : deceleration that the appearance-only world claims for them [m/s2]
    answers : of each predictor, an array a seed [m/s2]
    networks : of the world with physics, one a seed
    new_rates : clips whose precipitation rate no training clip had
    clips : of training and of test [1]
    """

    test: Samples
    painted: NDArray[np.float64]
    answers: Mapping[str, Sequence[NDArray[np.float64]]]
    networks: Sequence[Trained]
    new_rates: NDArray[np.bool_]
    clips: tuple[int, int]


def compare_predictors(samples: Samples, painted: Samples, *, seeds: Sequence[int]) -> Comparison:
    """Train every predictor on the training drives and ask it about the test drives.

    The answer for a clip is the mean of those for its pictures.

    Parameters
    ----------
    samples : of both splits
    painted : the same with the labels of the appearance-only world
    seeds : of the networks, a pair of them each
    """
    train, pictures = split_samples(samples)
    painted_train, painted_pictures = split_samples(painted)
    _, first, clip = np.unique(pictures.clip, return_index=True, return_inverse=True)
    test = pictures.take(first)

    def ask(predict: Callable[[Samples], NDArray[np.float64]]) -> NDArray[np.float64]:
        return np.bincount(clip, predict(pictures)) / np.bincount(clip)

    networks, painted_networks = (
        [train_network(part, seed=seed) for seed in seeds] for part in (train, painted_train)
    )
    answers = {name: [ask(partial(predict, train))] for name, predict in BASELINES.items()}
    answers[NETWORK] = [ask(network.predict) for network in networks]
    answers[PAINTED] = [ask(network.predict) for network in painted_networks]
    known = set(zip(train.weather, train.rate, strict=True))
    return Comparison(
        test=test,
        painted=painted_pictures.take(first).deceleration,
        answers=answers,
        networks=networks,
        new_rates=np.array([pair not in known for pair in zip(test.weather, test.rate, strict=True)]),
        clips=(len(set(train.clip)), len(set(test.clip))),
    )


def format_errors(found: Comparison) -> str:
    """Return a table of errors: root mean square over clips, mean over seeds and, of several, their range."""
    kinds = sorted(set(found.test.weather))
    groups = {"all": np.ones(len(found.test), bool)}
    groups |= {kind: found.test.weather == kind for kind in kinds} | {"rates not trained": found.new_rates}
    asked = [(name, name, found.test.deceleration) for name in found.answers]
    asked.append((f"{PAINTED}, by its own labels", PAINTED, found.painted))
    yielded = [
        [title, *(_format_range([_rmse(one[rows] - truth[rows]) for one in found.answers[name]])
                  for rows in groups.values())]
        for title, name, truth in asked
    ]  # fmt: skip
    head = f"{found.clips[0]} clips to train, {found.clips[1]} to test; RMSE of the deceleration [m/s2]"
    return "\n".join([head, "", *_table(["predictor", *groups], yielded)])


def format_promises(found: Comparison) -> str:
    """Return a table of the deceleration that is true and that both networks promise, by weather and rate."""
    rows = []
    for kind, rate in sorted(set(zip(found.test.weather, found.test.rate, strict=True))):
        here = (found.test.weather == kind) & (found.test.rate == rate)
        means = [found.test.deceleration[here].mean()]
        means += [np.mean([one[here].mean() for one in found.answers[name]]) for name in (NETWORK, PAINTED)]
        rows.append([kind, f"{rate:g}", *(f"{mean:.2f}" for mean in means)])
    head = ["weather", "mm/h", "true", NETWORK, PAINTED]
    return "\n".join(["mean deceleration of the test drives [m/s2]", "", *_table(head, rows)])


def _rmse(error: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.mean(error**2))) if len(error) else float("nan")


def _format_range(values: Sequence[float]) -> str:
    mean = f"{np.mean(values):.2f}"
    return mean if len(values) == 1 else f"{mean} ({min(values):.2f} to {max(values):.2f})"


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> Iterator[str]:
    for row in (head, ["---"] * len(head), *rows):
        yield f"| {' | '.join(row)} |"
