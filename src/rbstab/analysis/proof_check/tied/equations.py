"""Compare the energy W of a proof with the equations of a system, at some points.

As in `equations`, values of the stored energy in balls are all that is used. W counts z from X*(Θ).
With formulas of users, X*(Θ) is part of W. Else it follows from a line: its end is X + A p - anchor
by the equations, and z + r(Θ) by W.
"""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from flint import arb

from rbstab.analysis.configuration import Configurations, configurations
from rbstab.analysis.exact import decimal_balls, in_balls
from rbstab.analysis.proof_check.equations import POINTS, SHIFTS, agree, least_energy
from rbstab.analysis.proof_check.tied.energy import Pose
from rbstab.analysis.proof_check.tied.extent import BoundedEnergy
from rbstab.elements.spring import Spring
from rbstab.mechanics import point
from rbstab.mechanics.numbers import Array
from rbstab.systems.system import System


def agrees_with_tied_equations(
    energy: Mapping[str, Any], exact_system: Callable[[Callable[[Array], Array]], System]
) -> bool:
    """Return whether W has the values that follow from the equations.

    Args:
        energy: `tied_energy` of a proof.
        exact_system: Builds the system in a kind of number from the doubles of its config.
    """

    def compare() -> bool:
        W, at_rest = BoundedEnergy(energy), configurations(exact_system(decimal_balls))
        if W.formulas:
            return _agrees(W, at_rest, None)
        springs = [one for one in at_rest.system.elements if isinstance(one, Spring)]
        # Springs at the same points share a line, so it is not known which of them has the first.
        return any(_agrees(W, at_rest, spring) for spring in springs)

    return bool(in_balls(compare))


def _agrees(W: BoundedEnergy, at_rest: Configurations, spring: Spring | None) -> bool:
    """Return whether W agrees; if a spring is given, its line is the first one of W."""
    for Theta in POINTS:
        angles = [arb(angle) for angle in Theta]
        pose = Pose(W, tuple((angle, angle) for angle in Theta))
        unloaded = [one[0] for one in pose.offset(len(W.lines) + len(W.ligaments), "centre")]
        if spring is not None:
            own = at_rest.size - at_rest.pose_size
            q = np.array([*angles, *[arb(0)] * (3 + own)], dtype=object)
            end = point.position(at_rest.motion(q), spring.point) - spring.anchor
            unloaded = [r[0] - one for r, one in zip(pose.offset(0, "centre"), end, strict=True)]
        for shift in SHIFTS:
            z = [arb(entry) for entry in shift]
            X = [one + other for one, other in zip(unloaded, z, strict=True)]
            if not agree(least_energy(at_rest, [*angles, *X]), pose.at(z).value):
                return False
    return True
