"""Forms outside the library: splines of the residual over pairs of port and variable, and simple shapes for them."""

from collections.abc import Mapping, Sequence
from math import ceil

import numpy as np
from numpy.typing import NDArray

from tasks.campaign.campaign import CHANNELS
from tasks.identification.decision.excitation import read_variable
from tasks.identification.inference.evidence import Evidence, RunEvidence
from tasks.identification.inference.fit import Fit
from tasks.identification.inference.forward import RunModel
from tasks.identification.inference.hypothesis import Hypothesis
from tasks.identification.inference.noise import rewhiten_channels, whiten_channels
from tasks.identification.inference.quotients import compute_slot_quotients, simulate_point
from tasks.vehicle.effects.forms import SHAPES, Form, name_form, read_form_name
from tasks.vehicle.effects.ports import PORT_UNITS
from tasks.vehicle.effects.slots import Slot
from tasks.vehicle.effects.table import EFFECT_TABLE
from tasks.vehicle.model.simulation import Simulation

KNOTS = 5
PORT_STEP = {
    "longitudinal_force": 30.0,
    "brake_torque": 0.02,
    "friction": 0.02,
    "pitch_moment": 60.0,
    "suspension_force": 40.0,
}
"""Step of a knot at each port, for derivatives [unit of the port]."""
FORM_MATTERS = {
    "longitudinal_force": 30.0,
    "brake_torque": 0.02,
    "friction": 0.03,
    "pitch_moment": 150.0,
    "suspension_force": 60.0,
}
"""Smallest form that matters at each port: 0.02 m/s2, 2 % of the torque, 3 % of friction, 0.06 deg of pitch and 2 mm
of a spring [unit of the port]."""
SCANNED = {
    "longitudinal_force": ("speed", "deceleration", "pressure"),
    "brake_torque": ("speed", "pressure", "disc_temperature", "pressure_rate"),
    "friction": ("speed", "load_ratio", "pressure_rate"),
    "pitch_moment": ("speed", "deceleration", "pressure_rate"),
    "suspension_force": ("suspension_travel", "suspension_speed"),
}
"""Variables over which each port is scanned."""
RANGE = {
    "speed": (2.0, 34.0), "deceleration": (0.0, 9.0), "pressure": (0.0, 3.6), "disc_temperature": (0.0, 400.0),
    "pressure_rate": (-12.0, 12.0), "load_ratio": (0.4, 1.6), "suspension_travel": (-0.06, 0.06),
    "suspension_speed": (-0.6, 0.6),
}  # fmt: skip
"""Range over which a variable is scanned, where no run of a campaign goes further [unit of the variable]."""
FURTHER = 1.05
"""Share of a range beyond which a variable goes further, and not only its noise [1]."""
FORM_BOUND = 100.0
"""Largest value of a form, over the size that matters at its port [1]."""
SHAPES_TRIED = 2
"""Shapes of the grammar that are fitted through the simulation for a spline [1]."""


AROUND, WIDER = 3, 0.1
"""Samples about an instant, and share of the spacing of knots beside their range, in which a knot may be felt [1]."""
KEYS = tuple((port, variable) for port, variables in SCANNED.items() for variable in variables)
RIDGE = np.repeat([(20.0 * PORT_STEP[port]) ** -2 for port, _ in KEYS], KNOTS)
"""Precision of the broad priors of all knots, in the order of `KEYS`."""


def find_scanned_ranges(runs: Sequence[RunEvidence]) -> dict[str, tuple[float, float]]:
    """Return the range of every variable: `RANGE`, or as far as runs at a higher speed or brake pressure go.

    Brakes with a smaller gain need more pressure for the same stop, and change it faster.

    Parameters
    ----------
    runs : training runs
    """
    ranges: dict[str, tuple[float, float]] = dict(RANGE)
    reached = {
        "speed": max(float(run.model.measured[:, CHANNELS.index("speed")].max()) for run in runs),
        "pressure": max(float(run.model.pressure.max()) for run in runs),
    }
    for variable, value in reached.items():
        low, high = RANGE[variable]
        if value > FURTHER * high:
            ranges[variable] = (low, ceil(10.0 * value) / 10.0)
    fastest = round(RANGE["pressure_rate"][1] * ranges["pressure"][1] / RANGE["pressure"][1], 1)
    ranges["pressure_rate"] = (-fastest, fastest)
    return ranges


def differentiate_by_splines(evidence: Evidence, at: Fit) -> tuple[NDArray[np.float64], ...]:
    """Return the whitened derivatives of every training run by all knots of all splines, float64 [M, K] each.

    Parameters
    ----------
    evidence : the runs
    at : fit about which the derivatives are taken
    """
    theta, slots = at.compose()
    ranges = find_scanned_ranges(evidence.train)
    return tuple(_differentiate_run(run, theta, slots, ranges) for run in evidence.train)


def rewhiten_splines(
    splines: tuple[NDArray[np.float64], ...], before: Evidence, after: Evidence
) -> tuple[NDArray[np.float64], ...]:
    """Return the same derivatives under other noise of the runs.

    Parameters
    ----------
    splines : `differentiate_by_splines` under the noise before
    before, after : the runs under either noise
    """
    return tuple(
        rewhiten_channels(columns, (old.rho, old.sigma), (new.rho, new.sigma), new.model.sampled)
        for columns, old, new in zip(splines, before.train, after.train, strict=True)
    )


def _differentiate_run(
    run: RunEvidence,
    theta: NDArray[np.float64],
    slots: tuple[Slot, ...],
    ranges: Mapping[str, tuple[float, float]],
) -> NDArray[np.float64]:
    """Return the whitened derivatives of one run by all knots, float64 [M, K]; 0 by those that it never reaches."""
    model, point = run.model, simulate_point(run.model, theta, slots)
    columns = np.zeros((*point.readings.shape, KNOTS * len(KEYS)))
    felt, hats, firsts = [], [], []
    for i, (port, variable) in enumerate(KEYS):
        low, high = ranges[variable]
        spacing = (high - low) / (KNOTS - 1)
        for k, first in enumerate(_find_first_samples(model, point.simulated, variable, low, spacing)):
            if first is None:
                continue
            hat = np.zeros(KNOTS)
            hat[k] = PORT_STEP[port]
            felt.append(KNOTS * i + k)
            hats.append(Slot(port=port, variable=variable, origin=low, spacing=spacing, values=hat))
            firsts.append(first)
    columns[:, :, felt] = np.moveaxis(compute_slot_quotients(point, hats, firsts), 0, -1)
    return whiten_channels(columns, run.rho, run.sigma, model.sampled)


def _find_first_samples(
    model: RunModel, simulated: Simulation, variable: str, low: float, spacing: float
) -> list[int | None]:
    """Return by knot the sample from which a run may feel it; None where it never does."""
    values = np.atleast_2d(read_variable(model, simulated, variable))
    position = (values - low) / spacing
    around = np.pad(position, ((0, 0), (AROUND, AROUND)), mode="edge")
    windows = np.lib.stride_tricks.sliding_window_view(around, 2 * AROUND + 1, axis=1)
    least, most = windows.min(axis=(0, 2)) - WIDER, windows.max(axis=(0, 2)) + WIDER
    firsts: list[int | None] = []
    for k in range(KNOTS):
        above = most > (k - 1 if k else -np.inf)
        felt = np.flatnonzero(above & (least < (k + 1 if k < KNOTS - 1 else np.inf)))
        firsts.append(int(felt[0]) if felt.size else None)
    return firsts


def make_spline_hypothesis(
    port: str, variable: str, grid: NDArray[np.float64], start: NDArray[np.float64]
) -> Hypothesis:
    """Return a spline as a hypothesis: its values at the knots.

    Parameters
    ----------
    port, variable : port and variable of the spline
    grid : float64 [K] knots, equally spaced [unit of the variable]
    start : float64 [K] first values [unit of the port]
    """

    def build_slots(values: NDArray[np.float64]) -> tuple[NDArray[np.float64], tuple[Slot, ...]]:
        slot = Slot(
            port=port, variable=variable, origin=grid[0], spacing=grid[1] - grid[0], values=values.copy()
        )
        return np.zeros(len(EFFECT_TABLE)), (slot,)

    step = np.full(len(grid), PORT_STEP[port])
    return Hypothesis(
        name=f"form {port}({variable})", effect_class="form", port=port, variable=variable,
        names=tuple(f"knot_{k + 1}" for k in range(len(grid))), units=(PORT_UNITS[port],) * len(grid),
        lower=-FORM_BOUND * step, upper=FORM_BOUND * step, step=step, start=start.copy(), build=build_slots,
    )  # fmt: skip


def make_form_hypotheses(
    port: str,
    variable: str,
    grid: NDArray[np.float64],
    values: NDArray[np.float64],
    errors: NDArray[np.float64],
) -> list[Hypothesis]:
    """Return the grammar's shapes that follow a spline best, as hypotheses for the simulation.

    Parameters
    ----------
    port, variable : port and variable of the spline
    grid : float64 [K] knots [unit of the variable]
    values, errors : float64 [K] of the spline, and standard deviations [unit of the port]
    """
    scale = float(np.max(np.abs(grid)))
    ranked = []
    for name, shape in SHAPES.items():
        basis = shape(grid / scale)
        coefficients, *_ = np.linalg.lstsq(basis / errors[:, None], values / errors, rcond=None)
        miss = (values - basis @ coefficients) / errors
        cost = float(miss @ miss) + basis.shape[1]
        ranked.append((cost, name, np.asarray(coefficients, dtype=np.float64)))
    ranked.sort(key=lambda entry: entry[0])
    return [
        _make_form_hypothesis(port, variable, grid, name, coefficients)
        for _, name, coefficients in ranked[:SHAPES_TRIED]
    ]


def make_form_in_range(name: str, coefficients: tuple[float, ...], low: float, high: float) -> Form:
    """Return a form that was found, constant beyond the range of its variable that the runs reached.

    Parameters
    ----------
    name : name of its hypothesis
    coefficients : a, or a and b [unit of the port]
    low, high : range that the runs reached, cut to the scanned range [unit of the variable]

    Raises
    ------
    InputError
        If no form of the grammar has that name.
    """
    port, variable, shape, scale = read_form_name(name)
    first = RANGE[variable][0] if RANGE[variable][0] >= 0.0 else -scale
    return Form(
        port=port, variable=variable, shape=shape, coefficients=coefficients, scale=scale, low=max(first, low),
        high=min(scale, high),
    )  # fmt: skip


def _make_form_hypothesis(
    port: str, variable: str, grid: NDArray[np.float64], name: str, start: NDArray[np.float64]
) -> Hypothesis:
    """Return one shape of the grammar as a hypothesis with broad bounds."""
    low, high, scale = float(grid[0]), float(grid[-1]), float(np.max(np.abs(grid)))

    def build_slots(values: NDArray[np.float64]) -> tuple[NDArray[np.float64], tuple[Slot, ...]]:
        form = Form(
            port=port, variable=variable, shape=name, coefficients=tuple(values.tolist()), scale=scale, low=low,
            high=high,
        )  # fmt: skip
        return np.zeros(len(EFFECT_TABLE)), (form.slot,)

    k = len(start)
    step = np.full(k, PORT_STEP[port])
    return Hypothesis(
        name=name_form(port, variable, name, scale), effect_class="form", port=port, variable=variable,
        names=("a", "b")[:k], units=(PORT_UNITS[port],) * k, lower=-FORM_BOUND * step, upper=FORM_BOUND * step,
        step=step, start=start.copy(), build=build_slots,
    )  # fmt: skip
