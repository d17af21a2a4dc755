"""The least energy of an element of a user over its own states, as a part of a reduced energy.

    V(Θ) = min over D of f(Θ, D)

The body is held, so Θ fixes its position. f is convex in D, by the form of its formula. So it is
least where ∂f/∂D = 0, at one D if the Hessian H by D is positive definite there.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rbstab.analysis.proof.boxes import Boxes, joined
from rbstab.analysis.proof.formulas import jets
from rbstab.analysis.proof.formulas.program import Program, computed
from rbstab.analysis.proof.lines.intervals import Intervals, exact
from rbstab.analysis.proof.lowest_point import WIDER
from rbstab.analysis.proof.traced.energy import FormulaPart
from rbstab.analysis.proof.traced.lowest_states import lowest_states
from rbstab.analysis.proof.traced.own_states_bounds import Around, OwnStatesBounds, following
from rbstab.mechanics.numbers import Array

MOST_STATES = 6
"""The largest number of own states."""

BOX_LIMIT = 20_000
"""The boxes over which the bounds of all the range are computed at most."""

FAR_ABOVE = 3.0
"""Bounds are at most so many times the largest magnitude at points, if `BOX_LIMIT` allows."""


@dataclass(frozen=True, eq=False)
class OwnStatesEnergy(FormulaPart):
    """V(Θ), J, with proved bounds on its derivatives of order up to 2.

    Args:
        name: The name of the element.
        program: f, a formula of Θ and D; the entries of D have the kind `LENGTH`.
        count: n, the number of entries of D.
    """

    name: str
    program: Program
    count: int

    def lowest(self, Theta: Array) -> Array:
        """Return D at points, to round-off, shape (m, n)."""
        return lowest_states(self.program, self.count, Theta)

    @np.errstate(all="ignore")
    def approximate(self, Theta: Array, order: int) -> list[Array]:
        """Return the derivatives of order 0 to `order` (at most 2) at points, to round-off."""
        around = Around.unscaled(Theta, self.lowest(Theta))
        jet = computed(self.program, around.variable, jets.combined)[-1]
        found = [jet.rows[0]]
        if order > 0:
            found.append(jets.gradient(jet)[:, :3])
        if order > 1:
            bent = jets.hessian(jet)
            mixed = bent[:, 3:, :3]
            found.append(bent[:, :3, :3] + mixed.swapaxes(1, 2) @ following(bent))
        return found

    def over(self, t: Array, boxes: Boxes) -> list[Intervals]:
        """Return proved bounds over boxes: see `LinePart.over`. The Hessian is that over a box."""
        return [*self._over(boxes), exact(np.zeros((len(boxes), 3, 3, 3)))]

    def at(self, Theta: Array, order: int) -> list[Intervals]:
        """Return proved bounds on the derivatives of order 0 to `order` (at most 2) at points."""
        if order > 2:
            raise NotImplementedError("the least energy over own states has two derivatives")
        return self._over(Boxes(Theta, Theta))[: order + 1]

    def has_values(self, Theta: Array) -> bool:
        """Return whether bounds on V are found at each of these points."""
        value, *_ = self.at(Theta, 0)
        return bool(np.all(np.isfinite(value.middle + value.radius)))

    @np.errstate(all="ignore")
    def _over(self, boxes: Boxes) -> list[Intervals]:
        """Return V and its slopes at the centres, and its Hessian over the boxes."""
        one = OwnStatesBounds(self.program, self.count, boxes)
        return [one.value, one.gradient, one.hessian]

    @cached_property
    def _bounds(self) -> Array:
        """Bounds on the magnitudes of V and its slopes in the cells, shape (4,).

        Cells are halved where these are far above those at points, up to a limit.
        """
        V, slopes = self.approximate(self.cells.centre, 1)
        wanted = FAR_ABOVE * np.abs(np.column_stack([V, slopes])).max(axis=0)
        pending, examined, most = self.cells, 0, np.zeros(4)
        while len(pending):
            examined += len(pending)
            sizes = self._sizes(pending)
            left = ~np.all(sizes <= wanted, axis=1)
            if examined + 2 * left.sum() > BOX_LIMIT:
                left[:] = False
            most = np.maximum(most, sizes[~left].max(axis=0, initial=0.0))
            rest = pending[left]
            pending = joined([rest.halves(rest.radius.argmax(axis=1))])
        return np.where(np.isfinite(most), most, np.inf)

    @np.errstate(all="ignore")
    def _sizes(self, boxes: Boxes) -> Array:
        """Bound the magnitudes of V and its slopes over boxes, shape (m, 4)."""
        one = OwnStatesBounds(self.program, self.count, boxes)
        slopes = one.slopes.size
        over = one.value.size + (slopes * boxes.radius).sum(axis=1) * WIDER
        return np.column_stack([over, slopes])
