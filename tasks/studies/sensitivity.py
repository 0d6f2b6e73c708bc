"""The protocol of the study of surface parameters, and how they are drawn (paper, Appendix E)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, kw_only=True)
class WeatherStudy:
    """Parameters that are varied in one kind of weather, and how.

    Parameters
    ----------
    kind : name of the kind of weather
    seed : of the Latin hypercube
    parameters : fields of ``SurfaceParameters``, in the order in which they are drawn
    highest_rate : of the precipitation [mm/h]
    sampled_rates, nominal_rates : how many rates from 0 on, for the samples and for the nominal curve
    """

    kind: str
    seed: int
    parameters: tuple[str, ...]
    highest_rate: float
    sampled_rates: int
    nominal_rates: int


@dataclass(frozen=True, kw_only=True)
class StudyProtocol:
    """The frozen braking protocol and the sampling of the study.

    Parameters
    ----------
    initial_speed : at the brake onset [m/s]
    peak_pressure_mpa : [MPa]
    ramp_s : [s]
    coast_deceleration : of the vehicle in this study [m/s2]
    step_s : Euler step [s]
    snow_accumulation_h : [h]
    samples : size of each Latin hypercube
    percentiles : lower and upper edge of the envelopes [%]
    weathers : what is varied, by kind of weather; the paper's are rain and snow
    """

    initial_speed: float
    peak_pressure_mpa: float
    ramp_s: float
    coast_deceleration: float
    step_s: float
    snow_accumulation_h: float
    samples: int
    percentiles: tuple[float, float]
    weathers: Mapping[str, WeatherStudy]


@dataclass(frozen=True, kw_only=True)
class PrintedFigure:
    """A figure as it was published.

    Parameters
    ----------
    figure : its place in the study's result, keys joined by dots
    value : as printed
    digits : decimals that were printed
    unit : its unit
    """

    figure: str
    value: float
    digits: int
    unit: str


def latin_hypercube(
    bounds: Mapping[str, tuple[float, float]], parameters: Sequence[str], count: int, seed: int
) -> dict[str, NDArray[np.float64]]:
    """Draw each parameter once from each of ``count`` equal strata of its range.

    Parameters
    ----------
    bounds : range of each parameter
    parameters : names, in the order in which they are drawn
    count : samples
    seed : of NumPy's default generator
    """
    rng = np.random.default_rng(seed)
    samples = {}
    for name in parameters:
        low, high = bounds[name]
        samples[name] = low + (high - low) * (rng.permutation(count) + rng.random(count)) / count
    return samples
