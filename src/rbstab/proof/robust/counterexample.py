"""A body in a box that has several rest states, or one that is not a minimum: the claim is false.

The search is numerical; what it finds is proved for the exact numbers of the body.
"""

from collections.abc import Callable
from fractions import Fraction
from functools import partial
from typing import NamedTuple

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.proof.boxes import Box
from rbstab.proof.enclosures.bounds import BoundedEnergy
from rbstab.proof.model import NoMinimumError, energy_of
from rbstab.proof.robust.family import Family
from rbstab.proof.robust.numbers import Members, Part
from rbstab.proof.search import Search
from rbstab.proof.zeros import Zero

STEPS = 16
"""A body is chosen from as many steps between the middle and an end of each number."""


class Counterexample(NamedTuple):
    """A body, as the numbers that have a tolerance, and its proved rest states, shape (n, 3), rad.

    With a single rest state, this one is proved not to be a minimum.
    """

    numbers: tuple[Fraction, ...]
    rest_states: Array


def counterexample(
    members: Members, part: Part, starts: Array, family: Family
) -> Counterexample | None:
    """Look for a counterexample in a box: its middle, and the flattest and the softest body.

    Args:
        members: Builds the system of a member.
        part: The box of bodies.
        starts: Points at which the gradient of some body may be zero, shape (n, 3), rad.
        family: The energies of the box.
    """
    chosen: list[Callable[[], tuple[Fraction, ...]]] = [lambda: part.middle]
    if len(starts):
        chosen.append(lambda: _flattest(family, part, starts))
        chosen.append(lambda: _softest(family, part, starts[0]))
    for choose in chosen:
        numbers = choose()
        zeros = proved_rest_states(members, numbers, np.vstack([np.zeros(3), starts]))
        if len(zeros) > 1 or any(zero.index for zero in zeros):
            return Counterexample(numbers, np.array([zero.point for zero in zeros]))
    return None


@np.errstate(all="ignore")  # comparisons with NaN are false
def proved_rest_states(
    members: Members, numbers: tuple[Fraction, ...], starts: Array
) -> list[Zero]:
    """Return proved rest states of one body in the range of eq. 5 that Newton's method reaches.

    Args:
        members: Builds the system of a member.
        numbers: The numbers of the body.
        starts: Points to start from, shape (n, 3), rad.
    """
    exact = partial(members.exact, [Fraction(x) for x in numbers])
    try:
        U = energy_of(members.own([float(x) for x in numbers]), exact)
    except (NoMinimumError, TypeError):
        return []
    high = np.array([np.pi, np.pi / 2 if U.stop is None else float(U.stop), np.pi])
    search = Search(BoundedEnergy(U.U, free=U.free, least=U.least), Box(-high, high))
    return list(search.with_zeros_near(starts.T).zeros)


def _flattest(family: Family, part: Part, points: Array) -> tuple[Fraction, ...]:
    """Return the body whose gradient is nearly zero at one of some points, to first order in z."""
    from scipy.optimize import lsq_linear  # imported late: most boxes need no counterexample

    at_middle, by_number, _ = family.gradients(points.T)
    moved = [k for k, radius in enumerate(part.radius) if radius]
    best, chosen = np.inf, np.zeros(len(moved))
    for place in range(len(points)):
        slopes = by_number[moved, :, place].T
        if not np.all(np.isfinite(slopes)) or not np.all(np.isfinite(at_middle[:, place])):
            continue
        found = lsq_linear(slopes, -at_middle[:, place], bounds=(-1.0, 1.0))
        if found.cost < best:
            best, chosen = found.cost, found.x
    numbers = list(part.middle)
    for k, z in zip(moved, chosen, strict=True):
        numbers[k] += Fraction(round(float(z) * STEPS), STEPS) * part.radius[k]
    return tuple(numbers)


def _softest(family: Family, part: Part, point: Array) -> tuple[Fraction, ...]:
    """Return the body at an end of the box whose ∇²U at a point falls most, where it is least."""
    _, _, bent = family.gradients(point[:, np.newaxis])
    _, axes = np.linalg.eigh(family.at(point[:, np.newaxis])[1][..., 0])
    changes = axes[:, 0] @ bent[..., 0].reshape(-1, 3, 3) @ axes[:, 0]
    ends = np.sign(np.nan_to_num(changes)).astype(int).tolist()
    return tuple(
        middle - end * radius
        for middle, end, radius in zip(part.middle, ends, part.radius, strict=True)
    )
