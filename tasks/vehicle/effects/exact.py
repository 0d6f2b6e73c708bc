"""The port functions as datasets need them: compiled without the freedoms that move last digits.

One source serves both: the closure's fits take the fast ones of ``ports``, coupled mode these, whose bits do not
depend on what a processor can fuse. They are not cached by themselves, for Numba would take one for the other.
"""

from numba import njit

from tasks.vehicle.effects import ports

brake_factor = njit(nogil=True, inline="always")(ports.brake_factor.py_func)
friction_factor = njit(nogil=True, inline="always")(ports.friction_factor.py_func)
resistance = njit(nogil=True, inline="always")(ports.resistance.py_func)
slot_sum = njit(nogil=True, inline="always")(ports.slot_sum.py_func)
strut_force = njit(nogil=True, inline="always")(ports.strut_force.py_func)
