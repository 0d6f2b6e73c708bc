"""The limits that a generated clip, and that any other video, must keep."""

from typing import Annotated

from catalogs.quantities import CatalogueEntry, Scalar, require_quantity
from tasks.eval.motion_agreement import PoseThresholds


class ForeignGateEntry(CatalogueEntry):
    """Content of a gate file for any video; `PoseThresholds` gives the meanings."""

    pitch_relative_error: Annotated[Scalar, require_quantity("1", above=0)]
    pitch_correlation: Annotated[Scalar, require_quantity("1", minimum=-1, maximum=1)]
    response_deg: Annotated[Scalar, require_quantity("deg", minimum=0)]
    normalised_progress_rmse: Annotated[Scalar, require_quantity("1", above=0)]
    failed_share: Annotated[Scalar, require_quantity("1", minimum=0, maximum=1)]

    def build(self) -> PoseThresholds:
        """The limits themselves; figures that need depth are not judged where the file has no limit of them."""
        return PoseThresholds(**{"pitch_rmse_deg": float("inf"), "progress_rmse_m": None, **self.numbers()})


class GateEntry(ForeignGateEntry):
    """Content of a gate file for generated clips: with depth, degrees and metres are judged too.

    The file that an older dataset keeps has no limits of the rig's other motion, and leaves it unjudged; it also halves
    no pictures.
    """

    pitch_rmse_deg: Annotated[Scalar, require_quantity("deg", above=0)]
    progress_rmse_m: Annotated[Scalar, require_quantity("m", above=0)]
    roll_rmse_deg: Annotated[Scalar, require_quantity("deg", above=0)] | None = None
    yaw_rmse_deg: Annotated[Scalar, require_quantity("deg", above=0)] | None = None
    lateral_rmse_m: Annotated[Scalar, require_quantity("m", above=0)] | None = None
    rise_rmse_m: Annotated[Scalar, require_quantity("m", above=0)] | None = None
    heave_gain_error: Annotated[Scalar, require_quantity("1", above=0)] | None = None
    heave_gain_std: Annotated[Scalar, require_quantity("1", above=0)] | None = None
    halved_from_px: Annotated[Scalar, require_quantity("px", above=0)] | None = None
