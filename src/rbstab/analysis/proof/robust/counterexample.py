"""A body in a box that has several rest states, or one that is not a minimum: the claim is false.

The search is numerical; what it finds is proved for the exact numbers of the body.
"""

from collections.abc import Iterable
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from rbstab.analysis.proof.boxes import whole_range
from rbstab.analysis.proof.branch_and_bound import CONVERGED_STEP
from rbstab.analysis.proof.enclosure import enclosure
from rbstab.analysis.proof.index import proved_index
from rbstab.analysis.proof.reduced_energy import NoReducedEnergy
from rbstab.analysis.proof.robust.energies import energies_of
from rbstab.analysis.proof.robust.numbers import Members, Part
from rbstab.analysis.proof.trigonometric import TrigonometricForm
from rbstab.analysis.proof.zero import Zero, isolated_zero, newton
from rbstab.mechanics.numbers import Array

STEPS = 16
"""A body is chosen from as many steps between the middle and an end of each number."""


class Counterexample(NamedTuple):
    """A body, as the numbers that have a tolerance, and its proved rest states, shape (n, 3), rad.

    With a single rest state, this one is proved not to be a minimum.
    """

    numbers: tuple[Fraction, ...]
    rest_states: Array


def counterexample(members: Members, part: Part, starts: Array) -> Counterexample | None:
    """Look for a counterexample in a box: its middle, and the body that is flattest at some points.

    Args:
        members: Builds the system of a member.
        part: The box of bodies.
        starts: Points at which the gradient of some body may be zero, shape (n, 3), rad.
    """
    found = _shown_by(members, part.middle, starts)
    if found is None and len(starts):
        aimed = _flattest(members, part, starts)
        found = None if aimed is None else _shown_by(members, aimed, starts)
    return found


def _shown_by(
    members: Members, numbers: tuple[Fraction, ...], starts: Array
) -> Counterexample | None:
    try:
        form = energies_of(members, Part(numbers, (Fraction(0),) * len(numbers))).family
    except NoReducedEnergy:
        return None
    zeros = proved_rest_states_near(form, [np.zeros(3), *starts])
    if len(zeros) == 1:
        bounds = enclosure(form, zeros[0].enclosure)
        if not proved_index(bounds.hessian[0], bounds.hessian_radius[0]):
            return None
    if not zeros:
        return None
    return Counterexample(numbers, np.array([zero.Theta for zero in zeros]))


def _flattest(members: Members, part: Part, points: Array) -> tuple[Fraction, ...] | None:
    """Return the body whose gradient is nearly zero at one of some points, to first order in z."""
    from scipy.optimize import lsq_linear  # imported late: most boxes need no counterexample

    moved = [k for k, radius in enumerate(part.radius) if radius]
    try:
        at_middle = _gradients(members, part.middle, points)
        columns = [
            _gradients(members, _changed(part, {k: Fraction(1)}), points) - at_middle for k in moved
        ]
    except NoReducedEnergy:
        return None
    best, chosen = np.inf, None
    for place in range(len(points)):
        slopes = np.array([column[place] for column in columns]).T
        if not np.all(np.isfinite(slopes)):
            continue
        found = lsq_linear(slopes, -at_middle[place], bounds=(-1.0, 1.0))
        if found.cost < best:
            best, chosen = found.cost, found.x
    if chosen is None:
        return None
    steps = {
        k: Fraction(round(float(z) * STEPS), STEPS) for k, z in zip(moved, chosen, strict=True)
    }
    return _changed(part, steps)


def _changed(part: Part, z: dict[int, Fraction]) -> tuple[Fraction, ...]:
    return tuple(
        middle + z.get(k, Fraction(0)) * part.radius[k] for k, middle in enumerate(part.middle)
    )


def _gradients(members: Members, numbers: tuple[Fraction, ...], points: Array) -> Array:
    body = Part(numbers, (Fraction(0),) * len(numbers))
    return energies_of(members, body).family.approximate(points, 1)[1]


@np.errstate(all="ignore")  # comparisons with NaN are false
def proved_rest_states_near(form: TrigonometricForm, starts: Iterable[Array]) -> tuple[Zero, ...]:
    """Return proved rest states of one body in the range of eq. 5 that Newton's method reaches.

    Args:
        form: The energy of the body, with proved errors.
        starts: Points to start from, each of shape (3,), rad.
    """
    Theta, last = newton(form, np.array(list(starts)).reshape(-1, 3))
    found: list[Zero] = []
    for point in Theta[last < CONVERGED_STEP]:
        if np.any(np.abs(point) > form.reach) or any(zero.domain_contains(point) for zero in found):
            continue
        zero = isolated_zero(form, point)
        if zero is None or not zero.enclosure.within(whole_range())[0]:
            continue
        if all(zero.is_same_as(other) is False for other in found):
            found.append(zero)
    return tuple(found)
