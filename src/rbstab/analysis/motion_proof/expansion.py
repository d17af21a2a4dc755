"""The expansion of a motion about one state, and how accurate it is to be.

An accuracy has an effect on how long the steps are and on how narrow the enclosure is, not on what
is proved: the defect of the polynomial is bounded, whatever the polynomial is.
"""

from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from rbstab.analysis.motion_proof.taylor import (
    Coefficients,
    Field,
    Slopes,
    extended,
    jacobian_slopes,
    polynomial,
)


class Accuracy(NamedTuple):
    """How a motion is expanded.

    Attributes:
        order: The degree of p.
        jacobian_terms: The number of terms of J, and the degree of Φ and Ψ.
        tolerance: The size of the last terms of p, relative to the scale of a state.
        extended: Whether the last terms of p follow from J, in doubles. This takes less time, and p
            is less accurate. The order is then at most twice `jacobian_terms`.
    """

    order: int = 20
    jacobian_terms: int = 12
    tolerance: float = 1e-17
    extended: bool = False


NARROW = Accuracy()
"""For enclosures that are much narrower than the error of a computed motion."""

FAST = Accuracy(order=18, jacobian_terms=14, tolerance=1e-13, extended=True)
"""For a decision alone: the enclosure is wider, and takes about half the time."""


class Expansion:
    """The polynomial p of a motion from one state, and ∂f/∂y along it. No step length enters.

    Args:
        field: f.
        centre: The state, exact balls.
        accuracy: How accurate it is.
    """

    def __init__(self, field: Field, centre: list[Any], accuracy: Accuracy = NARROW) -> None:
        self.field = field
        self.centre = centre
        self.accuracy = accuracy

    @cached_property
    def p(self) -> Coefficients:
        """The coefficients of p."""
        return self._both[0]

    @cached_property
    def slopes(self) -> Slopes:
        """The first coefficients of ∂f/∂y along p, `jacobian_terms` of them, as balls."""
        found = self._both[1]
        if found is None:
            return jacobian_slopes(self.field, self.p, self.accuracy.jacobian_terms)
        return found

    @cached_property
    def _both(self) -> tuple[Coefficients, Slopes | None]:
        order, terms, _, is_extended = self.accuracy
        if not is_extended:
            return polynomial(self.field, self.centre, order), None
        # Each extension doubles the degree.
        half = (terms - 2) // 2
        p = polynomial(self.field, self.centre, half)
        with np.errstate(all="ignore"):
            p = extended(self.field, p, jacobian_slopes(self.field, p, half + 1), terms - 1)
            # Coefficient k depends on those of p up to k: these are the ones along all of p.
            slopes = jacobian_slopes(self.field, p, terms)
            return extended(self.field, p, slopes, order), slopes
