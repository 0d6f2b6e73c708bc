"""The paper's figure of the surface parameters' bands: friction above, stopping distance below."""

from collections.abc import Mapping, Sequence
from typing import Any

from flows.pages.figures import Figure, Line, Panel, Style

STYLES = {"rain": Style("a"), "snow": Style("d")}
RATE = {"rain": "rain [mm/h]", "snow": "snow, water equivalent [mm/h]"}
QUANTITIES = {"mu": "surface friction", "stop_m": "stopping distance [m]"}


def draw_sensitivity(
    curves: Mapping[str, Mapping[str, Sequence[float]]], printed: Sequence[Mapping[str, Any]]
) -> Figure:
    """Draw nominal curves and their bands over the rates; published figures are marks.

    Parameters
    ----------
    curves : of `tasks.studies.sensitivity.sensitivity_study`, by kind of weather
    printed : its figures beside the published ones
    """
    marks = [mark for mark in map(_place_print, printed) if mark is not None]
    panels = []
    for quantity, label in QUANTITIES.items():
        for kind, curve in curves.items():
            points = [mark[2:] for mark in marks if mark[:2] == (kind, quantity)]
            lines = [
                Line(
                    name=f"{kind}, 5th to 95th percentile", x=curve["rates_mm_h"], y=[None] * len(curve["rates_mm_h"]),
                    low=curve[f"{quantity}_p05"], high=curve[f"{quantity}_p95"], style=STYLES[kind],
                ),
                Line(name=f"{kind}, nominal", x=curve["nominal_rates_mm_h"], y=curve[f"nominal_{quantity}"],
                     style=STYLES[kind]),
                *([Line(name="printed in the paper", x=[rate for rate, _ in points], y=[value for _, value in points],
                        marked=None)] if points else []),
            ]  # fmt: skip
            panels.append(Panel(x=RATE[kind], y=label, lines=lines))
    return Figure(
        caption="Friction and stopping distance over the rate, 5th to 95th percentile; marks: printed.",
        panels=panels,
        columns=len(curves),
    )


def _place_print(row: Mapping[str, Any]) -> tuple[str, str, float, float] | None:
    """Return kind, quantity, rate and value of a figure such as ``snow1_stop_m.p05``; None for a correlation."""
    place = str(row["figure"]).partition(".")[0]
    where, _, quantity = place.partition("_")
    kind = where.rstrip("0123456789")
    if kind not in STYLES:
        return None
    return kind, quantity, float(where.removeprefix(kind)), float(row["printed"])
