"""``musync vehicle check``: the figures of a vehicle beside those of cars that exist."""

from math import isfinite, nan
from pathlib import Path
from typing import Any

from catalogs.plausible_vehicle import find_plausibility_problems, load_plausible_vehicle
from catalogs.vehicles import load_tolerances, load_vehicle, vehicle_numbers
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
        As `catalogs.vehicles.load_vehicle`.
    """
    figures, tolerances = compute_figures(load_vehicle(vehicle)), load_tolerances(vehicle)
    problems = find_plausibility_problems(figures, tolerances)
    ranges = load_plausible_vehicle().figures
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
            name for name, number in vehicle_numbers(vehicle).items() if number.source.startswith(TO_FILL_IN)
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
