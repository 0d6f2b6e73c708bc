"""How the end of a stop is kept steady in paper mode: the numbers behind ``low_speed: steady``."""

from dataclasses import replace
from pathlib import Path
from typing import Annotated

from catalogs.quantities import CatalogueEntry, Scalar, read_entry, require_quantity
from catalogs.variants import Variant
from tasks.vehicle.paper.low_speed import SteadyStop

LOW_SPEED = Path(__file__).with_name("low_speed.yaml")
NO_LOW_SPEED_RULE = Path(__file__).parent / "studies" / "no_low_speed_rule.yaml"
"""Kept by a dataset of ``variant: no-low-speed-rule``."""


class LowSpeedEntry(CatalogueEntry):
    """Content of the file; `SteadyStop` gives the meanings."""

    held_share: Annotated[Scalar, require_quantity("1", minimum=0, maximum=1)]
    explicit_limit: Annotated[Scalar, require_quantity("1", above=0, maximum=2)]


class LowSpeedCutEntry(CatalogueEntry):
    """Content of the file that leaves the rule out; ``applied`` is 1 where it holds and 0 where not."""

    applied: Annotated[Scalar, require_quantity("1", minimum=0, maximum=1)]


def load_low_speed(path: Path = LOW_SPEED) -> SteadyStop:
    """Read the numbers.

    Raises
    ------
    InputError
        Listing every problem of the file.
    """
    entry = read_entry(LowSpeedEntry, path, "low-speed rule")
    return SteadyStop(held_share=entry.held_share.value, explicit_limit=entry.explicit_limit.value)


def load_kept_low_speed(inputs: Path) -> SteadyStop | None:
    """Read the numbers among a dataset's kept inputs; None where it keeps none, and takes the published rule literally.

    Parameters
    ----------
    inputs : folder of the kept catalogue files

    Raises
    ------
    InputError
        Listing every problem of the file.
    """
    kept, cut = inputs / LOW_SPEED.name, inputs / NO_LOW_SPEED_RULE.name
    steady = load_low_speed(kept) if kept.is_file() else None
    if steady is None or not cut.is_file():
        return steady
    return replace(steady, pitch_rule=is_rule_applied(cut))


def is_rule_applied(path: Path = NO_LOW_SPEED_RULE) -> bool:
    """Whether the file of ``no-low-speed-rule`` lets the rule act.

    Raises
    ------
    InputError
        Listing every problem of the file.
    """
    return read_entry(LowSpeedCutEntry, path, "cut of the low-speed rule").applied.value > 0


def cut_low_speed(steady: SteadyStop, variant: Variant) -> SteadyStop:
    """Return how stops end in a variant by today's catalogue.

    Parameters
    ----------
    steady : where nothing is cut
    variant : what is cut
    """
    return replace(steady, pitch_rule=is_rule_applied()) if variant == "no-low-speed-rule" else steady
