"""The stiff part of a step: the eliminated slip solves the dense system, the anti-lock band is seen ahead."""

import numpy as np
import pytest

from tasks.vehicle.effects.grown import apply_effects
from tasks.vehicle.model.axle_ports import AxlePorts
from tasks.vehicle.model.chassis import Conditions, build_chassis
from tasks.vehicle.model.slip_matrix import AxleSlope, compute_axle_slope, solve_slip
from tasks.vehicle.model.states import AxleMemory, Memory, Motion
from tasks.vehicle.model.vertical_ports import Ground
from tasks.vehicle.parameters import compute_surface_response

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


@pytest.mark.parametrize(
    ("slip", "torque", "cut_off", "counts"),
    [
        (0.5, 9000.0, 0.0, True),  # below the band, and the brake carries the wheel into it
        (0.5, 2500.0, 0.0, False),  # below, and it stays below
        (1.1, 2500.0, 0.0, True),  # inside
        (1.3, 0.0, 0.0, True),  # above, and the tyre turns the wheel back into it
        (1.3, 9000.0, 0.0, False),  # above, and away from it
        (0.5, 9000.0, 30.0, False),  # slower than the anti-lock brake works
    ],
)
def test_the_anti_lock_brake_counts_where_a_step_can_reach_its_band(vehicle, slip, torque, cut_off, counts):
    """Beside the same wheel without pressure, the brake's slope slows the wheel down, or is not there."""
    car = apply_effects(vehicle, {"abs_cutoff": cut_off})
    surface = compute_surface_response(car, "dry", 0.82)
    chassis, load, speed = build_chassis(car, surface, Conditions()), 7000.0, 20.0
    kappa = slip * surface.tyre.target_slip
    ports, released = (
        AxlePorts(
            Ground(0.0, 0.0, load),
            kappa,
            kappa,
            0.8 * load,
            1.0,
            full,
            torque,
            0.0,
            0.0,
            car.wheel_radius,
            0.0,
        )
        for full in (9000.0, 0.0)
    )
    omega = (1.0 - kappa) * speed / car.wheel_radius
    motion = Motion(0.0, speed, omega, omega)
    pressed, free = (
        compute_axle_slope(p, motion, omega, 0.002, chassis.wheels.front, chassis, surface.tyre)
        for p in (ports, released)
    )
    assert (pressed.wheel_by_wheel < free.wheel_by_wheel) == counts
    assert (pressed == free) != counts
