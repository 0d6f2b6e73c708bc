"""The paper's surface-parameter sensitivity (Appendix E): bands of friction and stops, beside the printed figures."""

import time
from collections.abc import Mapping, Sequence
from typing import Any

from catalogs.entries import load
from flows.pages.figures import Figure, Line, Panel, Style
from flows.pages.static import as_svg
from flows.pages.writer import Section, Table, write_page
from flows.store.outputs import Outputs
from studies.paper.stop_curves import beside_print, sensitivity_study

STYLES = {"rain": Style("a"), "snow": Style("d")}
RATE = {"rain": "rain [mm/h]", "snow": "snow, water equivalent [mm/h]"}
QUANTITIES = {"mu": "surface friction", "stop_m": "stopping distance [m]"}


def run_sensitivity(*, out: str | None = None) -> dict[str, Any]:
    """The paper's Appendix E: envelopes and rank correlations, beside the printed figures."""
    results = Outputs(out, "lab sensitivity", "sensitivity.json", "sensitivity.svg", "sensitivity.html")
    protocol, printed = load("sensitivity study")
    vehicle, surface = load("vehicle", "paper-reference"), load("surface", "dense-asphalt")
    started = time.process_time()
    result = sensitivity_study(vehicle, surface, protocol)
    result |= {"cpu_s": time.process_time() - started, "beside_print": beside_print(result, printed)}
    results.write_json("sensitivity.json", result)
    figure = draw_sensitivity(result["curves"], result["beside_print"])
    results.write("sensitivity.svg", as_svg(figure))
    page = write_page(
        "muSync: sensitivity",
        "Sensitivity to the surface parameters",
        [
            Section(title="Bands", parts=[figure]),
            Section(title="Beside the printed figures", parts=[Table(rows=result["beside_print"])]),
        ],
        lead=[
            "The paper's Appendix E: the numbers of the surface mapping are drawn within their bounds, and every draw"
            " is driven to the stop. Printed figures agree if they are met to their last digit."
        ],
    )
    results.write("sensitivity.html", page)
    return result


def draw_sensitivity(
    curves: Mapping[str, Mapping[str, Sequence[float]]], printed: Sequence[Mapping[str, Any]]
) -> Figure:
    """Draw nominal curves and their bands over the rates; published figures are marks.

    Parameters
    ----------
    curves : of `studies.paper.stop_curves.sensitivity_study`, by kind of weather
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
