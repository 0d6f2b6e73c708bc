"""Protocols by which video editors are judged: tasks, prompts, models, and the figures printed of them."""

from pathlib import Path
from typing import Annotated

from pydantic import Field, model_validator

from catalogs.names import Name, WeatherName
from catalogs.quantities import CatalogueEntry, Number, Scalar, Table, Text, require_quantity
from studies.plans import load_plan

Count = Annotated[Scalar, require_quantity("1", minimum=1)]
Time = Annotated[Scalar, require_quantity("s", above=0)]
Names = Annotated[tuple[Name, ...], Field(min_length=1)]
PrintedFigure = Annotated[tuple[Number, ...], Field(min_length=1, max_length=2)]
"""Mean and, where it is printed, sample standard deviation over seeds."""


class WeatherLevel(CatalogueEntry):
    """A weather that an editor is asked for."""

    weather: WeatherName
    precipitation_mm_h: Annotated[Number, Field(gt=0)] | Annotated[int, Field(gt=0)]


class ModelInputs(CatalogueEntry):
    """An editor as the source ran it: its name and revision, what it is given in each task, and its settings."""

    name: Text
    revision: Text
    code: Text
    weather_input: Text
    geometry_input: Text
    preservation_input: Text
    settings: Text


class VideoProtocol(CatalogueEntry):
    """A protocol for video editors.

    Clips are named TASK/NAME: ``weather`` with its control and levels, ``geometry`` with its control and features, and
    ``preservation`` with WEATHER-MOTION of every weather and of braking and each event.
    """

    seeds: Annotated[Table, require_quantity("1")]
    frames: Count
    weather_interval: Time
    weather_duration: Time
    event_opening: Time
    retention_event: Annotated[Table, require_quantity("1")]
    smoothing_window: Count
    weather_control: Name
    weather_levels: dict[Name, WeatherLevel]
    geometry_control: Name
    geometry_features: Names
    preservation_weathers: Names
    preservation_motion: Name
    preservation_events: Names
    prompts: dict[Text, Text]
    models: dict[Name, ModelInputs]
    unprinted: tuple[Text, ...]
    printed: dict[Name, dict[Name, PrintedFigure] | Text]

    @model_validator(mode="after")
    def _is_consistent(self) -> "VideoProtocol":
        problems = [
            f"prompt {name} must be of a task of the protocol"
            for name in self.prompts
            if name not in self.clips
        ]
        event = self.retention_event.value
        if len(event) != 2 or not 0 <= event[0] < event[1]:
            problems.append(f"retention_event must be a frame and a later one; it is {list(event)}")
        if not isinstance(self.printed.get("source"), str):
            problems.append("printed must say its source")
        if problems:
            raise ValueError("; ".join(problems))
        return self

    @property
    def clips(self) -> tuple[str, ...]:
        """Names of all clips that an editor makes under one seed."""
        motions = (self.preservation_motion, *self.preservation_events)
        return (
            *(f"weather/{name}" for name in (self.weather_control, *self.weather_levels)),
            *(f"geometry/{name}" for name in (self.geometry_control, *self.geometry_features)),
            *(
                f"preservation/{weather}-{motion}"
                for weather in self.preservation_weathers
                for motion in motions
            ),
        )

    @property
    def printed_figures(self) -> dict[str, dict[str, PrintedFigure]]:
        """Printed figures by model and metric, without their source."""
        return {model: figures for model, figures in self.printed.items() if not isinstance(figures, str)}


def load_protocol(name_or_path: str | Path) -> VideoProtocol:
    """Return a video protocol by its name in this folder or its file, as `studies.plans.load_plan` does."""
    protocol: VideoProtocol = load_plan(VideoProtocol, Path(__file__).parent, name_or_path, "video protocol")
    return protocol
