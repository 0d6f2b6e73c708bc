"""The implicit step of a wheel, where the explicit one is too long (paper, Eq. app_longitudinal_complete).

Slip answers to the wheel speed within I_w v / (R^2 dF_x/dkappa), which falls with the speed to less than the published
step. Explicit steps then throw the slip from one side of its target to the other. The implicit step solves the same
equation with slip, tyre force and ABS of its own end, across the edges of the release band, and follows the target.
"""

from numba import njit

from tasks.vehicle.brake import PressureProfile, compute_abs_command, limit_abs_rate
from tasks.vehicle.paper.wheels import Axle, AxleStep, Wheels, compute_transferred_loads
from tasks.vehicle.tyres.contract import Tyre, compute_tyre_friction, compute_tyre_slope

MOST_ITERATIONS = 60
"""Newton steps, each of which at least halves the bracket where it leaves it; two or three are usual [1]."""
SLIP_TOLERANCE = 1e-10
"""Last Newton step of the slip [1]; the error that it leaves is of the order of its square."""


def find_implicit_speed(
    wheels: Wheels, tyre: Tyre, profile: PressureProfile, step: float, explicit_limit: float, gravity: float
) -> float:
    """Return the speed below which an explicit step is longer than a share of a wheel's time constant [m/s].

    The time constant is the shorter of two: of the steepest tyre curve under full load transfer, and of the ABS in its
    release band, where the tyre's curve has passed its peak.

    Parameters
    ----------
    wheels, tyre, profile : the vehicle on its surface, and its brake command
    step : length of the step [s]
    explicit_limit : longest explicit step in time constants [1]
    gravity : g [m/s2]
    """
    speeds = []
    for axle, load in zip(
        (wheels.front, wheels.rear), compute_transferred_loads(-tyre.peak * gravity, wheels), strict=True
    ):
        most = max(load, axle.static_load)
        grip = wheels.radius * compute_tyre_slope(0.0, most, tyre) * most
        release = axle.brake_gain * profile.peak / (wheels.release_width * tyre.target_slip)
        speeds.append(step * wheels.radius * max(grip, release) / (axle.inertia * explicit_limit))
    return max(*speeds, wheels.speed_floor)


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def solve_wheel_speed(
    omega: float,
    speed: float,
    load: float,
    pressure: float,
    before: AxleStep,
    step: float,
    axle: Axle,
    wheels: Wheels,
    tyre: Tyre,
) -> float:
    """Return the wheel speed after an implicit Euler step [rad/s].

    The unknown is the slip at the end of the step, not clipped; its residual falls strictly, so the root is the only
    one, and Newton's steps are kept inside a bracket.

    Parameters
    ----------
    omega : wheel speed before the step [rad/s]
    speed : v after the step [m/s]
    load : load of the axle [N]
    pressure : brake pressure [MPa]
    before : the axle before the step
    step : length of the step [s]
    axle, wheels, tyre : the axle's wheels, the vehicle's longitudinal values, its tyre on the surface
    """
    full = axle.brake_gain * pressure
    gain = step / axle.inertia
    per_slip = max(speed, wheels.speed_floor) / wheels.radius
    per_scale = gain * full / (wheels.release_width * tyre.target_slip)
    free = speed / wheels.radius - omega
    # between full torque without grip, and twice the peak's grip without torque
    low = (free - gain * wheels.radius * 2.0 * tyre.peak * load) / per_slip
    high = (free + gain * full) / per_slip
    slip, force, scale = before.slip, before.force, before.scale
    wanted = compute_abs_command(slip, tyre.target_slip, wheels.release_width)
    for _ in range(MOST_ITERATIONS):
        residual = free - slip * per_slip - gain * (wheels.radius * force - scale * full)
        if residual > 0.0:
            low = max(low, slip)
        else:
            high = min(high, slip)
        slope = per_slip
        if 0.0 <= slip < 1.0:
            slope += gain * wheels.radius * compute_tyre_slope(slip, load, tyre) * load
            if 0.0 < wanted < 1.0 and scale == wanted:
                slope += per_scale
        following = slip + residual / slope if slope > 0.0 else low - 1.0
        if not low <= following <= high:
            following = 0.5 * (low + high)
        change = abs(following - slip)
        slip = following
        if change < SLIP_TOLERANCE:
            break
        felt = min(max(slip, 0.0), 1.0)
        wanted = compute_abs_command(felt, tyre.target_slip, wheels.release_width)
        scale = limit_abs_rate(wanted, before.scale, wheels.build_rate * step, wheels.release_rate * step)
        force = compute_tyre_friction(felt, load, tyre) * load
    return speed / wheels.radius - slip * per_slip
