"""The coupled model driven by a measured pressure trace: one time loop with every effect port open.

Half-car by the explicit midpoint rule, wheels linearly implicit in their own speed: stable at
any slip stiffness down to standstill, so the step follows the bandwidth of the data and not of the tyre.
"""

from math import cos, exp, log, pi, sin

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tasks.vehicle.effects.ports import (
    _AEROL,
    _AEROM,
    _BIAS,
    _BIASP,
    _DAMP,
    _DEAD,
    _DIVE,
    _ENG,
    _ENGV,
    _GAIN,
    _INERTIA,
    _LAG,
    _LIFT,
    _MASS,
    _MU,
    _PAD,
    _PITCH,
    _PUSH,
    _RADIUS,
    _RELAX,
    _SLIP,
    _SLOPE,
    _STIFF,
    LOOSE,
    brake_factor,
    friction_factor,
    resistance,
    slot_sum,
    strut_force,
)  # fmt: skip

OUTPUTS = (
    "speed", "acceleration", "wheel_speed_front", "wheel_speed_rear", "pitch", "pitch_rate", "heave_acceleration",
    "station",
)  # fmt: skip
N_STATES = 20
CONSTANTS = (
    "sprung_mass", "unsprung_mass_f", "unsprung_mass_r", "l_f", "l_r", "cg_height", "pitch_inertia",
    "spring_f", "spring_r", "damper_f", "damper_r", "tyre_stiffness_f", "tyre_stiffness_r", "radius",
    "wheel_inertia_f", "wheel_inertia_r", "torque_gain", "front_share", "gravity", "coast", "release_width",
    "slip_floor",
    "friction", "slip_scale", "pitch_scale", "c1", "c2", "c3",
    "disc_rise", "disc_capacity_f", "disc_capacity_r", "disc_cooling",
    "hazard_center", "hazard_length", "hazard_height", "direction", "snow_depth_mm", "wet",
)  # fmt: skip
"""Order of the constants of one run: vehicle, road state, run conditions."""


@njit(cache=True, nogil=True, inline="always")
def _road(station: float, center: float, length: float, height: float) -> tuple[float, float]:
    u = station - (center - 0.5 * length)
    if height == 0.0 or u < 0.0 or u > length:
        return 0.0, 0.0
    w = 2.0 * pi / length
    return 0.5 * height * (1.0 - cos(w * u)), 0.5 * height * w * sin(w * u)


@njit(cache=True, nogil=True, error_model="numpy", fastmath=LOOSE)
def drive(
    constants: NDArray[np.float64],
    theta: NDArray[np.float64],
    pressure: NDArray[np.float64],
    interval: float,
    substeps: int,
    first: int,
    count: int,
    states: NDArray[np.float64],
    keys: NDArray[np.int64],
    grids: NDArray[np.float64],
    tables: NDArray[np.float64],
    out: NDArray[np.float64],
) -> None:
    """Roll the car along the pressure trace from sample ``first``; fills ``out`` and ``states``.

    Parameters
    ----------
    constants : float64 [len(CONSTANTS)] vehicle, road state and conditions of the run [SI]
    theta : float64 [len(PARAMETERS)] effects; all 0 is the plain model
    pressure : float64 [N] measured brake pressure at the samples, linear between [MPa]
    interval : time between samples [s]
    substeps : integration steps between samples
    first, count : sample to start from and number of samples to fill
    states : float64 [N, N_STATES] row ``first`` is the start; the rows after it are filled
    keys, grids, tables : the slots (port and variable; origin and spacing; values)
    out : float64 [N, len(OUTPUTS)] rows ``first`` ... ``first + count - 1`` are filled
    """
    (ms, muf, mur, lf, lr, hcg, Iy, ksf, ksr, csf, csr, ktf, ktr, R, Iwf, Iwr, Kp, bf, g, coast, width, floor,
     mu_peak, beta, gamma, c1, c2, c3, _, Cf, Cr, cool, hc, hl, hh,
     direction, snow, wet) = constants  # fmt: skip
    ms = ms * (1.0 + theta[_MASS])
    R = R * (1.0 + theta[_RADIUS])
    Kp = Kp * (1.0 + theta[_GAIN])
    gamma = gamma * (1.0 + theta[_PITCH])
    csf = csf * (1.0 + theta[_DAMP])
    csr = csr * (1.0 + theta[_DAMP])
    ksf = ksf * (1.0 + theta[_STIFF])
    ksr = ksr * (1.0 + theta[_STIFF])
    mu_peak = mu_peak * (1.0 + theta[_MU])
    beta = beta * (1.0 + theta[_SLIP])
    Iwf = Iwf + theta[_INERTIA]
    Iwr = Iwr + theta[_INERTIA]
    L = lf + lr
    m = ms + muf + mur
    kappa_peak = log(c1 * c2 / c3) / c2
    b_max = c1 * (1.0 - exp(-c2 * kappa_peak)) - c3 * kappa_peak
    target = kappa_peak / beta
    F0f = ms * g * lr / L + muf * g
    F0r = ms * g * lf / L + mur * g
    dt = interval / substeps
    n = pressure.shape[0]
    slots = keys.shape[0]
    x = np.zeros(9)
    (v, s, wf, wr, z, th, zf, zr, dz, dth, dzf, dzr, p_line, Tf, Tr, kf, kr, Ef, Er, vd) = states[first]
    az = 0.0
    p_before = p_line
    for i in range(first, first + count):
        row = states[i]
        (row[0], row[1], row[2], row[3], row[4], row[5], row[6]) = (v, s, wf, wr, z, th, zf)
        (row[7], row[8], row[9], row[10], row[11], row[12]) = (zr, dz, dth, dzf, dzr, p_line)
        (row[13], row[14], row[15], row[16], row[17], row[18], row[19]) = (Tf, Tr, kf, kr, Ef, Er, vd)
        for j in range(substeps):
            u = i + (j + 1.0) / substeps - theta[_DEAD] / interval
            k = int(max(u, 0.0))
            p = (
                pressure[k]
                if k + 1 >= n
                else pressure[k] + (max(u, 0.0) - k) * (pressure[k + 1] - pressure[k])
            )
            p_line = p_line + (1.0 - exp(-dt / theta[_LAG])) * (p - p_line) if theta[_LAG] > 0.0 else p
            p_eff = max(p_line - theta[_PUSH], 0.0)

            zrf, slope_f = _road(s, hc, hl, hh)
            zrr, slope_r = _road(s - L, hc, hl, hh)
            Ftf = max(ktf * (zrf - zf), -F0f)
            Ftr = max(ktr * (zrr - zr), -F0r)
            lift = theta[_AEROL] * v * v
            Fzf = max(F0f + Ftf, 0.0)
            Fzr = max(F0r + Ftr, 0.0)
            df = z - zf - lf * th
            dr = z - zr + lr * th
            vf = dz - dzf - lf * dth
            vr = dz - dzr + lr * dth

            extra_x = extra_m = extra_sf = extra_sr = 0.0
            mu_f = mu_r = tb_f = tb_r = 1.0
            if slots > 0:
                x[0] = (i + (j + 0.5) / substeps) * interval
                x[1] = v
                x[2] = p_line
                x[4] = (p_line - p_before) / dt
                x[8] = -vd
                x[3], x[5], x[6], x[7] = Tf, Fzf / F0f, df, vf
                extra_x = slot_sum(0, x, keys, grids, tables)
                tb_f = 1.0 + slot_sum(1, x, keys, grids, tables)
                mu_f = 1.0 + slot_sum(2, x, keys, grids, tables)
                extra_m = slot_sum(3, x, keys, grids, tables)
                extra_sf = slot_sum(4, x, keys, grids, tables)
                x[3], x[5], x[6], x[7] = Tr, Fzr / F0r, dr, vr
                tb_r = 1.0 + slot_sum(1, x, keys, grids, tables)
                mu_r = 1.0 + slot_sum(2, x, keys, grids, tables)
                extra_sr = slot_sum(4, x, keys, grids, tables)
            p_before = p_line

            # wheels are implicit: torque, speed and slip all belong to the end of the step
            v_end = max(v + dt * vd, 0.0)
            vm = max(v_end, floor)
            share = bf + theta[_BIAS] + theta[_BIASP] * p_line
            sum_x = 0.0
            Fxf = Fxr = 0.0
            for a in range(2):
                if a == 0:
                    w, Fz, kl, part, T, E, F0, mu_x, tb, Iw = wf, Fzf, kf, share, Tf, Ef, F0f, mu_f, tb_f, Iwf
                else:
                    w, Fz, kl, part, T, E, F0, mu_x, tb, Iw = (
                        wr,
                        Fzr,
                        kr,
                        1.0 - share,
                        Tr,
                        Er,
                        F0r,
                        mu_r,
                        tb_r,
                        Iwr,
                    )
                mu = mu_peak * mu_x * friction_factor(theta, v, Fz / F0, E, wet)
                Tc = Kp * p_eff * part * brake_factor(theta, p_line, v, T) * tb
                drag = 0.0
                if w > 0.0:
                    drag = theta[_PAD] * part
                    if a == 0:
                        drag += theta[_ENG] + theta[_ENGV] * w
                follow = 1.0
                if theta[_RELAX] > 0.0:
                    follow = 1.0 - exp(-max(v, 0.5) * dt / theta[_RELAX])
                kappa = (v_end - R * w) / vm
                k_t = kl + follow * (kappa - kl) if theta[_RELAX] > 0.0 else kappa
                e2 = exp(-c2 * abs(k_t) * beta)
                Fx = mu / b_max * (c1 * (1.0 - e2) - c3 * abs(k_t) * beta) * Fz
                if k_t < 0.0:
                    Fx = -Fx
                dF = mu / b_max * (c1 * c2 * e2 - c3) * beta * Fz * follow
                q = (target * (1.0 + width) - kappa) / (width * target)
                dq = -1.0 / (width * target)
                if q >= 1.0:
                    q = 1.0
                    dq = 0.0
                elif q <= 0.0:
                    q = 0.0
                    dq = 0.0
                rate = (R * Fx - q * Tc - drag) / Iw
                slope = -(R * dF - dq * Tc) * R / vm / Iw
                w_new = max(w + (dt * rate / (1.0 - dt * slope) if slope < 0.0 else dt * rate), 0.0)
                kappa = (v_end - R * w_new) / vm
                k_t = kl + follow * (kappa - kl) if theta[_RELAX] > 0.0 else kappa
                Fx = mu / b_max * (c1 * (1.0 - exp(-c2 * abs(k_t) * beta)) - c3 * abs(k_t) * beta) * Fz
                if k_t < 0.0:
                    Fx = -Fx
                sum_x += Fx
                heat = q * Tc * w_new * dt
                slip_heat = abs(Fx * k_t) * v * dt
                if a == 0:
                    wf, kf, Fxf = w_new, k_t, Fx
                    Ef += slip_heat
                    Tf += (heat - cool * Tf * dt) / Cf
                else:
                    wr, kr, Fxr = w_new, k_t, Fx
                    Er += slip_heat
                    Tr += (heat - cool * Tr * dt) / Cr

            Fx_road = -Fzf * slope_f - Fzr * slope_r
            resist = resistance(theta, v, direction, m * g, snow) + extra_x
            vd_start = vd
            vd = (-sum_x + Fx_road - resist) / m - coast - g * theta[_SLOPE] * direction
            moment = gamma * ms * hcg * max(-vd, 0.0) + extra_m + theta[_AEROM] * v * v
            jack_f = extra_sf - theta[_DIVE] * Fxf * hcg / L
            jack_r = extra_sr + theta[_LIFT] * Fxr * hcg / L
            z0, th0, zf0, zr0, dz0, dth0, dzf0, dzr0 = z, th, zf, zr, dz, dth, dzf, dzr
            for stage in range(2):
                # explicit midpoint: the body's first-order phase error would outweigh the pitch-rate noise
                if stage == 1:
                    ahead = s + 0.5 * dt * v
                    Ftf = max(ktf * (_road(ahead, hc, hl, hh)[0] - zf), -F0f)
                    Ftr = max(ktr * (_road(ahead - L, hc, hl, hh)[0] - zr), -F0r)
                    df = z - zf - lf * th
                    dr = z - zr + lr * th
                    vf = dz - dzf - lf * dth
                    vr = dz - dzr + lr * dth
                Fsf = strut_force(theta, ksf, csf, df, vf) + jack_f
                Fsr = strut_force(theta, ksr, csr, dr, vr) + jack_r
                a_z = (-Fsf - Fsr + lift) / ms
                if stage == 0:
                    az = a_z
                step = 0.5 * dt if stage == 0 else dt
                z, th, zf, zr = z0 + step * dz, th0 + step * dth, zf0 + step * dzf, zr0 + step * dzr
                dz = dz0 + step * a_z
                dth = dth0 + step * (lf * Fsf - lr * Fsr + moment) / Iy
                dzf = dzf0 + step * (Fsf + Ftf) / muf
                dzr = dzr0 + step * (Fsr + Ftr) / mur
            s += dt * (v + 0.5 * dt * vd)
            v += 0.5 * dt * (vd_start + vd)
            if v <= 0.05:
                v, wf, wr, vd, kf, kr = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
            if j == 0:
                o = out[i]
                o[0], o[1], o[2], o[3], o[4], o[5], o[6], o[7] = (
                    row[0],
                    row[19],
                    row[2],
                    row[3],
                    row[5],
                    row[9],
                    az,
                    row[1],
                )
