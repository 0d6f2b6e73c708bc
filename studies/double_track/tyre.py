"""The car's tyre: Pacejka's longitudinal Magic Formula, with a slip of its own memory."""

from math import atan, exp, sin

from numba import njit


@njit(error_model="numpy")
def magic_formula(slip: float, peak: float, stiffness: float, shape: float, curvature: float) -> float:
    """Force over load at a braking slip, odd in it [1] (Pacejka 2012, 4.E9, without shifts).

    Parameters
    ----------
    slip : kappa, positive in braking [1]
    peak : D over the load [1]
    stiffness : slope at zero slip over the load, B C D [1]
    shape, curvature : C and E [1]
    """
    if peak <= 0.0:
        return 0.0
    x = stiffness / (shape * peak) * slip
    return peak * sin(shape * atan(x - curvature * (x - atan(x))))


@njit(error_model="numpy")
def load_factor(load_ratio: float, exponent: float) -> float:
    """Factor on peak friction by load: a power law, as rubber on rough ground has it [1].

    Parameters
    ----------
    load_ratio : load over that at rest [1]
    exponent : friction falls with load to this power [1]
    """
    return max(load_ratio, 0.05) ** -exponent


@njit(error_model="numpy")
def stiffness_factor(load_ratio: float, pkx3: float) -> float:
    """Factor on slip stiffness over load (Pacejka 2012, 4.E15) [1].

    Parameters
    ----------
    load_ratio : load over that at rest [1]
    pkx3 : exponent [1]
    """
    return exp(pkx3 * (load_ratio - 1.0))


@njit(error_model="numpy")
def slip_rate(slip: float, speed: float, rim_speed: float, length: float, slow: float) -> float:
    """Rate of the slip that deforms the tyre [1/s] (Pacejka 2012, ch. 7: it relaxes with distance).

    Parameters
    ----------
    slip : now [1]
    speed : of the wheel's centre [m/s]
    rim_speed : radius times wheel speed [m/s]
    length : relaxation length [m]
    slow : least speed at which slip is forgotten [m/s]
    """
    return (speed - rim_speed - max(abs(speed), slow) * slip) / length
