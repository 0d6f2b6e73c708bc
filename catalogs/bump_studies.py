"""Studies of road features in a recording: which run, and where to look."""

from typing import Annotated

from pydantic import Field, model_validator

from catalogs.quantities import CatalogueEntry, Number, Text


class BumpWindow(CatalogueEntry):
    """A stretch of the run with one road feature [s]."""

    name: Text
    from_s: Number
    to_s: Number

    @model_validator(mode="after")
    def _is_an_interval(self) -> "BumpWindow":
        if self.from_s + 1.0 > self.to_s:
            raise ValueError(
                f"window {self.name} must last 1 s or more; it goes from {self.from_s:g} to {self.to_s:g}"
            )
        return self


class BumpStudy(CatalogueEntry):
    """Content of a study file; the first window calibrates the car."""

    run: Text
    windows: Annotated[tuple[BumpWindow, ...], Field(min_length=1)]
