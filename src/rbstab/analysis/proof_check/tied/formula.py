"""The energy f(Θ, X) of an element of a user, in balls, as a function of six variables.

With X = X*(Θ) + z the variables are Θ and z.
"""

from collections.abc import Mapping, Sequence
from typing import Any

from flint import arb

from rbstab.analysis.proof_check.boxes import AXES
from rbstab.analysis.proof_check.formulas import series
from rbstab.analysis.proof_check.formulas.convexity import is_convex
from rbstab.analysis.proof_check.formulas.formula import computed, is_periodic, operations_of
from rbstab.analysis.proof_check.formulas.series import Series
from rbstab.analysis.proof_check.trigonometric import Ball

Orders = Sequence[Any]
"""A function, its three derivatives by Θ, and its nine second ones."""


class FreeFormula:
    """f and its derivatives up to order 2.

    Args:
        data: Its name and its operations.

    Raises:
        ValueError: They are no formula, or it is not shown to be convex in X.
    """

    def __init__(self, data: Mapping[str, Any]) -> None:
        self.operations = operations_of(data, {"theta": 3, "length": 3})
        if not is_convex(self.operations):
            raise ValueError(f"The energy of {data['name']} is not shown to be convex in X")

    @property
    def cost(self) -> int:
        """How many evaluations of an energy of sines and cosines take as long."""
        return 1 + len(self.operations) // 12

    @property
    def periodic(self) -> bool:
        """Whether θ1 and θ3 are used in sines and cosines alone, so that whole turns do nothing."""
        return is_periodic(self.operations)

    def at(
        self,
        Theta: Sequence[Ball],
        position: Sequence[Orders],
        z: Sequence[Ball],
        middle: Sequence[Series] = (),
        step: tuple[Ball, ...] = (),
    ) -> list[Series]:
        """Return the results of all operations at balls of Θ and z; f is the last one.

        Args:
            Theta: The balls of Θ.
            position: X*, at these balls.
            z: The balls of z.
            middle: The results at the middle of these balls; with them, bounds are closer.
            step: The balls of Θ and z minus the middle.
        """

        def leaf(kind: str, axis: int) -> Series:
            if kind == "theta":
                return series.variable(Theta[axis], axis)
            value, slopes, bends = position[axis]
            found: Series = {series.ZERO: value + z[axis], (3 + axis,): arb(1)}
            for i in AXES:
                found[i,] = slopes[i]
                for j in range(i, 3):
                    found[i, j] = bends[i][j] / (2 if i == j else 1)
            return found

        return computed(self.operations, leaf, middle, step)
