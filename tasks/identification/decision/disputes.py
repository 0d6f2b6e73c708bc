"""Names about which the runs disagree: a car whose equations are not the model's, or a name to take back."""

from tasks.identification.decision.attribution import compute_own_inflation
from tasks.identification.decision.search import SearchState
from tasks.identification.decision.superseded import leave_out
from tasks.identification.inference.hypothesis import Hypothesis

PORT_OF_NUMBER = {
    "pressure_gain": "brake_torque", "mass": "longitudinal_force", "slope": "longitudinal_force",
    "pitch_gain": "pitch_moment", "damping": "suspension_force", "stiffness": "suspension_force",
}  # fmt: skip
"""Where a wrong number of the session acts: a form there may stand behind it."""
BODY_PORTS = ("pitch_moment", "suspension_force")
"""Ports that move the body and hardly the car."""
BODY_INSTRUMENTS = ("pitch", "pitch_rate", "vertical")
"""Variables of sensor errors that only the body's motion shows."""


class ForeignCarError(Exception):
    """The model's equations do not fit the car, even with the best effects; its text says by how much."""


def settle_disputes(found: SearchState, reasons: list[str]) -> SearchState:
    """Return the search without names of the body's motion about which the runs disagree.

    The joint fit judges a car whose runs disagree, but knows the motion along the road alone.

    Parameters
    ----------
    found : what is named
    reasons : list to which sentences are appended

    Raises
    ------
    ForeignCarError
        If the runs disagree so much about a name of the motion along the road that the car's equations are not the
        model's.
    """
    evidence = found.evidence
    for i, part in enumerate(found.base.parts):
        inflation = compute_own_inflation(evidence, found.base, part)
        if inflation > evidence.rules.disputed_inflation:
            if not moves_body_alone(part):
                raise ForeignCarError(
                    f"the runs disagree about {part.name} by a factor of {inflation:.1f} (a name needs at most"
                    f" {evidence.rules.disputed_inflation:g})"
                )
            reasons.append(
                f"{part.name} would fit, but the runs disagree about it by a factor of {inflation:.1f} (a name needs at"
                f" most {evidence.rules.disputed_inflation:g}): not named"
            )
            return settle_disputes(leave_out(found, i), reasons)
    return found


def moves_body_alone(named: Hypothesis) -> bool:
    """Return whether a name acts on the body's heave and pitch or on their instruments, and not along the road.

    Parameters
    ----------
    named : effect, number or form
    """
    port = PORT_OF_NUMBER.get(named.names[0], named.port)
    return port in BODY_PORTS or (port == "sensor" and named.variable in BODY_INSTRUMENTS)
