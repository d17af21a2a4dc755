"""The energy of an element of a user that depends on the position: a formula f(Θ, X).

With X = X*(Θ) + z it is a function of the six variables y = [Θ, z]. Its bounds are those of the
operations that the code of the user did, one by one.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np

from rbstab.analysis.proof.formulas import jets
from rbstab.analysis.proof.formulas.jets import Jet
from rbstab.analysis.proof.formulas.program import LENGTH, THETA, Operation, Program, computed
from rbstab.analysis.proof.lines.intervals import Intervals
from rbstab.integrate.straight_line.number import CONSTANT
from rbstab.mechanics.numbers import Array

VARIABLES = 6

_KNOWN = jets.layout(VARIABLES)


class Place(NamedTuple):
    """Θ, X and z, at points or over boxes.

    Attributes:
        Theta: Θ, shape (m, 3).
        position: X* and its derivatives by Θ of order 1 and 2: shapes (m, 3), (m, 3, 3) and
            (m, 3, 3, 3).
        z: z, shape (m, 3).
    """

    Theta: Intervals
    position: Sequence[Intervals]
    z: Intervals

    def variable(self, operation: Operation) -> Jet:
        """Return an angle, an entry of X, or a constant as a function of y."""
        kind, number = operation
        if kind == CONSTANT:
            return jets.constant(number, self.Theta[:, 0], VARIABLES)
        if kind == THETA:
            return jets.variable(self.Theta[:, number], number, VARIABLES)
        shift = jets.variable(self.z[:, number], 3 + number, VARIABLES)
        value, slopes, bends = (order[:, number] for order in self.position)
        rows = Intervals(*np.zeros((2, _KNOWN.rows, len(self.z.middle))))
        for one, of_position in ((rows.middle, "middle"), (rows.radius, "radius")):
            one[0] = getattr(value, of_position)
            one[1:4] = getattr(slopes, of_position).T
            for (i, j), row in zip(_KNOWN.second, one[1 + VARIABLES :], strict=True):
                if j < 3:
                    row[:] = getattr(bends, of_position)[:, i, j]
        return shift + Jet(rows)


@dataclass(frozen=True, eq=False)
class FreeFormula:
    """f(Θ, X), J.

    Args:
        name: The name of the element.
        program: The formula.
    """

    name: str
    program: Program

    def at(self, place: Place) -> Jet:
        """Return f at points, as a function of y."""
        return computed(self.program, place.variable, jets.combined)[-1]

    def over(self, centre: Place, wide: Place) -> Jet:
        """Return f over boxes, as a function of y.

        Args:
            centre: Their centres.
            wide: The boxes.
        """
        centres = iter(computed(self.program, centre.variable, jets.combined))
        reach = np.concatenate([wide.Theta.radius.T, wide.z.radius.T])

        def tightened(make: Callable[..., Jet], *operands: object) -> Jet:
            return jets.tightened(make(*operands), next(centres), reach)

        leaf, combine = (partial(tightened, make) for make in (wide.variable, jets.combined))
        found: Jet = computed(self.program, leaf, combine)[-1]
        return found

    def of_shift(self, Theta: Array, X: Array) -> Jet:
        """Return f as a function of z alone, to round-off.

        Args:
            Theta: Θ at points, shape (m, 3).
            X: X at these points, shape (m, 3).
        """

        def leaf(operation: Operation) -> Jet:
            kind, number = operation
            if kind == LENGTH:
                return jets.variable(X[:, number], number, 3)
            found = jets.constant(0.0, X[:, 0], 3)
            found.rows[0] = Theta[:, number] if kind == THETA else number
            return found

        return computed(self.program, leaf, jets.combined)[-1]
