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
    """Look for a counterexample in a box: its middle, and its softest body.

    Args:
        members: Builds the system of a member.
        part: The box of bodies.
        doubtful: Points at which the gradient of some body may be zero, shape (n, 3), rad.
        family: The energies of the box.
    """
    starts = np.hstack([doubtful.T, starts_in_range()])
    for numbers in (part.middle, part.at(_softest(family, doubtful[:1].T))):
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


def _softest(family: Family, point: Array) -> list[int]:
    """Return z of the body whose ∇²U at a point is least along the softest axis of the middle."""
    at = family.over(point, point)
    soft = np.linalg.eigh(at.bend.middle[:, :3, 0])[1][:, 0]
    _, bends = at.by_number()
    changes = soft @ bends[..., 0] @ soft
    return (-np.sign(np.nan_to_num(changes))).astype(int).tolist()
