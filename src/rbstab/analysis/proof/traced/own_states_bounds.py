"""Proved bounds on a least energy V(Θ) = min over D of f(Θ, D) over boxes of Θ.

Let m be the centre of a box, δ = Θ - m, D̂ near the D at m, and C near ∂D/∂Θ there. With
D = D̂ + Cδ + ζ and W(Θ, ζ) = f, derivatives along Θ at constant ζ, and H = W_ζζ,

    ∂V/∂θ_i = W_i        ∂²V/∂θ_i∂θ_j = W_ij - W_iζ H⁻¹ W_ζj        where W_ζ = 0.

`lowest_point` bounds ξ with ζ = Bξ over the box, and B'HB >= λ; without a bound, V has none either.
W is computed as a function of Θ and ξ, as the entries of ζ belong together.
"""

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property, partial
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from rbstab.analysis.proof.boxes import Boxes
from rbstab.analysis.proof.formulas import jets
from rbstab.analysis.proof.formulas.jets import Jet
from rbstab.analysis.proof.formulas.program import LENGTH, THETA, Operation, Program, computed
from rbstab.analysis.proof.lines.intervals import Intervals
from rbstab.analysis.proof.lowest_point import (
    WIDER,
    load,
    lost,
    lowest_point,
    norm,
    scaling,
)
from rbstab.analysis.proof.traced.lowest_states import lowest_states, solved
from rbstab.mechanics.numbers import Array

ROOMS = (2.0, 8.0)
"""The bounds that are tried for ξ are so many times |B'g|."""


class Around(NamedTuple):
    """Θ and D as functions of Θ and ξ, at points or over boxes.

    Attributes:
        Theta: Θ, shape (m, 3).
        own: D, shape (m, n).
        slopes: ∂D/∂Θ at constant ξ, exactly, shape (m, n, 3).
        scales: ∂D/∂ξ, exactly, shape (m, n, n).
    """

    Theta: Any
    own: Any
    slopes: Array
    scales: Array

    @property
    def variables(self) -> int:
        """3 + n."""
        return 3 + self.slopes.shape[1]

    def variable(self, operation: Operation) -> Jet:
        """Return an angle, an own state, or a constant."""
        kind, number = operation
        if kind == THETA:
            return jets.variable(self.Theta[:, number], number, self.variables)
        if kind != LENGTH:
            return jets.constant(number, self.Theta[:, 0], self.variables)
        found = jets.variable(self.own[:, number], 3 + number, self.variables)
        rows = found.rows.middle if isinstance(found.rows, Intervals) else found.rows
        rows[1:4] = self.slopes[:, number].T
        rows[4 : 1 + self.variables] = self.scales[:, number].T
        return found

    @classmethod
    def unscaled(cls, Theta: Array, own: Array) -> "Around":
        """Return both at points, with D itself as the variables."""
        count = own.shape[1]
        slopes, scales = np.zeros((len(own), count, 3)), np.tile(np.eye(count), (len(own), 1, 1))
        return cls(Theta, own, slopes, scales)


class OwnStatesBounds:
    """The bounds over some boxes; no numbers where nothing bounds ξ.

    Args:
        program: f, a formula of Θ and D; the entries of D have the kind `LENGTH`.
        count: n, their number.
        boxes: The boxes of Θ.
    """

    def __init__(self, program: Program, count: int, boxes: Boxes) -> None:
        self.program, self.centre, self.radius = program, boxes.centre, boxes.radius
        self.own = lowest_states(program, count, boxes.centre)
        nothing = np.zeros_like(self.own)
        self.C, self.B = self._chosen()
        self.at_centre = self._results(np.zeros_like(self.radius), nothing)
        self.over = self._results(self.radius, nothing, self.at_centre)
        self.g = jets.gradient(self.at_centre[-1])[:, 3:]
        mixed = jets.hessian(self.over[-1])[:, 3:, :3]
        # In the variables ξ, the matrix of lemma 14 is 1.
        self.unit = np.broadcast_to(np.eye(count), self.B.shape)
        loads = load(self.unit, self.g, mixed, boxes.radius)
        self.lowest = lowest_point(self.unit, loads, ROOMS[0], self._bend)
        for room in ROOMS[1:]:
            if self.lowest.proved.all():
                break
            further = lowest_point(self.unit, loads, room, self._bend)
            self.lowest = self.lowest.or_else(further)

    @property
    def value(self) -> Intervals:
        """V at the centres: at most ½ |B'g|²/λ below W at ξ = 0, as B'HB >= λ between them."""
        found = self.at_centre[-1].rows[0]
        below = 0.5 * norm(self.g.size) ** 2 / self.lowest.least * WIDER
        return self._known(Intervals(found.middle, (found.radius + below) * WIDER))

    @property
    def gradient(self) -> Intervals:
        """∂V/∂Θ at the centres, with |ξ| <= |B'g|/λ."""
        most = norm(self.g.size) / self.lowest.least * WIDER
        widths = np.repeat(most[:, np.newaxis], self.own.shape[1], axis=1)
        near = self._with_own(self.at_centre, np.zeros_like(self.radius), widths)
        return self._known(jets.gradient(near)[:, :3])

    @property
    def slopes(self) -> Intervals:
        """∂V/∂Θ over the boxes."""
        return self._known(jets.gradient(self._around_lowest)[:, :3])

    @cached_property
    def _around_lowest(self) -> Jet:
        """W over the boxes, for all ξ at which it may be least."""
        return self._within(self.lowest.widths)

    @property
    def hessian(self) -> Intervals:
        """The Hessian of V over the boxes."""
        bent = jets.hessian(self._around_lowest)
        found, taken = bent[:, :3, :3], lost(self.unit, bent[:, 3:, :3], self.lowest.least)
        return self._known(Intervals(found.middle, (found.radius + taken) * WIDER))

    def _known(self, bounds: Intervals) -> Intervals:
        """Return bounds without a number where nothing is proved."""
        proved = self.lowest.proved.reshape(-1, *[1] * (bounds.middle.ndim - 1))
        return Intervals(bounds.middle, np.where(proved, bounds.radius, np.inf))

    def _chosen(self) -> tuple[Array, Array]:
        """Return C, and B with B'HB near 1, both at the centres, to round-off."""
        around = Around.unscaled(self.centre, self.own)
        jet = computed(self.program, around.variable, jets.combined)[-1]
        bent = jets.hessian(jet)
        usable = np.all(np.isfinite(bent), axis=(1, 2), keepdims=True)
        bent = np.where(usable, bent, np.eye(bent.shape[1]))
        return following(bent), scaling(bent[:, 3:, 3:])

    def _bend(self, widths: Array) -> Intervals:
        """Return bounds on B'HB for |ξ| <= widths over the boxes, shape (m, n, n)."""
        found: Intervals = jets.hessian(self._within(widths))[:, 3:, 3:]
        return found

    def _within(self, widths: Array) -> Jet:
        """Return W over the boxes, for all |ξ| <= widths."""
        return self._with_own(self.over, self.radius, widths, self.at_centre)

    def _with_own(
        self, known: Sequence[Jet], radius: Array, widths: Array, about: Sequence[Jet] = ()
    ) -> Jet:
        """Return W for all |δ| <= radius and |ξ| <= widths; what has no D in it is known."""
        fixed = {place: known[place] for place in self.program.fixed}
        return self._results(radius, widths, about, fixed)[-1]

    def _results(
        self,
        radius: Array,
        widths: Array,
        about: Sequence[Jet] = (),
        known: Mapping[int, Jet] = MappingProxyType({}),
    ) -> list[Jet]:
        """Return the results of all operations, for all |δ| <= radius and |ξ| <= widths.

        Args:
            radius: The radii of the boxes, shape (m, 3).
            widths: Bounds on |ξ|, shape (m, n).
            about: The results at the centres, for closer bounds.
            known: Results that are known, by their places.
        """
        spread = np.einsum("mki,mi->mk", np.abs(self.C), radius)
        spread += np.einsum("mkj,mj->mk", np.abs(self.B), widths)
        own = Intervals(self.own, spread * WIDER)
        around = Around(Intervals(self.centre, radius), own, self.C, self.B)
        program, reach = self.program, np.concatenate([radius.T, widths.T])
        if not about:
            return computed(program, around.variable, jets.combined, known)
        places = (place for place in range(len(program.operations)) if place not in known)

        def tightened(make: Callable[..., Jet], *operands: object) -> Jet:
            return jets.tightened(make(*operands), about[next(places)], reach)

        leaf, combine = (partial(tightened, make) for make in (around.variable, jets.combined))
        return computed(program, leaf, combine, known)


def following(hessian: Array) -> Array:
    """Return ∂D/∂Θ = -H⁻¹ f_DΘ from the Hessian of f by Θ and D, shape (m, n, 3)."""
    return -solved(hessian[:, 3:, 3:], hessian[:, 3:, :3])
