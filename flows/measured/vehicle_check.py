"""``musync vehicle check``: the figures of a vehicle beside those of cars that exist."""

from math import isfinite, nan
from pathlib import Path
from typing import Any

from catalogs.entries import load
from catalogs.plausible_vehicle import find_plausibility_problems
from catalogs.vehicles import open_vehicle
from flows.measured.vehicle_template import TO_FILL_IN
from tasks.vehicle.figures import compute_figures


def check_vehicle(vehicle: str) -> dict[str, Any]:
    """Say what of a vehicle is implausible.

    Parameters
    ----------
    vehicle : catalogue name or file

    Returns
    -------
    ``plausible``; ``problems``, a sentence each; ``figures`` with their ranges; ``tolerances``, one sigma over the
    value [1]; ``without_source``, the numbers of a template for which nobody has said yet where they come from.

    Raises
    ------
    InputError
        As `catalogs.vehicles.open_vehicle`.
    """
    file = open_vehicle(vehicle)
    figures, tolerances = compute_figures(file.build()), file.tolerances
    problems = find_plausibility_problems(figures, tolerances)
    ranges = load("table of plausible figures").figures
    return {
        "vehicle": vehicle,
        "plausible": not problems,
        "problems": problems,
        "figures": [
            {
                "figure": name,
                "value": value if isfinite(value) else None,
                "unit": ranges[name].unit,
                "low": ranges[name].low,
                "high": ranges[name].high,
            }
            for name, value in figures.items()
        ],
        "tolerances": tolerances,
        "without_source": [
            name for name, number in file.numbers.items() if number.source.startswith(TO_FILL_IN)
        ],
    }


def format_text(result: dict[str, Any]) -> str:
    """Return the result as sentences for people, below them the figures.

    Parameters
    ----------
    result : of `check_vehicle`
    """
    name, problems, unfilled = Path(result["vehicle"]).name, result["problems"], result["without_source"]
    lines = [f"{name}: {problem}" for problem in problems] or [f"{name}: every figure is plausible"]
    if unfilled:
        lines.append(f"{name}: say where these come from, or delete their lines: {', '.join(unfilled)}")
    lines += ["", "figure                          value unit          plausible"]
    for row in result["figures"]:
        value = nan if row["value"] is None else row["value"]
        lines.append(f"{row['figure']:27}{value:10.4g} {row['unit']:14}{row['low']:g} to {row['high']:g}")
    return "\n".join(lines) + "\n"
