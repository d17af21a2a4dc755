"""The own states D at which a formula f(Θ, D) that is convex in D is least, to round-off."""

import numpy as np

from rbstab.analysis.proof.formulas import jets
from rbstab.analysis.proof.formulas.jets import Jet
from rbstab.analysis.proof.formulas.program import THETA, Operation, Program, computed
from rbstab.mechanics.numbers import Array

MAX_STEPS = 80
HALVINGS = 100
"""The largest numbers of Newton's steps, and of halvings of one of them."""

CONVERGED = 1e-8
"""A step that is so short, relative to the longest one, is the last: it reaches round-off."""


@np.errstate(all="ignore")  # the formula may have no value at a point
def lowest_states(program: Program, count: int, Theta: Array) -> Array:
    """Return D at points by Newton's method, shape (m, n).

    Args:
        program: f, a formula of Θ and D; the entries of D have the kind `LENGTH`.
        count: n, their number.
        Theta: The points, shape (m, 3).
    """
    f = _OfOwnStates(program, count, Theta)
    D, left = np.zeros((len(Theta), count)), np.arange(len(Theta))
    found, longest = f.at(left, D), np.zeros(len(Theta))
    for _ in range(MAX_STEPS):
        step = -solved(jets.hessian(found), jets.gradient(found))
        going = np.abs(step).max(axis=1) > CONVERGED * longest[left]
        tried = f.at(left, D[left] + step).rows
        worse = np.flatnonzero(going & ~_is_lower(tried, found.rows, count))
        for _ in range(HALVINGS):
            if not len(worse):
                break
            step[worse] *= 0.5
            tried[:, worse] = f.at(left[worse], D[left[worse]] + step[worse]).rows
            lower = _is_lower(tried[:, worse], found.rows[:, worse], count)
            worse = worse[~lower]
        step[worse], going[worse] = 0.0, False  # as low as round-off allows
        D[left] += step
        longest[left] = np.maximum(longest[left], np.abs(step).max(axis=1))
        left, found = left[going], Jet(tried[:, going])
        if not len(left):
            break
    return D


class _OfOwnStates:
    """f as a function of D alone, to round-off.

    Args:
        program: f.
        count: The number of entries of D.
        Theta: The points, shape (m, 3).
    """

    def __init__(self, program: Program, count: int, Theta: Array) -> None:
        self.program, self.count = program, count

        def leaf(operation: Operation) -> Jet:
            kind, number = operation
            found = jets.constant(0.0, Theta[:, 0], count)
            found.rows[0] = Theta[:, number] if kind == THETA else number
            return found

        found = computed(program, leaf, jets.combined)
        self.fixed = {place: found[place].rows for place in program.fixed}
        self.unused = dict.fromkeys(self.fixed.keys() - program.used_by_others)

    def at(self, rows: Array, D: Array) -> Jet:
        """Return f and its derivatives by D at some of the points.

        Args:
            rows: Which points.
            D: D there, shape (k, n).
        """
        known = dict[int, Jet | None](self.unused)
        for place in self.fixed.keys() - known.keys():
            known[place] = Jet(self.fixed[place][:, rows], constant=True)

        def leaf(operation: Operation) -> Jet:
            return jets.variable(D[:, operation[1]], operation[1], self.count)

        found: Jet = computed(self.program, leaf, jets.combined, known)[-1]
        return found


def _is_lower(rows: Array, before: Array, count: int) -> Array:
    """Return whether a step lowers the energy or, where that is only round-off, its slopes."""
    steep, steep_before = (np.abs(one[1 : 1 + count]).max(axis=0) for one in (rows, before))
    found: Array = (rows[0] < before[0]) | (steep < steep_before)
    return found


def solved(matrices: Array, right: Array) -> Array:
    """Return A⁻¹b; b where there is none."""
    usable = np.all(np.isfinite(matrices), axis=(1, 2), keepdims=True)
    safe = np.where(usable, matrices, np.eye(matrices.shape[-1]))
    columns = right[:, :, np.newaxis] if right.ndim == 2 else right
    try:
        found = np.linalg.solve(safe, columns)
    except np.linalg.LinAlgError:  # one of them is singular
        found = np.linalg.pinv(safe) @ columns
    return np.reshape(found, right.shape)
