"""Text files in a channel map."""

from typing import Annotated, Literal

from pydantic import Field, ValidationInfo, field_validator

from catalogs.quantities import CatalogueEntry, Number, Text


class CsvEntry(CatalogueEntry):
    """How text files are written: rows above the names, what stands in rows below them, numbers, and no value."""

    separator: Text = ","
    decimal: Literal[".", ","] = "."
    thousands: Literal["", ".", ",", " ", "'"] = ""
    missing: tuple[Text | Number, ...] = ()
    skip_rows: Annotated[int, Field(strict=True, ge=0)] = 0
    units_row: Annotated[bool, Field(strict=True)] = False
    below_names: tuple[Literal["units", "sources", "notes"], ...] = ()

    @property
    def rows_below(self) -> tuple[str, ...]:
        """What stands in each row between the names and the samples; ``units_row`` is one row of units."""
        return self.below_names or (("units",) if self.units_row else ())

    @field_validator("below_names")
    @classmethod
    def _is_in_place_of_units_row(cls, rows: tuple[str, ...], info: ValidationInfo) -> tuple[str, ...]:
        if rows and info.data.get("units_row"):
            raise ValueError("give units_row or below_names, not both")
        return rows
