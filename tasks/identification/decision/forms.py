"""Forms outside the library: splines of the residual over pairs of port and variable, and simple shapes for them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import ceil

import numpy as np
from numpy.typing import NDArray

from tasks.campaign.campaign import CHANNELS
from tasks.identification.decision.screening import compute_inflation
from tasks.identification.inference.campaign_evidence import Evidence
from tasks.identification.inference.evidence import RunEvidence
from tasks.identification.inference.fit import Fit
from tasks.identification.inference.forward import predict_channels
from tasks.identification.inference.hypothesis import Hypothesis
from tasks.identification.inference.noise import rewhiten_channels, whiten_channels
from tasks.vehicle.effects.forms import SHAPES, Form, name_form, read_form_name
from tasks.vehicle.effects.ports import PORT_UNITS
from tasks.vehicle.effects.slots import Slot
from tasks.vehicle.effects.table import EFFECT_TABLE

KNOTS = 5
PORT_STEP = {
    "longitudinal_force": 30.0,
    "brake_torque": 0.02,
    "friction": 0.02,
    "pitch_moment": 60.0,
    "suspension_force": 40.0,
}
"""Size of a form that matters at each port, for derivatives [unit of the port]."""
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
SHAPES_TRIED = 2
"""Shapes of the grammar that are fitted through the simulation for a spline [1]."""


@dataclass(frozen=True, kw_only=True)
class ResidualSpline:
    """A spline of one variable at one port, fitted linearly to the residual of a fit.

    Parameters
    ----------
    port, variable : port and variable of the spline
    grid : float64 [K] knots [unit of the variable]
    values : float64 [K] [unit of the port]
    covariance : float64 [K, K] [unit of the port squared]
    gain : rise of the log likelihood, divided by the inflation [1]
    score : gain less K log N [1]
    """

    port: str
    variable: str
    grid: NDArray[np.float64]
    values: NDArray[np.float64]
    covariance: NDArray[np.float64]
    gain: float
    score: float


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


def fit_residual_splines(
    evidence: Evidence, at: Fit, splines: tuple[NDArray[np.float64], ...] | None = None
) -> list[ResidualSpline]:
    """Fit a spline at every scanned port and variable to the residuals of ``at``; best first.

    Parameters
    ----------
    evidence : the runs
    at : fit whose residuals are used
    splines : `differentiate_by_splines` at the fit; None if not computed yet
    """
    size, n_session = KNOTS * len(KEYS), len(evidence.session_sigma)
    gram, cross, right = np.zeros((size, size)), np.zeros((size, n_session)), np.zeros(size)
    session = np.diag(1.0 / np.square(evidence.session_sigma))
    pull = -at.session / np.square(evidence.session_sigma)
    slopes = differentiate_by_splines(evidence, at) if splines is None else splines
    for run, r, columns in zip(evidence.train, at.residuals, slopes, strict=True):
        q, qr = run.project_on_nuisances(columns), run.project_on_nuisances(r)
        gram += columns.T @ columns - q.T @ q
        cross += columns.T @ run.session - q.T @ run.session_q
        session += run.session.T @ run.session - run.session_q.T @ run.session_q
        right += columns.T @ r - q.T @ qr
        pull = pull + run.session.T @ r - run.session_q.T @ qr
    inverse = np.linalg.inv(session)
    gram -= cross @ inverse @ cross.T
    right = right - cross @ inverse @ pull
    level = compute_inflation(evidence, at, None)
    ranges, found = find_scanned_ranges(evidence.train), []
    for i, (port, variable) in enumerate(KEYS):
        block = slice(KNOTS * i, KNOTS * (i + 1))
        covariance = np.asarray(np.linalg.inv(gram[block, block] + np.diag(RIDGE[block])), dtype=np.float64)
        values = covariance @ right[block]
        gain = 0.5 * float(values @ right[block]) / level
        found.append(
            ResidualSpline(
                port=port,
                variable=variable,
                grid=np.linspace(*ranges[variable], KNOTS),
                values=values,
                covariance=level * covariance,
                gain=gain,
                score=gain - KNOTS * float(np.log(evidence.samples)),
            )
        )
    return sorted(found, key=lambda leftover: -leftover.score)


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
    """Return the whitened derivatives of one run by all knots, float64 [M, K]."""
    y = predict_channels(run.model, theta, slots=slots)
    columns = []
    for port, variable in KEYS:
        low, high = ranges[variable]
        for k in range(KNOTS):
            hat = np.zeros(KNOTS)
            hat[k] = PORT_STEP[port]
            extra = Slot(
                port=port, variable=variable, origin=low, spacing=(high - low) / (KNOTS - 1), values=hat
            )
            moved = predict_channels(run.model, theta, slots=(*slots, extra))
            columns.append((moved - y) / PORT_STEP[port])
    return whiten_channels(np.stack(columns, axis=-1), run.rho, run.sigma, run.model.sampled)


def make_form_hypotheses(leftover: ResidualSpline, samples: int) -> list[Hypothesis]:
    """Return the grammar's shapes that fit a spline best, as hypotheses for the simulation.

    Parameters
    ----------
    leftover : spline of the residual
    samples : N of the score's penalty
    """
    scale = float(np.max(np.abs(leftover.grid)))
    precision = np.linalg.inv(leftover.covariance)
    ranked = []
    for name, shape in SHAPES.items():
        basis = shape(leftover.grid / scale)
        normal = basis.T @ precision @ basis
        coefficients = np.linalg.solve(normal, basis.T @ precision @ leftover.values)
        miss = leftover.values - basis @ coefficients
        cost = 0.5 * float(miss @ precision @ miss) + basis.shape[1] * np.log(samples)
        ranked.append((cost, name, np.asarray(coefficients, dtype=np.float64)))
    ranked.sort(key=lambda entry: entry[0])
    return [
        _make_form_hypothesis(leftover, name, coefficients, scale)
        for _, name, coefficients in ranked[:SHAPES_TRIED]
    ]


def sample_form(form: Hypothesis) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return a form at its first values: its variable and its value at the port, float64 [TABLE] each.

    Parameters
    ----------
    form : hypothesis of `make_form_hypotheses`
    """
    (slot,) = form.build(form.start)[1]
    return slot.origin + slot.spacing * np.arange(len(slot.values), dtype=np.float64), slot.values


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


def is_session_number(form: Hypothesis) -> bool:
    """Return whether a form is a number that every session may be off by: damping, stiffness or brake gain.

    Parameters
    ----------
    form : hypothesis of `make_form_hypotheses`
    """
    x, y = sample_form(form)
    line = bool(np.allclose(y, np.interp(0.0, x, y) + (y[-1] - y[0]) / (x[-1] - x[0]) * x))
    if form.port == "brake_torque":
        return is_constant(form)
    return form.port == "suspension_force" and line and abs(float(np.interp(0.0, x, y))) < 1e-9


def is_constant(form: Hypothesis) -> bool:
    """Return whether a form does not depend on its variable.

    Parameters
    ----------
    form : hypothesis of `make_form_hypotheses`
    """
    return bool(np.ptp(sample_form(form)[1]) == 0.0)


def _make_form_hypothesis(
    leftover: ResidualSpline, name: str, start: NDArray[np.float64], scale: float
) -> Hypothesis:
    """Return one shape of the grammar as a hypothesis with broad bounds."""
    port, variable = leftover.port, leftover.variable
    low, high = float(leftover.grid[0]), float(leftover.grid[-1])

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
        names=("a", "b")[:k], units=(PORT_UNITS[port],) * k, lower=-100.0 * step, upper=100.0 * step,
        step=step, start=start.copy(), build=build_slots,
    )  # fmt: skip
