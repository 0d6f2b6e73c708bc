"""How far bounded changes of the surface parameters move friction and stopping distance (paper, Appendix E)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tasks.studies.sensitivity import PrintedFigure, StudyProtocol, WeatherStudy, latin_hypercube
from tasks.surface.state import SurfaceParameters
from tasks.surface.weather import DRY, Weather, surface_state
from tasks.vehicle.brake import BrakeCommand
from tasks.vehicle.paper.wheels import build_wheels, simulate_stop
from tasks.vehicle.parameters import Vehicle, compute_surface_response

LONGEST_STOP_S = 60.0
"""A stopping run that takes longer is given up [s]."""


@dataclass(frozen=True, kw_only=True)
class WeatherCurves:
    """Friction and stopping distance over the rates of one kind of weather.

    Parameters
    ----------
    samples : value of each varied parameter in each sample
    rates : of the samples, shape (r,) [mm/h]
    mu, stop_m : of every sample at every rate, shape (samples, r) [1], [m]
    nominal_rates : shape (k,) [mm/h]
    nominal_mu, nominal_stop_m : with the nominal parameters, shape (k,) [1], [m]
    """

    samples: Mapping[str, NDArray[np.float64]]
    rates: NDArray[np.float64]
    mu: NDArray[np.float64]
    stop_m: NDArray[np.float64]
    nominal_rates: NDArray[np.float64]
    nominal_mu: NDArray[np.float64]
    nominal_stop_m: NDArray[np.float64]


def sensitivity_study(
    vehicle: Vehicle, surface: SurfaceParameters, protocol: StudyProtocol
) -> dict[str, Any]:
    """Run the whole study, 4,434 stops with the paper's protocol.

    Parameters
    ----------
    vehicle : the vehicle, whose coast drag the protocol replaces
    surface : nominal parameters with their bounds
    protocol : braking protocol and sampling

    Returns
    -------
    Plain numbers and lists: stops [m] and friction [1] at Rain-50, Snow-1 and Snow-3 as nominal, p05 and p95;
    Spearman's rho of the stop with each varied parameter; the number of solver cases; and for each kind of
    weather the nominal curve and the envelope over the rates.
    """
    rain, snow = (
        weather_curves(vehicle, surface, protocol, protocol.weathers[kind]) for kind in ("rain", "snow")
    )
    percentiles = protocol.percentiles
    return {
        "rain50_stop_m": _envelope_at(rain, "stop_m", 50.0, percentiles),
        "snow1_stop_m": _envelope_at(snow, "stop_m", 1.0, percentiles),
        "snow3_stop_m": _envelope_at(snow, "stop_m", 3.0, percentiles),
        "rain50_mu": _envelope_at(rain, "mu", 50.0, percentiles),
        "spearman": {
            "rain50": _correlations(rain, 50.0),
            "snow1": _correlations(snow, 1.0),
            "snow3": _correlations(snow, 3.0),
        },
        "solver_cases": sum(c.stop_m.size + c.nominal_stop_m.size for c in (rain, snow)),
        "curves": {"rain": _curves(rain, percentiles), "snow": _curves(snow, percentiles)},
    }


def weather_curves(
    vehicle: Vehicle, surface: SurfaceParameters, protocol: StudyProtocol, study: WeatherStudy
) -> WeatherCurves:
    """Friction and stops of one kind of weather, sampled and nominal; at rate 0 the road is dry.

    Parameters
    ----------
    vehicle, surface, protocol : as in ``sensitivity_study``
    study : what is varied
    """
    samples = latin_hypercube(surface.bounds, study.parameters, protocol.samples, study.seed)
    rows: list[dict[str, Any]] = [
        {name: float(values[n]) for name, values in samples.items()} for n in range(protocol.samples)
    ]
    drawn = [replace(surface, **row) for row in rows]
    rates = np.linspace(0, study.highest_rate, study.sampled_rates)
    nominal_rates = np.linspace(0, study.highest_rate, study.nominal_rates)
    mu, stop_m = _stops(vehicle, drawn, protocol, study.kind, rates)
    nominal_mu, nominal_stop_m = _stops(vehicle, [surface], protocol, study.kind, nominal_rates)
    return WeatherCurves(
        samples=samples,
        rates=rates,
        mu=mu,
        stop_m=stop_m,
        nominal_rates=nominal_rates,
        nominal_mu=nominal_mu[0],
        nominal_stop_m=nominal_stop_m[0],
    )


def beside_print(result: Mapping[str, Any], printed: Sequence[PrintedFigure]) -> list[dict[str, Any]]:
    """The study's figures beside the published ones.

    Parameters
    ----------
    result : of ``sensitivity_study``
    printed : the published figures

    Returns
    -------
    One row per figure: ``figure``, ``printed``, ``obtained``, ``unit`` and ``agrees``, which says whether the
    obtained figure rounds to the printed digits.
    """
    rows = []
    for figure in printed:
        obtained: Any = result
        for key in figure.figure.split("."):
            obtained = obtained[key]
        rows.append(
            {
                "figure": figure.figure,
                "printed": figure.value,
                "obtained": obtained,
                "unit": figure.unit,
                "agrees": round(obtained, figure.digits) == round(figure.value, figure.digits),
            }
        )
    return rows


def _stops(
    vehicle: Vehicle,
    surfaces: Sequence[SurfaceParameters],
    protocol: StudyProtocol,
    kind: str,
    rates: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    wheels = build_wheels(replace(vehicle, coast_deceleration=protocol.coast_deceleration))
    brake = BrakeCommand(
        peak_pressure_mpa=protocol.peak_pressure_mpa,
        ramp_s=protocol.ramp_s,
        onset_s=0.0,
        onset_station_m=None,
        hold_s=None,
        release_s=0.0,
    ).profile
    longest = round(LONGEST_STOP_S / protocol.step_s)
    mu, stop_m = np.empty((len(surfaces), len(rates))), np.empty((len(surfaces), len(rates)))
    for column, rate in enumerate(rates):
        weather = Weather(
            kind=kind if rate > 0 else DRY,
            precipitation_mm_h=float(rate),
            snow_accumulation_h=protocol.snow_accumulation_h,
        )
        for row, surface in enumerate(surfaces):
            friction = surface_state(weather, surface).friction
            tyre = compute_surface_response(vehicle, weather.kind, friction).tyre
            mu[row, column] = friction
            stop_m[row, column], _ = simulate_stop(
                protocol.initial_speed, protocol.step_s, longest, brake, wheels, tyre
            )
    return mu, stop_m


def _column(rates: NDArray[np.float64], rate: float) -> int:
    return int(np.argmin(np.abs(rates - rate)))


def _envelope_at(
    curves: WeatherCurves, quantity: str, rate: float, percentiles: tuple[float, float]
) -> dict[str, float]:
    sampled = getattr(curves, quantity)[:, _column(curves.rates, rate)]
    nominal = getattr(curves, f"nominal_{quantity}")[_column(curves.nominal_rates, rate)]
    low, high = np.percentile(sampled, percentiles)
    return {"nominal": float(nominal), "p05": float(low), "p95": float(high)}


def _correlations(curves: WeatherCurves, rate: float) -> dict[str, float]:
    """Spearman's rho of the stopping distance with each varied parameter."""
    from scipy.stats import rankdata  # its import takes a fifth of a worker's start

    stop_rank = rankdata(curves.stop_m[:, _column(curves.rates, rate)])
    return {
        name: float(np.corrcoef(rankdata(values), stop_rank)[0, 1]) for name, values in curves.samples.items()
    }


def _curves(curves: WeatherCurves, percentiles: tuple[float, float]) -> dict[str, list[float]]:
    lists = {
        "nominal_rates_mm_h": curves.nominal_rates,
        "nominal_mu": curves.nominal_mu,
        "nominal_stop_m": curves.nominal_stop_m,
        "rates_mm_h": curves.rates,
    }
    for quantity in ("mu", "stop_m"):
        low, high = np.percentile(getattr(curves, quantity), percentiles, axis=0)
        lists |= {f"{quantity}_p05": low, f"{quantity}_p95": high}
    return {name: values.tolist() for name, values in lists.items()}
