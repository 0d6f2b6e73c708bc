"""Ranges in which the figures of a car lie, and how far its numbers may be off."""

from collections.abc import Mapping

from pydantic import model_validator

from catalogs.entries import load
from catalogs.quantities import CatalogueEntry, Number, Scalar, Text
from tasks.vehicle.figures import FIGURES


class PlausibleRange(CatalogueEntry):
    """Lowest and highest plausible value; ``check`` names the numbers to look at where a value lies outside."""

    low: Number
    high: Number
    unit: Text
    check: Text
    source: Text

    @model_validator(mode="after")
    def _low_is_below_high(self) -> "PlausibleRange":
        if not self.low < self.high:
            raise ValueError(f"low must be below high; they are {self.low:g} and {self.high:g}")
        return self

    def problem(self, name: str, value: float) -> str | None:
        """Return a sentence where a value lies outside, else None.

        Parameters
        ----------
        name : of the value
        value : in the range's unit
        """
        if self.low <= value <= self.high:
            return None
        unit = "" if self.unit == "1" else f" {self.unit}"
        return (
            f"{name} must lie within {self.low:g} to {self.high:g}{unit} ({self.source}); it is {value:.4g}{unit}:"
            f" check {self.check}"
        )


class PlausibleVehicle(CatalogueEntry):
    """Range of each figure of `tasks.vehicle.figures`, range of a tolerance [1], and usual tolerances by field [1]."""

    figures: dict[Text, PlausibleRange]
    tolerance: PlausibleRange
    usual_tolerances: dict[Text, Scalar]

    @model_validator(mode="after")
    def _every_figure_has_a_range_in_its_unit(self) -> "PlausibleVehicle":
        problems = [f"figures: {name} is missing: add it" for name in FIGURES if name not in self.figures]
        problems += [
            f"figures: there is no figure {name}; there are: {', '.join(FIGURES)}"
            for name in self.figures
            if name not in FIGURES
        ]
        problems += [
            f"figures: unit of {name} must be {figure.unit}; it is {self.figures[name].unit}"
            for name, figure in FIGURES.items()
            if name in self.figures and self.figures[name].unit != figure.unit
        ]
        if problems:
            raise ValueError("; ".join(problems))
        return self


def find_plausibility_problems(figures: Mapping[str, float], tolerances: Mapping[str, float]) -> list[str]:
    """Return a sentence for each figure and each tolerance of a vehicle that is implausible.

    Parameters
    ----------
    figures : of `tasks.vehicle.figures.compute_figures`
    tolerances : one sigma of the vehicle's numbers as a share of their values, by field [1]
    """
    ranges = load("table of plausible figures")
    problems = [ranges.figures[name].problem(name, value) for name, value in figures.items()]
    problems += [
        ranges.tolerance.problem(f"tolerance of {name} over its value", share)
        for name, share in tolerances.items()
    ]
    return [problem for problem in problems if problem is not None]
