"""How the end of a stop is kept steady in paper mode: the numbers behind ``low_speed: steady``."""

from pathlib import Path
from typing import Annotated

from catalogs.quantities import CatalogueEntry, Scalar, read_entry, require_quantity
from tasks.vehicle.paper.low_speed import SteadyStop

LOW_SPEED = Path(__file__).with_name("low_speed.yaml")


class LowSpeedEntry(CatalogueEntry):
    """Content of the file; `SteadyStop` gives the meanings."""

    held_share: Annotated[Scalar, require_quantity("1", minimum=0, maximum=1)]
    explicit_limit: Annotated[Scalar, require_quantity("1", above=0, maximum=2)]


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
    kept = inputs / LOW_SPEED.name
    return load_low_speed(kept) if kept.is_file() else None
