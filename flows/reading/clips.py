"""One clip of an opened dataset: its tables, its plot, and how a notebook shows it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np

from catalogs.sentences import shorten
from flows.pages.figures import Figure, Line, Panel, Style, as_plotly
from flows.reading.arguments import is_whole
from flows.reading.suggestions import suggest_clips
from tasks.errors import InputError

if TYPE_CHECKING:
    import numpy as np
    import pandas as pd
    import plotly.graph_objects as go
    from numpy.typing import NDArray

    from flows.reading.opening import Dataset


@dataclass(frozen=True, kw_only=True)
class Clip:
    """A clip of a dataset.

    Parameters
    ----------
    dataset : that it belongs to
    record : what the manifest says of it: scenario, figures, verdict
    """

    dataset: "Dataset" = field(repr=False)
    record: Mapping[str, Any] = field(repr=False)

    @property
    def label(self) -> str:
        """The clip's levels of the grid's axes."""
        label: str = self.record["label"]
        return label

    @property
    def clip_id(self) -> str:
        """Content id, the join key of every table."""
        clip_id: str = self.record["clip_id"]
        return clip_id

    @property
    def figures(self) -> Mapping[str, Any]:
        """Figures of the clip such as ``stopping_distance``, by column name; not represented is None."""
        figures: Mapping[str, Any] = self.record["figures"]
        return figures

    def __repr__(self) -> str:
        return f"Clip({self.label!r} of {self.dataset.place!r})"

    def pandas(self, table: str = "ticks", columns: str | Sequence[str] | None = None) -> "pd.DataFrame":
        """Return the clip's rows of a view as a pandas frame, as `Dataset.pandas` does.

        Parameters
        ----------
        table : clips, ticks, frames or verdicts
        columns : those to read; None takes all
        """
        return self.dataset.pandas(table, columns, clip=self.label)

    def picture(self, frame: int | None = None) -> "NDArray[np.uint8]":
        """Return one frame, sRGB [H, W, 3]; no other is read.

        Parameters
        ----------
        frame : its number from 0; None takes the middle one

        Raises
        ------
        InputError
            If the dataset has no frames, the clip no such frame, or the picture is damaged.
        """
        frames = self.dataset.head["grid"]["frames"]
        chosen = frames // 2 if frame is None else frame
        if not (is_whole(chosen) and 0 <= chosen < frames):
            raise InputError(f"frame {frame}: must be one of the {frames} frames of the clip, from 0")
        if self.dataset.head["grid"].get("pictures") == "later":
            made = self.dataset.source.read_window(self.record["index"], slice(chosen, chosen + 1), ["rgb"])
            return made["rgb"][0]
        rgb: Any = self.dataset.frames["rgb"]
        try:
            picture: NDArray[np.uint8] = rgb[self.record["index"], chosen]
        except (ValueError, RuntimeError, OSError) as error:
            raise InputError(
                f"{self.dataset.place}/frames.zarr/rgb: clip {self.label} must be readable; {shorten(error)}:"
                " musync lab repair makes it again"
            ) from None
        return picture

    def plot(self) -> "go.Figure":
        """Return speed, slip, wheel load and pitch over time as a Plotly figure."""
        return draw_clip(self.label, self.pandas("ticks", COLUMNS))

    def _repr_html_(self) -> str:
        from flows.reading.notebook_cards import clip_card

        return clip_card(self)


def find_clip(rows: Sequence[Mapping[str, Any]], name: object, origin: object) -> Mapping[str, Any]:
    """Return the record of the clip of this label or id.

    Parameters
    ----------
    rows : all clips of a dataset
    name : label or id
    origin : what messages call the dataset

    Raises
    ------
    InputError
        If there is none, with the labels that come near.
    """
    found = next((row for row in rows if name in (row["label"], row["clip_id"])), None)
    if found is None:
        raise suggest_clips(origin, [name], [row["label"] for row in rows], "list(data)")
    return found


if TYPE_CHECKING:
    import pandas as pd
    import plotly.graph_objects as go
_FRONT, _REAR = "a", "b"
_PANELS: tuple[tuple[str, float, tuple[tuple[str, str, str], ...]], ...] = (
    ("speed [km/h]", 3.6, (("speed", "speed", _FRONT),)),
    ("braking slip", 1.0, (("braking_slip_f", "front", _FRONT), ("braking_slip_r", "rear", _REAR))),
    # half of the half-car's axle load rests on each wheel
    ("wheel load [kN]", 0.5e-3, (("axle_load_f", "front", _FRONT), ("axle_load_r", "rear", _REAR))),
    ("pitch [deg]", 180 / np.pi, (("pitch", "pitch", _FRONT),)),
)
"""Title, shown value over the column's, and lines: column, name in the key, colour."""
COLUMNS = ("t_ns", "brake_pressure_mpa", *(column for _, _, lines in _PANELS for column, _, _ in lines))
"""Of the view ticks, that the figure shows."""


def draw_clip(label: str, ticks: "pd.DataFrame") -> "go.Figure":
    """Return a Plotly figure of four panels over one time axis; the time from the brake's onset to its end is shaded.

    Parameters
    ----------
    label : of the clip
    ticks : its `COLUMNS`, a row a tick
    """
    import plotly.graph_objects as go  # it takes half a second, which other questions need not pay

    seconds = ticks["t_ns"].to_numpy() * 1e-9
    braking = seconds[np.flatnonzero(ticks["brake_pressure_mpa"].to_numpy() > 0)]
    panels = [
        Panel(
            y=title,
            lines=[
                Line(name=name, x=seconds, y=ticks[column].to_numpy() * factor, style=Style(colour))
                for column, name, colour in lines
            ],
            shaded=[(braking[0], braking[-1])] if braking.size else [],
        )
        for title, factor, lines in _PANELS
    ]
    drawn = as_plotly(Figure(caption=label, panels=panels, linked=True, panel_px=180), digits=None)
    return go.Figure(**drawn).update_layout(title_text=escape(label, quote=False))
