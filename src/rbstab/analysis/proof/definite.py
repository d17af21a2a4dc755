"""The matrices that must be positive definite in the theorems of proofs.md, checked exactly."""

from fractions import Fraction

from rbstab.analysis.exact import is_positive_definite
from rbstab.elements.rotational_stabilizer import RotationalStabilizer
from rbstab.elements.translational_stabilizer import TranslationalStabilizer
from rbstab.systems.system import System


def damps_every_motion(system: System) -> bool:
    """Return whether both stabilizers act.

    Their damping matrices are positive definite, so v' is zero only at rest. Other elements may
    damp all motions too, but that is not shown here.
    """
    kinds = {type(element) for element in system.elements}
    return {TranslationalStabilizer, RotationalStabilizer} <= kinds


def indefinite_parameter(system: System) -> str | None:
    """Return the name of a parameter that is not positive definite; None if all of them are.

    Checked are the mass, the inertia and each damping matrix. Then the kinetic energy is a norm of
    the velocities, and v' is zero only at rest. The stiffness of X and D is checked where these
    are eliminated (`reduced_energy`).

    Args:
        system: The system in rational numbers, or in doubles, which are taken as exact.
    """
    if not Fraction(system.body.mass) > 0:
        return "mass"
    if not is_positive_definite(system.body.inertia):
        return "inertia"
    for element in system.elements:
        for gain in element.gains:
            if gain.dissipates and not is_positive_definite(getattr(element, gain.name)):
                return gain.name
    return None
