"""The limits a generated clip must keep."""

from pathlib import Path
from typing import Annotated

from catalogs.quantities import CatalogueEntry, Scalar, checked, read_entry
from tasks.eval.motion_agreement import PoseThresholds

GATES = Path(__file__).with_name("gates.yaml")


class GateEntry(CatalogueEntry):
    """What a gate file must hold; the meanings stand at ``PoseThresholds``."""

    pitch_rmse_deg: Annotated[Scalar, checked("deg", above=0)]
    pitch_relative_error: Annotated[Scalar, checked("1", above=0)]
    pitch_correlation: Annotated[Scalar, checked("1", minimum=-1, maximum=1)]
    response_deg: Annotated[Scalar, checked("deg", minimum=0)]
    progress_rmse_m: Annotated[Scalar, checked("m", above=0)]
    normalised_progress_rmse: Annotated[Scalar, checked("1", above=0)]
    failed_share: Annotated[Scalar, checked("1", minimum=0, maximum=1)]


def load_gates(path: Path = GATES) -> PoseThresholds:
    """Read the limits.

    Raises
    ------
    InputError
        Listing every problem of the file.
    """
    entry = read_entry(GateEntry, path, "gate file")
    return PoseThresholds(**{name: getattr(entry, name).value for name in GateEntry.model_fields})
