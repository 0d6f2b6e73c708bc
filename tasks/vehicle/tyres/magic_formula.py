"""The Magic Formula: tyre forces of longitudinal, lateral and combined slip, in steady state and without turn slip.

Equations and numbers (4.E1 to 4.E67) are those of Pacejka, Tire and Vehicle Dynamics, 3rd ed. 2012, chapter 4.3.2
(doi:10.1016/C2010-0-68548-8), which MF-Tyre 6.1 and 6.2 share. Coefficients keep the names of a tyre property file,
in small letters; every scaling factor and the inflation pressure are already folded into them (``scaling.py``).
Signs are the book's: a driving slip and its force are positive, and a positive slip angle gives a negative side force.
"""

from math import atan, copysign, cos, exp, sin, tan
from typing import NamedTuple

from numba import njit
from numba.extending import register_jitable


class Longitudinal(NamedTuple):
    """Coefficients of the longitudinal force in pure slip [1]: shape, peak, curvature, stiffness and shifts."""

    pcx1: float
    pdx1: float
    pdx2: float
    pdx3: float
    pex1: float
    pex2: float
    pex3: float
    pex4: float
    pkx1: float
    pkx2: float
    pkx3: float
    phx1: float
    phx2: float
    pvx1: float
    pvx2: float


class Lateral(NamedTuple):
    """Coefficients of the lateral force in pure slip [1]: shape, peak, curvature, stiffness and shifts.

    ``shift_by_stiffness`` is 1 where camber shifts the curve by its own stiffness, pky6 and pky7 (MF 6.1), and 0 where
    it does so by phy3 (MF 5.2).
    """

    pcy1: float
    pdy1: float
    pdy2: float
    pdy3: float
    pey1: float
    pey2: float
    pey3: float
    pey4: float
    pey5: float
    pky1: float
    pky2: float
    pky3: float
    pky4: float
    pky5: float
    pky6: float
    pky7: float
    phy1: float
    phy2: float
    phy3: float
    pvy1: float
    pvy2: float
    pvy3: float
    pvy4: float
    shift_by_stiffness: float


class Combined(NamedTuple):
    """Coefficients that weigh either force by the other slip [1]."""

    rbx1: float
    rbx2: float
    rbx3: float
    rcx1: float
    rex1: float
    rex2: float
    rhx1: float
    rby1: float
    rby2: float
    rby3: float
    rby4: float
    rcy1: float
    rey1: float
    rey2: float
    rhy1: float
    rhy2: float
    rvy1: float
    rvy2: float
    rvy3: float
    rvy4: float
    rvy5: float
    rvy6: float


class MagicFormula(NamedTuple):
    """Coefficients of one tyre.

    Parameters
    ----------
    nominal_load : scaled nominal load of one tyre, F_z0' [N]
    longitudinal, lateral, combined : coefficients
    """

    nominal_load: float
    longitudinal: Longitudinal
    lateral: Lateral
    combined: Combined


@register_jitable(cache=True, error_model="numpy")
def bend_slip(scaled_slip: float, curvature: float) -> float:
    """Return the slip that the arctangent of the Magic Formula takes, B x - E (B x - atan B x) [1].

    Parameters
    ----------
    scaled_slip : B x [1]
    curvature : E; held to at most 1, above which the curve would fold back [1]
    """
    return scaled_slip - min(curvature, 1.0) * (scaled_slip - atan(scaled_slip))


@register_jitable(cache=True, error_model="numpy")
def compute_load_change(load: float, nominal_load: float) -> float:
    """Return df_z, how far a load exceeds the nominal one, relative to it [1] (4.E2).

    Parameters
    ----------
    load, nominal_load : both of one tyre, or both of an axle [N]
    """
    return (load - nominal_load) / nominal_load


@njit(cache=True, nogil=True, error_model="numpy")
def compute_longitudinal_peak(load_change: float, camber: float, c: Longitudinal) -> float:
    """Return the peak friction mu_x [1] (4.E13).

    Parameters
    ----------
    load_change : df_z [1]
    camber : gamma [rad]
    c : coefficients
    """
    return (c.pdx1 + c.pdx2 * load_change) * (1.0 - c.pdx3 * camber * camber)


@register_jitable(cache=True, error_model="numpy")
def compute_longitudinal_curvature(load_change: float, slip: float, c: Longitudinal) -> float:
    """Return E_x, which can differ between driving and braking [1] (4.E14).

    Parameters
    ----------
    load_change : df_z [1]
    slip : kappa_x, of which the sign counts [1]
    c : coefficients
    """
    bent = c.pex1 + load_change * (c.pex2 + load_change * c.pex3)
    return bent * (1.0 - c.pex4 * copysign(1.0, slip))


@njit(cache=True, nogil=True, error_model="numpy")
def compute_longitudinal_stiffness(load_change: float, c: Longitudinal) -> float:
    """Return slip stiffness over load, K_x / F_z [1] (4.E15).

    Parameters
    ----------
    load_change : df_z [1]
    c : coefficients
    """
    return (c.pkx1 + c.pkx2 * load_change) * exp(c.pkx3 * load_change)


@register_jitable(cache=True, error_model="numpy")
def compute_longitudinal_friction(slip: float, load_change: float, camber: float, c: Longitudinal) -> float:
    """Return force over load in pure longitudinal slip, F_x0 / F_z [1] (4.E9 to 4.E18).

    Parameters
    ----------
    slip : kappa, positive where the wheel drives [1]
    load_change : df_z [1]
    camber : gamma [rad]
    c : coefficients
    """
    x = slip + c.phx1 + c.phx2 * load_change
    peak = compute_longitudinal_peak(load_change, camber, c)
    scaled = compute_longitudinal_stiffness(load_change, c) / (c.pcx1 * peak) * x
    bent = bend_slip(scaled, compute_longitudinal_curvature(load_change, x, c))
    return peak * sin(c.pcx1 * atan(bent)) + c.pvx1 + c.pvx2 * load_change


@register_jitable(cache=True, error_model="numpy")
def compute_lateral_peak(load_change: float, camber: float, c: Lateral) -> float:
    """Return the peak friction mu_y; negative in the book's signs [1] (4.E23).

    Parameters
    ----------
    load_change : df_z [1]
    camber : gamma*, its sine [1]
    c : coefficients
    """
    return (c.pdy1 + c.pdy2 * load_change) * (1.0 - c.pdy3 * camber * camber)


@register_jitable(cache=True, error_model="numpy")
def compute_lateral_stiffness(load_change: float, camber: float, c: Lateral) -> float:
    """Return cornering stiffness over load, K_y / F_z; negative in the book's signs [1] (4.E25).

    Parameters
    ----------
    load_change : df_z, above -1 [1]
    camber : gamma*, its sine [1]
    c : coefficients
    """
    load_ratio = 1.0 + load_change
    turn = sin(c.pky4 * atan(load_ratio / (c.pky2 + c.pky5 * camber * camber)))
    return c.pky1 * (1.0 - c.pky3 * abs(camber)) * turn / load_ratio


@register_jitable(cache=True, error_model="numpy")
def compute_lateral_friction(slip: float, load_change: float, camber: float, c: Lateral) -> float:
    """Return force over load in pure lateral slip, F_y0 / F_z [1] (4.E19 to 4.E30).

    Parameters
    ----------
    slip : alpha*, tangent of the slip angle [1]
    load_change : df_z, above -1 [1]
    camber : gamma*, its sine [1]
    c : coefficients
    """
    stiffness = compute_lateral_stiffness(load_change, camber, c)
    from_camber = (c.pvy3 + c.pvy4 * load_change) * camber
    lean = (c.pky6 + c.pky7 * load_change) * camber - from_camber
    shift = c.phy1 + c.phy2 * load_change + c.phy3 * camber + c.shift_by_stiffness * lean / stiffness
    x = slip + shift
    peak = compute_lateral_peak(load_change, camber, c)
    side = (c.pey3 + c.pey4 * camber) * copysign(1.0, x)
    curvature = (c.pey1 + c.pey2 * load_change) * (1.0 + c.pey5 * camber * camber - side)
    bent = bend_slip(stiffness / (c.pcy1 * peak) * x, curvature)
    return peak * sin(c.pcy1 * atan(bent)) + c.pvy1 + c.pvy2 * load_change + from_camber


@register_jitable(cache=True, error_model="numpy")
def weigh_slip(slip: float, shift: float, narrowness: float, shape: float, curvature: float) -> float:
    """Return the weight G that a force keeps under the other slip, 1 without that slip [1] (4.E51, 4.E59).

    Parameters
    ----------
    slip : the other slip [1]
    shift : S_H of the hill [1]
    narrowness : B [1]
    shape : C [1]
    curvature : E [1]
    """
    hill = cos(shape * atan(bend_slip(narrowness * (slip + shift), curvature)))
    return hill / cos(shape * atan(bend_slip(narrowness * shift, curvature)))


@njit(cache=True, nogil=True, error_model="numpy")
def compute_tyre_forces(
    slip: float, slip_angle: float, camber: float, load: float, tyre: MagicFormula
) -> tuple[float, float]:
    """Return longitudinal and lateral force in combined slip, F_x and F_y [N] (4.E50 to 4.E67).

    Parameters
    ----------
    slip : kappa, positive where the wheel drives [1]
    slip_angle : alpha [rad]
    camber : gamma [rad]
    load : load on the tyre; without load there is no force [N]
    tyre : coefficients of the tyre
    """
    if load <= 0.0:
        return 0.0, 0.0
    c, load_change = tyre.combined, compute_load_change(load, tyre.nominal_load)
    angle, lean = tan(slip_angle), sin(camber)
    narrow_x = (c.rbx1 + c.rbx3 * lean * lean) * cos(atan(c.rbx2 * slip))
    weight_x = weigh_slip(angle, c.rhx1, narrow_x, c.rcx1, c.rex1 + c.rex2 * load_change)
    narrow_y = (c.rby1 + c.rby4 * lean * lean) * cos(atan(c.rby2 * (angle - c.rby3)))
    shift_y = c.rhy1 + c.rhy2 * load_change
    weight_y = weigh_slip(slip, shift_y, narrow_y, c.rcy1, c.rey1 + c.rey2 * load_change)
    steer = compute_lateral_peak(load_change, lean, tyre.lateral) * (
        c.rvy1 + c.rvy2 * load_change + c.rvy3 * lean
    )
    steer *= cos(atan(c.rvy4 * angle)) * sin(c.rvy5 * atan(c.rvy6 * slip))
    return (
        load * weight_x * compute_longitudinal_friction(slip, load_change, camber, tyre.longitudinal),
        load * (weight_y * compute_lateral_friction(angle, load_change, lean, tyre.lateral) + steer),
    )
