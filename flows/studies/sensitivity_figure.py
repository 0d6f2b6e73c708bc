"""The paper's figure of the surface parameters' bands: friction above, stopping distance below."""

from collections.abc import Mapping, Sequence
from typing import Any

from matplotlib.figure import Figure

COLOURS = {"rain": "#1f6fb2", "snow": "#7b4fa3"}
RATE = {"rain": "rain [mm/h]", "snow": "snow, water equivalent [mm/h]"}
ROWS = (("mu", "surface friction $\\mu_c$ [1]"), ("stop_m", "stopping distance [m]"))


def draw_sensitivity(
    curves: Mapping[str, Mapping[str, Sequence[float]]], printed: Sequence[Mapping[str, Any]]
) -> Figure:
    """Draw nominal curves and their bands over the rates; published figures are crosses.

    Parameters
    ----------
    curves : of `tasks.studies.sensitivity.sensitivity_study`, by kind of weather
    printed : its figures beside the published ones
    """
    figure = Figure(figsize=(8, 5.2), layout="constrained")
    axes = figure.subplots(len(ROWS), len(curves), sharex="col", sharey="row", squeeze=False)
    for column, (kind, curve) in enumerate(curves.items()):
        for row, (quantity, label) in enumerate(ROWS):
            axis = axes[row][column]
            axis.fill_between(
                curve["rates_mm_h"], curve[f"{quantity}_p05"], curve[f"{quantity}_p95"],
                color=COLOURS[kind], alpha=0.2, lw=0, label="5th to 95th percentile",
            )  # fmt: skip
            axis.plot(
                curve["nominal_rates_mm_h"],
                curve[f"nominal_{quantity}"],
                color=COLOURS[kind],
                label="nominal",
            )
            marks = [mark for mark in map(_place_print, printed) if mark and mark[:2] == (kind, quantity)]
            if marks:
                axis.plot(
                    *zip(*(mark[2:] for mark in marks), strict=True), "kx", ms=6, label="printed in the paper"
                )
            axis.spines[["top", "right"]].set_visible(False)
            if column == 0:
                axis.set_ylabel(label)
        axes[-1][column].set_xlabel(RATE[kind])
        axes[0][column].legend(fontsize=7, frameon=False)
    return figure


def _place_print(row: Mapping[str, Any]) -> tuple[str, str, float, float] | None:
    """Return kind, quantity, rate and value of a figure such as ``snow1_stop_m.p05``; None for a correlation."""
    place = str(row["figure"]).partition(".")[0]
    where, _, quantity = place.partition("_")
    kind = where.rstrip("0123456789")
    if kind not in COLOURS:
        return None
    return kind, quantity, float(where.removeprefix(kind)), float(row["printed"])
