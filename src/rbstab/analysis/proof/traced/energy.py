"""The energy of an element of a user as a part of a reduced energy: a formula of Θ alone.

The body is held, so Θ fixes its position. The bounds are those of the operations that the code of
the user did (`program.py`), one by one.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

import numpy as np

from rbstab.analysis.proof.boxes import RANGE_END, Boxes, grid
from rbstab.analysis.proof.formulas import jets
from rbstab.analysis.proof.formulas.jets import Jet, Rows
from rbstab.analysis.proof.formulas.program import THETA, Operation, Program, computed
from rbstab.analysis.proof.lines.intervals import Intervals, exact
from rbstab.analysis.proof.lines.line import LinePart
from rbstab.mechanics.numbers import Array

if TYPE_CHECKING:
    from rbstab.analysis.proof.trigonometric import TrigonometricForm

CELLS = (16, 8, 16)
"""The boxes by axis over which the bounds of all the range are computed."""

NOISE = 4.0
"""Round-off is this times the largest radius at the centres of these boxes. It ends searches."""


class FormulaPart(LinePart):
    """A part of a reduced energy, J, that the formula of an element of a user states.

    An entry has no bound where the formula may have no value, as 1/x at x = 0.
    """

    program: Program

    @property
    def periodic(self) -> bool:
        """Whether whole turns of θ1 and θ3 leave it as it is."""
        return self.program.periodic

    @property
    def forms(self) -> "Sequence[TrigonometricForm]":
        """None: it is no trigonometric polynomial."""
        return ()

    @cached_property
    def cells(self) -> Boxes:
        """Boxes that cover one turn of θ1 and of θ3, and |θ2| <= π/2."""
        return grid(RANGE_END, CELLS)

    @property
    def _bounds(self) -> Array:
        """Bounds on the magnitudes of the energy and its slopes in the cells, shape (4,)."""
        raise NotImplementedError

    @property
    def steepest(self) -> Array:
        """Bounds on the slopes for |θ2| <= π/2, and |θ1| and |θ3| <= π, shape (3,), J/rad.

        If the formula is periodic, they hold for all θ1 and θ3. Infinite where there is none.
        """
        return self._bounds[1:]

    @property
    def largest(self) -> float:
        """A bound on the magnitude in the same range, J."""
        return float(self._bounds[0])

    @cached_property
    def noise(self) -> tuple[float, Array]:
        """The size of round-off in the energy, J, and in its slopes, shape (3,); not proved."""
        value, slopes = self.at(self.cells.centre, 1)
        at_value = np.nanmax(value.radius, initial=0.0)
        return NOISE * float(at_value), NOISE * np.nanmax(slopes.radius, axis=0, initial=0.0)


@dataclass(frozen=True, eq=False)
class TracedEnergy(FormulaPart):
    """An energy E(Θ), J, with proved bounds on its derivatives of order up to 2.

    Args:
        name: The name of the element.
        program: Its formula.
    """

    name: str
    program: Program

    @np.errstate(all="ignore")  # the formula may have no value at a point
    def approximate(self, Theta: Array, order: int) -> list[Array]:
        """Return the derivatives of order 0 to `order` (at most 2) at points, to round-off."""
        return _derivatives(self._jets(Theta)[-1], order)

    @np.errstate(all="ignore")  # an entry that is no number has no bound
    def over(self, t: Array, boxes: Boxes) -> list[Intervals]:
        """Return proved bounds over boxes: see `LinePart.over`. The Hessian is that over a box."""
        at_centre, whole = self.jets_over(boxes)
        value, slopes = _derivatives(at_centre, 1)
        bent = jets.hessian(whole)
        return [value, slopes, bent, exact(np.zeros((*bent.middle.shape, 3)))]

    @np.errstate(all="ignore")
    def at(self, Theta: Array, order: int) -> list[Intervals]:
        """Return proved bounds on the derivatives of order 0 to `order` (at most 2) at points."""
        if order > 2:
            raise NotImplementedError("a traced energy has bounds on two derivatives")
        return _derivatives(self._jets(exact(Theta))[-1], order)

    def _jets(self, Theta: Rows) -> list[Jet]:
        """Return the results of all operations, at points or over boxes."""
        return computed(self.program, partial(_leaf, Theta), jets.combined)

    def jets_over(self, boxes: Boxes) -> tuple[Jet, Jet]:
        """Return the energy at the centres of boxes, and over them."""
        centres = iter(at_centre := self._jets(exact(boxes.centre)))
        wide, reach = Intervals(boxes.centre, boxes.radius), boxes.radius.T

        def leaf(operation: Operation) -> Jet:
            next(centres)
            return _leaf(wide, operation)

        def combine(kind: str, *operands: Any) -> Jet:
            return jets.tightened(jets.combined(kind, *operands), next(centres), reach)

        return at_centre[-1], computed(self.program, leaf, combine)[-1]

    def has_bounds(self, boxes: Boxes) -> Array:
        """Return whether the formula and its derivatives have bounds over each box, shape (m,)."""
        with np.errstate(all="ignore"):
            rows = self.jets_over(boxes)[1].rows
        found: Array = np.isfinite(rows.middle + rows.radius).all(axis=0)
        return found

    @cached_property
    def _bounds(self) -> Array:
        """Bounds on the magnitudes of E and its slopes in these boxes, shape (4,)."""
        with np.errstate(all="ignore"):
            _, whole = self.jets_over(self.cells)
            sizes = whole.rows.size[:4].max(axis=1)
        found: Array = np.where(np.isfinite(sizes), sizes, np.inf)
        return found


def _leaf(Theta: Rows, operation: Operation) -> Jet:
    kind, number = operation
    if kind == THETA:
        return jets.variable(Theta[:, number], number, 3)
    return jets.constant(number, Theta[:, 0], 3)


def _derivatives(jet: Jet, order: int) -> list[Any]:
    return [jet.rows[0], jets.gradient(jet), jets.hessian(jet)][: order + 1]
