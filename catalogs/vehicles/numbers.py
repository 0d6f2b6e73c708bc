"""Numbers of a vehicle file: value, unit, source, and how far the value may be off."""

from typing import Annotated

from pydantic import Field, model_validator

from catalogs.quantities import Number, Scalar


class VehicleNumber(Scalar):
    """One number with its unit and source.

    ``tolerance`` is one sigma of the value, in the number's own unit: a scale that shows 1 kg steps, a data sheet that
    rounds, a height that was guessed. None where nobody has said.
    """

    tolerance: Annotated[Number, Field(gt=0)] | None = None

    @model_validator(mode="after")
    def _tolerance_has_a_relative_size(self) -> "VehicleNumber":
        if self.tolerance is not None and self.value == 0:
            raise ValueError(
                f"a value of 0 must have no tolerance, whose relative size is none; it is {self.tolerance:g}:"
                " remove it"
            )
        return self

    @property
    def relative_tolerance(self) -> float | None:
        """One sigma over the value [1]; None where the number has no tolerance."""
        return None if self.tolerance is None else self.tolerance / abs(self.value)
