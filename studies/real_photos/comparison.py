"""Networks trained with our frames, with real photographs and with both, and their answers on both judged parts."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studies.real_photos.network import continue_training, train_network
from studies.real_photos.pictures import CLASSES, Pictures

COUNTS = (5, 20, 80)
"""Real photographs of a class that are added [1]."""
STEPS, TUNING_STEPS = 300, 120
"""Steps of a training, and of tuning what was trained with our frames [1]."""
HELD_OUT, DEVELOPMENT = "held out", "development"
ZERO_SHOT = "our frames alone"


@dataclass(frozen=True, kw_only=True)
class Score:
    """Answers of the networks of one kind of training on one part of the photographs, a network a seed.

    Parameters
    ----------
    training : what they were trained with
    count : real photographs of a class among that [1]; None for all
    part : ``HELD_OUT`` or ``DEVELOPMENT``
    confusion : float64 [seed, true class, answer], each row a share [1]
    answers : int [seed, photograph], place of the class
    """

    training: str
    count: int | None
    part: str
    confusion: NDArray[np.float64]
    answers: NDArray[np.int64]

    @property
    def accuracies(self) -> NDArray[np.float64]:
        """Mean over the classes of the share that is told right, float64 [seed] [1]."""
        return np.trace(self.confusion, axis1=1, axis2=2) / len(CLASSES)

    @property
    def by_class(self) -> NDArray[np.float64]:
        """Share of each class that is told right, mean over seeds [1]."""
        return np.diagonal(self.confusion, axis1=1, axis2=2).mean(axis=0)


def compare_trainings(
    ours: Pictures,
    rest: Pictures,
    judged: dict[str, Pictures],
    *,
    seeds: Iterable[int],
    counts: Sequence[int] = COUNTS,
    steps: int = STEPS,
    say: Callable[[str], object] = print,
) -> list[Score]:
    """Train every network and ask it about the photographs that are judged.

    Real photographs are drawn by the seed, so that all kinds of training with the same count see the same ones.

    Parameters
    ----------
    ours : frames
    rest : photographs from which training draws
    judged : photographs by part; none of them is in ``rest``
    seeds : of the networks and draws
    counts : real photographs of a class that are added [1]
    steps : of a training [1]
    say : is told the name of each kind of training when it is done
    """
    found: dict[tuple[str, int | None, str], list[NDArray[np.int64]]] = {}

    def ask(training: str, count: int | None, network) -> None:  # type: ignore[no-untyped-def]
        for part, pictures in judged.items():
            found.setdefault((training, count, part), []).append(network.predict(pictures))
        say(training)

    tuning = max(1, steps * TUNING_STEPS // STEPS)
    for seed in seeds:
        zero_shot = train_network([ours], seed=seed, steps=steps)
        ask(ZERO_SHOT, 0, zero_shot)
        for count in counts:
            few = rest.draw_each(count, 100 * seed + count)
            ask(f"{count} real", count, train_network([few], seed=seed, steps=steps))
            ask(f"{count} real and ours, mixed", count, train_network([few, ours], seed=seed, steps=steps))
            ask(
                f"ours, then tuned with {count} real",
                count,
                continue_training(zero_shot, few, seed=seed, steps=tuning),
            )
        ask("all real", None, train_network([rest], seed=seed, steps=steps))
    return [
        Score(
            training=training,
            count=count,
            part=part,
            confusion=np.stack([measure_confusion(judged[part].label, one) for one in answers]),
            answers=np.stack(answers),
        )
        for (training, count, part), answers in found.items()
    ]


def measure_confusion(label: NDArray[np.int64], answer: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return the share of each true class (rows) that got each answer (columns) [1]."""
    table = np.zeros((len(CLASSES), len(CLASSES)))
    np.add.at(table, (label, answer), 1)
    return table / table.sum(axis=1, keepdims=True)
