"""How sure the figures of a drive are: their percentiles under the bounds of the surface parameters."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from math import isfinite, nan
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tasks.studies.sensitivity import StudyProtocol, latin_hypercube
from tasks.surface.state import SurfaceParameters
from tasks.surface.weather import Weather, surface_state

PERCENTILES = (5, 50, 95)
DRIVEN_PERCENTILES = (5, 25, 50, 75, 95)
"""Percentiles of the sampled friction at which the car is driven again: the whole cost of the ranges.

Samples beyond the outer ones count as these, which moves no percentile within them."""


def sampled_friction(
    weather: Weather, surface: SurfaceParameters, study: StudyProtocol
) -> NDArray[np.float64]:
    """Reference surface coefficients under the Latin hypercube of the paper's sensitivity study (Appendix E).

    Parameters
    ----------
    weather : of the clip; a kind that the study does not vary draws every parameter that has bounds, of which those
        of its own law alone matter
    surface : nominal parameters with their bounds
    study : sampling of the study

    Returns
    -------
    mu_c of each sample, shape (samples,) [1]
    """
    varied = study.weathers.get(weather.kind)
    names = varied.parameters if varied else tuple(surface.bounds)
    # the study is the paper's, whose law knows none of these; drawn last, they leave the others their samples
    names += tuple(name for name in surface.bounds if name.startswith("wet_") and name not in names)
    seed = (varied or next(iter(study.weathers.values()))).seed
    columns = latin_hypercube(surface.bounds, names, study.samples, seed)
    rows: list[dict[str, Any]] = [
        {name: float(values[n]) for name, values in columns.items()} for n in range(study.samples)
    ]
    drawn = [replace(surface, **row) for row in rows]
    return np.array([surface_state(weather, one).friction for one in drawn])


def label_ranges(
    friction: NDArray[np.float64],
    drive: Callable[[float], Mapping[str, float]],
    driven_at: Sequence[int] = DRIVEN_PERCENTILES,
) -> dict[str, float]:
    """Percentiles of friction, and of the figures of a drive, over samples of the surface.

    The surface reaches the vehicle through mu_c, with the nominal dependence on speed, so the car is driven at
    some percentiles of mu_c, and each sample's figures lie between those of its neighbours.

    Parameters
    ----------
    friction : mu_c of each sample, shape (n,) [1]
    drive : mu_c [1] to figures by name; one that is not finite is more than the drive contains, such as the stopping
        distance of a car that does not stop
    driven_at : percentiles of the friction at which it is driven; `PERCENTILES` serve figures that rise or fall with it

    Returns
    -------
    ``surface_friction_p05``, ``_p50``, ``_p95`` [1], and those of each figure [its unit]; a percentile that the drives
    do not contain is NaN
    """
    driven = np.unique(np.percentile(friction, driven_at))
    drives = [drive(float(mu)) for mu in driven]
    samples = {"surface_friction": friction}
    samples |= {
        name: _interpolate(friction, driven, np.array([figures[name] for figures in drives], np.float64))
        for name in drives[0]
    }
    return {
        f"{name}_p{percentile:02d}": _percentile(values, percentile)
        for name, values in samples.items()
        for percentile in PERCENTILES
    }


def _interpolate(
    friction: NDArray[np.float64], driven: NDArray[np.float64], values: NDArray[np.float64]
) -> NDArray[np.float64]:
    known = np.isfinite(values)
    found = np.interp(friction, driven, np.where(known, values, 0.0))
    # between a drive that contains it and one that does not, nobody knows: counted as more
    found[np.interp(friction, driven, known.astype(float)) < 1.0] = np.inf
    return found


def _percentile(values: NDArray[np.float64], percentile: float) -> float:
    with np.errstate(invalid="ignore"):  # between two infinities
        found = float(np.percentile(values, percentile))
    return found if isfinite(found) else nan
