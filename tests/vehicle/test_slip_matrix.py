"""The slip of a tyre with a relaxation length is eliminated from the implicit step: the dense system says the same."""

import numpy as np
import pytest

from tasks.vehicle.model.slip_matrix import AxleSlope, solve_slip
from tasks.vehicle.model.states import AxleMemory, Memory, Motion

STEP_GAMMA = 3e-4
AXLES = (
    {"by_speed": 0.04, "by_wheel": -0.012, "force": 55.0, "moment": 900.0, "lock": 4.0},
    {"by_speed": 0.03, "by_wheel": -0.013, "force": 40.0, "moment": 700.0, "lock": 0.0},
)
"""Change of the slip with speed and wheel speed, of dv/dt and of domega/dt with the slip, and of a locking wheel."""


def eliminated(axle: dict[str, float], rate: float) -> AxleSlope:
    share = 1.0 / (1.0 + STEP_GAMMA * rate) if rate else 0.0
    pushed = STEP_GAMMA * share
    follows = pushed * rate if rate else 1.0
    force, moment = axle["force"], axle["moment"]
    return AxleSlope(
        -force * follows * axle["by_speed"], -force * follows * axle["by_wheel"], moment * follows * axle["by_speed"],
        moment * follows * axle["by_wheel"] - axle["lock"], -force * pushed, moment * pushed,
        follows * axle["by_speed"], follows * axle["by_wheel"], share,
    )  # fmt: skip


@pytest.mark.parametrize("rate", [40.0, 2000.0])
def test_the_eliminated_slip_solves_the_dense_system(rate: float) -> None:
    jacobian = np.zeros((5, 5))  # speed, wheel speeds, slips
    for i, axle in enumerate(AXLES):
        wheel, slip = 1 + i, 3 + i
        jacobian[0, slip], jacobian[wheel, slip] = -axle["force"], axle["moment"]
        jacobian[wheel, wheel] = -axle["lock"]
        jacobian[slip, [0, wheel, slip]] = rate * np.array([axle["by_speed"], axle["by_wheel"], -1.0])
    given = np.array([-7.0, -30.0, -25.0, 1.5, 0.8])
    wanted = np.linalg.solve(np.eye(5) - STEP_GAMMA * jacobian, given)
    motion, memory = solve_slip(
        Motion(17.0, *given[:3]), Memory(AxleMemory(given[3], 9.0, 2.0), AxleMemory(given[4], 8.0, 1.0)),
        eliminated(AXLES[0], rate), eliminated(AXLES[1], rate), STEP_GAMMA,
    )  # fmt: skip
    assert motion.station == 17.0 and (memory.front.slip_heat, memory.rear.disc_rise) == (9.0, 1.0)
    found = [motion.speed, motion.omega_f, motion.omega_r, memory.front.slip, memory.rear.slip]
    np.testing.assert_allclose(found, wanted, rtol=1e-12)


def test_without_a_relaxation_length_only_speed_and_wheels_are_coupled() -> None:
    jacobian = np.zeros((3, 3))
    for i, axle in enumerate(AXLES):
        by = np.array([axle["by_speed"], axle["by_wheel"]])
        jacobian[0, [0, 1 + i]] -= axle["force"] * by
        jacobian[1 + i, [0, 1 + i]] += axle["moment"] * by
        jacobian[1 + i, 1 + i] -= axle["lock"]
    given = np.array([-7.0, -30.0, -25.0])
    wanted = np.linalg.solve(np.eye(3) - STEP_GAMMA * jacobian, given)
    memory = Memory(AxleMemory(0.0, 9.0, 2.0), AxleMemory(0.0, 8.0, 1.0))
    slopes = [eliminated(axle, 0.0)._replace(speed_by_slip=0.0, wheel_by_slip=0.0) for axle in AXLES]
    motion, after = solve_slip(Motion(17.0, *given), memory, *slopes, STEP_GAMMA)
    np.testing.assert_allclose([motion.speed, motion.omega_f, motion.omega_r], wanted, rtol=1e-12)
    assert after == memory
