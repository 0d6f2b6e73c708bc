"""How well the numbers of a measured session are known: one sigma each."""

from typing import Annotated

from pydantic import AfterValidator, Field

from catalogs.quantities import CatalogueEntry

Sigma = Annotated[float, Field(strict=True, gt=0)]
LARGEST_SHARE = 1.0
"""One sigma of a number over the number [1]: who gives 5 for 5 % would otherwise say that nothing is known of it."""


def _check_share(sigma: float) -> float:
    if sigma > LARGEST_SHARE:
        raise ValueError(f"must be a share of at most {LARGEST_SHARE:g}, not per cent; it is {sigma:g}")
    return sigma


Share = Annotated[Sigma, AfterValidator(_check_share)]


class RunTolerances(CatalogueEntry):
    """One-sigma doubts about a single run."""

    initial_speed_m_s: Sigma
    friction: Share
    acceleration_bias_m_s2: Sigma
    pitch_offset_deg: Sigma


class Tolerances(CatalogueEntry):
    """One-sigma doubts about a session, relative save the grade."""

    pressure_gain: Share
    mass: Share
    pitch_gain: Share
    wheel_radius: Share
    suspension_damping: Share
    suspension_stiffness: Share
    grade: Share
    run: RunTolerances
