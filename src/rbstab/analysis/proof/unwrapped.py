"""A box that contains the rest states for all real θ1 and θ3.

θ1 and θ3 are not singular and are never wrapped: a body that turns twice about an axis has stored
the energy of two turns. At a rest state the quadratic part of U, ½ Θ'KΘ + q'Θ, balances the
trigonometric part, whose gradient is bounded. This bounds θ1 and θ3.
"""

from typing import NamedTuple

import numpy as np

from rbstab.analysis.proof.boxes import PI, RANGE_END
from rbstab.analysis.proof.lines.slopes import steepest_periodic
from rbstab.analysis.proof.trigonometric import ROUND_OFF, TrigonometricForm
from rbstab.mechanics.numbers import Array

BOX_LIMIT_WITH_LINES = 100_000
"""The number of boxes at which the proof stops for a tied body with springs."""

MARGIN = 1.001
"""Factor on the bounds of θ1 and θ3, so that no rest state is near the border."""

ENOUGH = 0.98
"""A search for bounds on slopes aims at this share of the largest ones for the least ends."""

MAX_END = 20.0
"""rad: wider boxes are not searched, because they take too long."""


def unwrapped_end(form: TrigonometricForm) -> Array | None:
    """Return the largest |Θ| of a box that contains all rest states, shape (3,), rad.

    With the block k of K for θ1 and θ3, ∂U/∂θ1 = ∂U/∂θ3 = 0 is

        k [θ1, θ3]' = -[q1 + K12 θ2 + g1, q3 + K32 θ2 + g3]',

    with |θ2| <= π/2 and the gradient g of the trigonometric part. So |k⁻¹| times the largest
    magnitudes on the right bounds |θ1| and |θ3|. A barrier on θ2 is in neither equation. Returns
    None if k is not positive definite.
    """
    form = form.unguarded
    confinement = _confinement(form, form.largest)
    if confinement is None:
        return None
    return _end(confinement, _steepest(form, confinement))


def confined_end(form: TrigonometricForm, steepest: Array, largest: float) -> Array | None:
    """Return the largest |Θ| of a box that contains all rest states, as `unwrapped_end` does.

    Args:
        form: U; only its quadratic part and its value are used.
        steepest: Bounds on the slopes of the rest of the energy by θ1 and θ3, shape (2,), J/rad.
        largest: A bound on its magnitude, J; not more than an estimate.
    """
    confinement = _confinement(form, largest)
    return None if confinement is None else _end(confinement, steepest)


class _Confinement(NamedTuple):
    """What bounds |θ1| and |θ3|, but for the slopes of the rest of the energy.

    Attributes:
        compliance: Bounds on |k⁻¹|, shape (2, 2).
        load: Bounds on the constant part of the right-hand sides, shape (2,).
        least: The ends are at least these, shape (2,).
    """

    compliance: Array
    load: Array
    least: Array

    @property
    def enough(self) -> Array:
        """Slopes for which the ends are these least ones, shape (2,); a wish, not proved."""
        load = np.linalg.pinv(self.compliance) @ (self.least / MARGIN)
        return np.maximum(ENOUGH * load - self.load, 0.0)


def _confinement(form: TrigonometricForm, largest: float) -> _Confinement | None:
    """Return what bounds both angles; None if k is not positive definite."""
    compliance = _compliance(form.quadratic[np.ix_([0, 2], [0, 2])])
    if compliance is None:
        return None
    load = np.abs(form.linear[[0, 2]]) + np.abs(form.quadratic[[0, 2], 1]) * RANGE_END[1]
    # Wide enough that U is higher there than at θ2 = ±π/2; this needs no proof.
    top = form.value(np.array([[0.0, sign * np.pi / 2, 0.0] for sign in (-1, 1)])).max()
    height = max(0.0, float(top)) + largest
    climb = np.sqrt(2.0 * height * np.diag(compliance))
    return _Confinement(compliance, load, np.maximum(climb, PI))


def _end(confinement: _Confinement, steepest: Array) -> Array:
    """Return the largest |Θ|, from bounds on the slopes of the rest of the energy."""
    bound = confinement.compliance @ (confinement.load + steepest) * MARGIN
    first, third = np.maximum(bound, confinement.least)
    return np.array([first, RANGE_END[1], third])


def _steepest(form: TrigonometricForm, confinement: _Confinement) -> Array:
    """Bound the slopes of the periodic part by θ1 and θ3, shape (2,), J/rad."""
    if not form.lines:
        return form.steepest[[0, 2]]
    return steepest_periodic(form, (0, 2), confinement.enough)


def _compliance(block: Array) -> Array | None:
    """Bound the magnitudes of k⁻¹, for a k whose entries are rounded once; None if not definite."""
    from flint import arb, arb_mat  # imported late, as in `polynomial`

    rows = [[arb(entry, 2 * ROUND_OFF * abs(entry)) for entry in row] for row in block.tolist()]
    matrix = arb_mat(rows)
    if not (rows[0][0] > 0 and matrix.det() > 0):
        return None
    inverse = matrix.inv()
    magnitudes = [[float(inverse[i, j].abs_upper()) for j in range(2)] for i in range(2)]
    return np.nextafter(np.array(magnitudes), np.inf)
