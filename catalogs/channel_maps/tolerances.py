"""How well the numbers of a measured session are known: one sigma each, assumed where a map says nothing."""

from typing import Annotated, Any

from pydantic import AfterValidator, Field

from catalogs.entries import load
from catalogs.quantities import CatalogueEntry, CatalogueList, Scalar

Sigma = Annotated[float, Field(strict=True, gt=0)]
LARGEST_SHARE = 1.0
"""One sigma of a number over the number [1]: who gives 5 for 5 % would otherwise say that nothing is known of it."""


def _check_share(sigma: float) -> float:
    if sigma > LARGEST_SHARE:
        raise ValueError(f"must be a share of at most {LARGEST_SHARE:g}, not per cent; it is {sigma:g}")
    return sigma


Share = Annotated[Sigma, AfterValidator(_check_share)]


class AssumedTolerances(CatalogueList[dict[str, Scalar]]):
    """Content of the file of what is assumed of a number that a map says nothing of."""

    def build(self) -> dict[str, float]:
        """Return one sigma of each number, by name [the unit of the number]."""
        return {name: entry.value for name, entry in self.root.items()}


def _assume(name: str) -> Any:
    return Field(default_factory=lambda: load("set of assumed tolerances")[name])


class RunTolerances(CatalogueEntry):
    """One-sigma tolerances of a single run."""

    initial_speed_m_s: Sigma = _assume("initial_speed_m_s")
    friction: Share = _assume("friction")
    acceleration_bias_m_s2: Sigma = _assume("acceleration_bias_m_s2")
    pitch_offset_deg: Sigma = _assume("pitch_offset_deg")


class Tolerances(CatalogueEntry):
    """One-sigma tolerances of a session, relative but for the grade."""

    pressure_gain: Share = _assume("pressure_gain")
    mass: Share = _assume("mass")
    pitch_gain: Share = _assume("pitch_gain")
    wheel_radius: Share = _assume("wheel_radius")
    suspension_damping: Share = _assume("suspension_damping")
    suspension_stiffness: Share = _assume("suspension_stiffness")
    grade: Share = _assume("grade")
    run: RunTolerances = Field(default_factory=RunTolerances)

    def list_assumed(self) -> dict[str, float]:
        """Return the tolerances that were assumed, by name; those of a run as ``run.NAME``."""
        assumed = {
            name: getattr(self, name) for name in type(self).model_fields if name not in self.model_fields_set
        }
        run = assumed.pop("run", self.run)
        left = [name for name in RunTolerances.model_fields if name not in run.model_fields_set]
        return assumed | {f"run.{name}": getattr(run, name) for name in left}
