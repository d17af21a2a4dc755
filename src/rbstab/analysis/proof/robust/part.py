"""The proof for one box of bodies, without cutting it."""

from dataclasses import dataclass

import numpy as np

from rbstab.analysis.proof.boxes import Boxes, no_boxes
from rbstab.analysis.proof.branch_and_bound import SearchOutcome, prove
from rbstab.analysis.proof.robust.convexity import convex_on
from rbstab.analysis.proof.robust.directions import MAX_DOUBTFUL, FamilyTests
from rbstab.analysis.proof.robust.family import FormFamily
from rbstab.analysis.proof.robust.heights import border_height
from rbstab.analysis.proof.zero import newton
from rbstab.mechanics.numbers import Array

BOX_LIMIT = 20_000
"""The number of boxes of Θ at which the proof of one box of bodies stops."""


@dataclass(frozen=True, eq=False)
class PartProof:
    """What is proved for all bodies in one box.

    If `proved`, each of them has exactly one rest state in the range of eq. 5. It is a minimum and
    is in `enclosure`, and U on the border is higher by at least `level`, J (0: not proved).

    doubtful are points at which the gradient of some energy of the family may be zero, shape
    (n, 3), rad; they show where to look for a second rest state.
    """

    proved: bool
    level: float
    examined: int
    enclosure: Boxes
    doubtful: Array


def prove_part(family: FormFamily, near: Array) -> PartProof:
    """Prove that each member of a family has one rest state, a minimum, and bound its level.

    Args:
        family: The energies.
        near: A point near the rest states, shape (3,), rad.
    """
    tests = FamilyTests(family)
    start, _ = newton(family, near[np.newaxis])
    zeros = prove(family, start, BOX_LIMIT, tests=tests)
    doubtful = tests.doubtful if len(tests.doubtful) else zeros.undecided.centre[:MAX_DOUBTFUL]
    if not zeros.inside:
        doubtful = np.concatenate([start, doubtful])
    single = zeros.outcome is SearchOutcome.PROVED and len(zeros.inside) == 1
    if not single or not convex_on(family, zeros.inside[0].enclosure):
        return PartProof(False, 0.0, zeros.examined, no_boxes(), doubtful)
    zero = zeros.inside[0]
    height = border_height(family.above(zero.Theta))
    return PartProof(
        True, height.lower_bound, zeros.examined + height.examined, zero.enclosure, doubtful
    )


def most_disturbing(family: FormFamily, proof: PartProof) -> int:
    """Return the place of the number that widens the bounds most where they decide nothing."""
    shares = np.array(family.shares).reshape(len(family.others), -1)
    points = proof.doubtful[:4] if len(proof.doubtful) else np.zeros((1, 3))
    scores = np.zeros(shares.shape[1])
    for Theta in points:
        for level in (1, 2):
            sizes = np.abs(family.derivatives_of_others(Theta, level)).reshape(len(shares), -1)
            total = sizes.sum(axis=0)
            scores += (shares.T @ sizes / np.where(total > 0, total, 1.0)).sum(axis=1)
    return int(np.argmax(scores))
