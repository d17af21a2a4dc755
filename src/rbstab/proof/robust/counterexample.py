"""A body in a box that has several rest states, or one that is not a minimum: the claim is false.

The search is numerical; what it finds is proved for the exact numbers of the body.
"""

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
from rbstab.proof.robust.part import starts_in_range
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


@np.errstate(all="ignore")  # comparisons with NaN are false
def counterexample(
    members: Members, part: Part, doubtful: Array, family: Family
) -> Counterexample | None:
    """Look for a counterexample in a box: its middle, and the flattest and the softest body.

    Args:
        members: Builds the system of a member.
        part: The box of bodies.
        doubtful: Points at which the gradient of some body may be zero, shape (n, 3), rad.
        family: The energies of the box.
    """
    starts = np.hstack([doubtful.T, starts_in_range()])
    for choose in (_middle, _flattest, _softest):
        numbers = part.at([Fraction(round(z * STEPS), STEPS) for z in choose(family, doubtful.T)])
        zeros = _rest_states(members, numbers, starts)
        if len(zeros) > 1 or any(zero.index for zero in zeros):
            return Counterexample(numbers, np.array([zero.point for zero in zeros]))
    return None


def _rest_states(members: Members, numbers: tuple[Fraction, ...], starts: Array) -> list[Zero]:
    """Return proved rest states of a body in the range of eq. 5, from starts (3, points)."""
    try:
        U = energy_of(members.own([float(x) for x in numbers]), partial(members.exact, numbers))
    except (NoMinimumError, TypeError):
        return []
    high = np.array([np.pi, np.pi / 2 if U.stop is None else float(U.stop), np.pi])
    search = Search(BoundedEnergy(U.U, free=U.free, least=U.least), Box(-high, high))
    return list(search.with_zeros_near(starts).zeros)


def _middle(family: Family, _: Array) -> list[float]:
    return [0.0] * len(family.energies.linear)


def _flattest(family: Family, points: Array) -> list[float]:
    """Return z of the body whose gradient is nearly zero at some point, to first order in z."""
    from scipy.optimize import lsq_linear  # imported late: most boxes need no counterexample

    at = family.over(points, points)
    g, (changes, _) = at.slope.middle, at.by_number()
    known = np.isfinite(g).all(axis=0) & np.isfinite(changes).all(axis=(0, 1))
    found = [
        lsq_linear(changes[:, :, k].T, -g[:, k], bounds=(-1.0, 1.0)) for k in np.flatnonzero(known)
    ]
    best = min(found, key=lambda one: one.cost, default=None)
    return _middle(family, points) if best is None else best.x.tolist()


def _softest(family: Family, points: Array) -> list[float]:
    """Return z of the body whose ∇²U at the first point is least along the middle one's softest."""
    at = family.over(points[:, :1], points[:, :1])
    soft = np.linalg.eigh(at.bend.middle[:, :3, 0])[1][:, 0]
    _, bends = at.by_number()
    return (-np.sign(np.nan_to_num(soft @ bends[..., 0] @ soft))).tolist()
