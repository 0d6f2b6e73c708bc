"""Tyre forces in the sum of road and brake response, once a wheel has left the road."""

from collections.abc import Mapping

import numpy as np
from scipy.signal import lsim

from tasks.eval.physics.constants import DT, Constants, Floats


def sum_contact_changes(
    ticks: Mapping[str, Floats], moment: Floats, constants: Constants
) -> dict[str, Floats]:
    """Return by how much both tyres push the axles more than at rest, by axle, [N] each.

    The paper adds the responses to the road alone and to the brake's moment alone (Appendix B). Each has its own
    contact with the road, whose load is never negative: in the air the road's response has lost its load, and the
    moment's still pushes. Where neither lifts, the sum is that of one half-car.

    Parameters
    ----------
    ticks : columns of the tick table
    moment : pitch moment of the brake at each tick [N m]
    constants : car and pavement
    """
    braked = follow_moment(moment, constants)
    changes = {}
    for axle in "fr":
        static, stiffness = constants.static_load(axle), constants.car[f"tyre_stiffness_{axle}"]
        own = np.maximum(static - stiffness * braked[axle], 0.0)
        squeeze = ticks[f"road_height_{axle}"] - (ticks[f"unsprung_heave_{axle}"] - braked[axle])
        changes[axle] = np.maximum(static + stiffness * squeeze, 0.0) + own - 2.0 * static
    return changes


def follow_moment(moment: Floats, constants: Constants) -> dict[str, Floats]:
    """Return the heave of both axles on a level road under a moment that starts at rest, by axle, [N] each [m].

    Parameters
    ----------
    moment : at each tick, linear between ticks [N m]
    constants : car and pavement
    """
    car = constants.car
    mass, inertia = car["sprung_mass"], car["pitch_inertia"]
    # states: heave, pitch, both axles' heave, and their rates; a row of `stretch` is a strut's length
    stretch = np.array([[1.0, -car["cg_to_front_axle"], -1.0, 0.0], [1.0, car["cg_to_rear_axle"], 0.0, -1.0]])
    weights = np.array([mass, inertia, car["unsprung_mass_f"], car["unsprung_mass_r"]])
    springs = np.diag([car[f"suspension_stiffness_{axle}"] for axle in "fr"])
    dampers = np.diag([car[f"suspension_damping_{axle}"] for axle in "fr"])
    tyres = np.diag([0.0, 0.0, car["tyre_stiffness_f"], car["tyre_stiffness_r"]])
    A = np.zeros((8, 8))
    A[:4, 4:] = np.eye(4)
    A[4:, :4] = -(stretch.T @ springs @ stretch + tyres) / weights[:, None]
    A[4:, 4:] = -(stretch.T @ dampers @ stretch) / weights[:, None]
    B = np.zeros((8, 1))
    B[5] = 1.0 / inertia
    C = np.eye(8)[2:4]
    _, heave, _ = lsim((A, B, C, np.zeros((2, 1))), moment, DT * np.arange(len(moment)))
    return {"f": heave[:, 0], "r": heave[:, 1]}
