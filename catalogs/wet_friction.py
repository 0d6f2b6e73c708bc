"""The law of wet friction by film and speed: the numbers behind ``wet_friction: by-speed``."""

from dataclasses import replace
from typing import Annotated

from catalogs.quantities import Bounded, CatalogueEntry, Scalar, require_quantity
from tasks.surface.state import SurfaceParameters

WET_FRICTION = "wet_friction.yaml"
"""Name among a dataset's kept inputs."""
FROM_KM_H = 1 / 3.6


class WetFrictionEntry(CatalogueEntry):
    """Content of the file; the fields ``wet_...`` of `SurfaceParameters` give the meanings, in SI."""

    friction: Annotated[Bounded, require_quantity("1", above=0, maximum=2)]
    decay_speed: Annotated[Bounded, require_quantity("km h-1", above=0)]
    planing_film_mm: Annotated[Bounded, require_quantity("mm", above=0)]
    planing_exponent: Annotated[Scalar, require_quantity("1", above=0)]
    tyre_pressure_kpa: Annotated[Bounded, require_quantity("kPa", above=0)]
    planing_friction: Annotated[Bounded, require_quantity("1", above=0, maximum=1)]
    reference_speed: Annotated[Scalar, require_quantity("km h-1", above=0)]

    def build(self) -> "WetFrictionEntry":
        """The entry, which is put on a pavement."""
        return self

    def apply(self, pavement: SurfaceParameters) -> SurfaceParameters:
        """Return a pavement that grips by film and speed where it is wet.

        Parameters
        ----------
        pavement : of a surface file
        """
        values, bounds = {}, {}
        for name, number in self:
            scale = FROM_KM_H if number.unit == "km h-1" else 1.0
            values[f"wet_{name}"] = number.value * scale
            if isinstance(number, Bounded):
                low, high = number.bounds
                bounds[f"wet_{name}"] = (low * scale, high * scale)
        return replace(pavement, **values, bounds={**pavement.bounds, **bounds})
