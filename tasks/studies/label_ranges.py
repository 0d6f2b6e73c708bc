"""How sure a clip's labels are: friction, stop and peak pitch under the paper's bounds of the surface parameters."""

from collections.abc import Callable
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
"""Percentiles of the sampled friction at which the clip is driven again: the whole cost of its ranges.

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
    friction: NDArray[np.float64], drive: Callable[[float], tuple[float, float]]
) -> dict[str, float]:
    """Percentiles of friction, stopping distance and peak pitch over samples of the surface.

    The surface reaches the vehicle through mu_c, with the nominal dependence on speed, so the clip is driven at
    `DRIVEN_PERCENTILES` of mu_c, and each sample's stop and pitch lie between those of its neighbours.

    Parameters
    ----------
    friction : mu_c of each sample, shape (n,) [1]
    drive : mu_c [1] to stopping distance, NaN where the clip ends first [m], and peak pitch [rad]

    Returns
    -------
    ``surface_friction_p05``, ``_p50``, ``_p95`` [1], ``stopping_distance_...`` [m], ``peak_pitch_...`` [rad]; a
    percentile of the stop that the clip does not contain is NaN
    """
    driven = np.unique(np.percentile(friction, DRIVEN_PERCENTILES))
    stops, pitches = (np.array(values) for values in zip(*(drive(float(mu)) for mu in driven), strict=True))
    stopped = np.isfinite(stops)
    sampled_stops = np.interp(friction, driven, np.where(stopped, stops, 0.0))
    # between a drive that stops and one that does not, nobody knows: counted as the longer
    sampled_stops[np.interp(friction, driven, stopped.astype(float)) < 1.0] = np.inf
    samples = {
        "surface_friction": friction,
        "stopping_distance": sampled_stops,
        "peak_pitch": np.interp(friction, driven, pitches),
    }
    return {
        f"{name}_p{percentile:02d}": _percentile(values, percentile)
        for name, values in samples.items()
        for percentile in PERCENTILES
    }


def _percentile(values: NDArray[np.float64], percentile: float) -> float:
    with np.errstate(invalid="ignore"):  # between two infinities
        found = float(np.percentile(values, percentile))
    return found if isfinite(found) else nan
