"""The least energy of an element of a user over its own states, as a part of a reduced energy.

    V(Θ) = min over D of f(Θ, D)

The body is held, so Θ fixes its position. f is convex in D, by the form of its formula. So it is
least where ∂f/∂D = 0, at one D if the Hessian H by D is positive definite there. Let m be the
centre of a box, δ = Θ - m, D̂ near the D at m, and C near ∂D/∂Θ there. With D = D̂ + Cδ + ζ and
W(Θ, ζ) = f, derivatives along Θ at constant ζ,

    ∂V/∂θ_i = W_i        ∂²V/∂θ_i∂θ_j = W_ij - W_iζ H⁻¹ W_ζj        where W_ζ = 0.

`lowest_point` bounds ζ over the box; without a bound, V has none there either.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any, NamedTuple

import numpy as np

from rbstab.analysis.proof.boxes import Boxes, joined
from rbstab.analysis.proof.formulas import jets
from rbstab.analysis.proof.formulas.jets import Jet
from rbstab.analysis.proof.formulas.program import LENGTH, THETA, Operation, Program, computed
from rbstab.analysis.proof.lines.intervals import Intervals, exact
from rbstab.analysis.proof.lowest_point import (
    WIDER,
    load,
    lost,
    lowest_point,
    product,
    scaling,
    size_of,
    turned,
    widths_of,
)
from rbstab.analysis.proof.traced.energy import FormulaPart
from rbstab.mechanics.numbers import Array

MOST_STATES = 6
"""The largest number of own states."""

MAX_STEPS = 80
HALVINGS = 40
"""The largest numbers of Newton's steps, and of halvings of one of them."""

ROUND_OFF = 1e-14
"""A step may raise the energy by so much of it, as the last ones do."""

BOX_LIMIT = 20_000
"""The boxes over which the bounds of all the range are computed at most."""


class _Around(NamedTuple):
    """Θ and D as functions of Θ and ζ, at points or over boxes.

    Attributes:
        Theta: Θ, shape (m, 3).
        own: D, shape (m, n).
        slopes: ∂D/∂Θ at constant ζ, exactly, shape (m, n, 3).
    """

    Theta: Any
    own: Any
    slopes: Array

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
        return found


@dataclass(frozen=True, eq=False)
class OwnStatesEnergy(FormulaPart):
    """V(Θ), J, with proved bounds on its derivatives of order up to 2.

    Args:
        name: The name of the element.
        program: f, with the entries of D as lengths.
        count: n, the number of entries of D.
    """

    name: str
    program: Program
    count: int

    @np.errstate(all="ignore")  # the formula may have no value at a point
    def lowest(self, Theta: Array) -> Array:
        """Return D at points, to round-off, shape (m, n): by Newton's method."""
        D, left = np.zeros((len(Theta), self.count)), np.arange(len(Theta))
        found = self._of_own(Theta, D)
        for _ in range(MAX_STEPS):
            step = -_solved(jets.hessian(found), jets.gradient(found))
            tried = self._of_own(Theta[left], D[left] + step)
            for _ in range(HALVINGS):
                worse = ~(tried.rows[0] <= found.rows[0] + ROUND_OFF * np.abs(found.rows[0]))
                if not worse.any():
                    break
                step[worse] *= 0.5
                tried = self._of_own(Theta[left], D[left] + step)
            D[left] += step
            moves = np.abs(step).max(axis=1) > 4 * np.spacing(np.abs(D[left]).max(axis=1))
            # The slope falls, but for round-off: so the last step is known.
            steep, before = (np.abs(jets.gradient(one)).max(axis=1) for one in (tried, found))
            moves &= ~((tried.rows[0] == found.rows[0]) & (steep >= before))
            left, found = left[moves], Jet(tried.rows[:, moves])
            if not len(left):
                break
        return D

    def _of_own(self, Theta: Array, D: Array) -> Jet:
        """Return f as a function of D alone, to round-off."""

        def leaf(operation: Operation) -> Jet:
            kind, number = operation
            if kind == LENGTH:
                return jets.variable(D[:, number], number, self.count)
            found = jets.constant(0.0, D[:, 0], self.count)
            found.rows[0] = Theta[:, number] if kind == THETA else number
            return found

        return computed(self.program, leaf, jets.combined)[-1]

    @np.errstate(all="ignore")
    def approximate(self, Theta: Array, order: int) -> list[Array]:
        """Return the derivatives of order 0 to `order` (at most 2) at points, to round-off."""
        around = _Around(Theta, self.lowest(Theta), np.zeros((len(Theta), self.count, 3)))
        jet = computed(self.program, around.variable, jets.combined)[-1]
        found = [jet.rows[0]]
        if order > 0:
            found.append(jets.gradient(jet)[:, :3])
        if order > 1:
            bent = jets.hessian(jet)
            mixed = bent[:, 3:, :3]
            found.append(bent[:, :3, :3] + mixed.swapaxes(1, 2) @ _slopes(bent))
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
        """Return whether bounds on V are found at all of some points."""
        value, *_ = self.at(Theta, 0)
        return bool(np.all(np.isfinite(value.middle + value.radius)))

    @np.errstate(all="ignore")
    def _over(self, boxes: Boxes) -> list[Intervals]:
        """Return V and its slopes at the centres, and its Hessian over the boxes."""
        one = _Enclosure(self, boxes)
        return [one.value, one.gradient, one.hessian]

    @cached_property
    def _bounds(self) -> Array:
        """Bounds on the magnitudes of V and its slopes in the cells, shape (4,)."""
        pending, examined, most = self.cells, 0, np.zeros(4)
        while len(pending):
            examined += len(pending)
            if examined > BOX_LIMIT:
                return np.full(4, np.inf)
            value, slopes, bent = self._over(pending)
            r = pending.radius
            turning = slopes.size + np.einsum("mij,mj->mi", bent.size, r) * WIDER
            sizes = np.column_stack([value.size + (turning * r).sum(axis=1) * WIDER, turning])
            known = np.all(np.isfinite(sizes), axis=1)
            most = np.maximum(most, sizes[known].max(axis=0, initial=0.0) * WIDER)
            left = pending[~known]
            pending = joined([left.halves(left.radius.argmax(axis=1))])
        return most

    @property
    def steepest(self) -> Array:
        """Bounds on the slopes for |θ2| <= π/2, and |θ1| and |θ3| <= π, shape (3,), J/rad.

        If the formula is periodic, they hold for all θ1 and θ3. Infinite where there is none.
        """
        return self._bounds[1:]

    @property
    def largest(self) -> float:
        """A bound on |V| in the same range, J."""
        return float(self._bounds[0])


class _Enclosure:
    """The bounds over some boxes; no numbers where nothing bounds ζ.

    Args:
        energy: V.
        boxes: The boxes of Θ.
    """

    def __init__(self, energy: OwnStatesEnergy, boxes: Boxes) -> None:
        self.energy, self.boxes = energy, boxes
        self.own, nothing = energy.lowest(boxes.centre), np.zeros((len(boxes), energy.count))
        self.C, self.B = self._chosen()
        self.centres = self._results(boxes.centre, np.zeros_like(boxes.centre), nothing)
        self.g = jets.gradient(self.centres[-1])[:, 3:]
        mixed = jets.hessian(self._over(nothing))[:, 3:, :3]
        loads = load(self.B, self.g, mixed, boxes.radius)
        self.proved, self.widths, self.least = lowest_point(self.B, loads, self._deviation)

    @property
    def value(self) -> Intervals:
        """V at the centres: at most ½ |B'g|²/λ below W at ζ = 0, as B'HB >= λ between them."""
        found = self.centres[-1].rows[0]
        below = 0.5 * size_of(self.B, self.g.size) ** 2 / self.least * WIDER
        return self._known(Intervals(found.middle, (found.radius + below) * WIDER))

    @property
    def gradient(self) -> Intervals:
        """∂V/∂Θ at the centres, with |ξ| <= |B'g|/λ."""
        widths = widths_of(self.B, size_of(self.B, self.g.size) / self.least)
        near = self._results(self.boxes.centre, np.zeros_like(self.boxes.centre), widths)[-1]
        return self._known(jets.gradient(near)[:, :3])

    @property
    def hessian(self) -> Intervals:
        """The Hessian of V over the boxes."""
        bent = jets.hessian(self._over(self.widths))
        found, taken = bent[:, :3, :3], lost(self.B, bent[:, 3:, :3], self.least)
        return self._known(Intervals(found.middle, (found.radius + taken) * WIDER))

    def _known(self, bounds: Intervals) -> Intervals:
        """Return bounds without a number where nothing is proved."""
        proved = self.proved.reshape(-1, *[1] * (bounds.middle.ndim - 1))
        return Intervals(bounds.middle, np.where(proved, bounds.radius, np.inf))

    def _chosen(self) -> tuple[Array, Array]:
        """Return C, and B with B'HB near 1, both at the centres, to round-off."""
        around = _Around(self.boxes.centre, self.own, np.zeros((*self.own.shape, 3)))
        jet = computed(self.energy.program, around.variable, jets.combined)[-1]
        bent = jets.hessian(jet)
        usable = np.all(np.isfinite(bent), axis=(1, 2), keepdims=True)
        bent = np.where(usable, bent, np.eye(bent.shape[1]))
        return _slopes(bent), scaling(bent[:, 3:, 3:])

    def _deviation(self, widths: Array) -> Array:
        """Bound the entries of B'HB - 1 for |ζ| <= widths over the boxes, shape (m, n, n)."""
        H = jets.hessian(self._over(widths))[:, 3:, 3:]
        scaled = product(product(turned(self.B), H), exact(self.B))
        return (scaled + exact(-np.eye(self.energy.count))).size

    def _over(self, widths: Array) -> Jet:
        """Return W over the boxes, for all |ζ| <= widths."""
        found: Jet = self._results(self.boxes.centre, self.boxes.radius, widths, closer=True)[-1]
        return found

    def _results(
        self, centre: Array, radius: Array, widths: Array, *, closer: bool = False
    ) -> list[Jet]:
        """Return the results of all operations, for all |δ| <= radius and |ζ| <= widths."""
        spread = np.einsum("mki,mi->mk", np.abs(self.C), radius) + widths
        around = _Around(Intervals(centre, radius), Intervals(self.own, spread * WIDER), self.C)
        if not closer:
            return computed(self.energy.program, around.variable, jets.combined)
        centres, reach = iter(self.centres), np.concatenate([radius.T, widths.T])

        def tightened(make: Callable[..., Jet], *operands: object) -> Jet:
            return jets.tightened(make(*operands), next(centres), reach)

        leaf, combine = (partial(tightened, make) for make in (around.variable, jets.combined))
        return computed(self.energy.program, leaf, combine)


def _slopes(hessian: Array) -> Array:
    """Return ∂D/∂Θ = -H⁻¹ f_DΘ from the Hessian of f by Θ and D, shape (m, n, 3)."""
    return -_solved(hessian[:, 3:, 3:], hessian[:, 3:, :3])


def _solved(matrices: Array, right: Array) -> Array:
    """Return A⁻¹b; b where there is none."""
    usable = np.all(np.isfinite(matrices), axis=(1, 2), keepdims=True)
    safe = np.where(usable, matrices, np.eye(matrices.shape[-1]))
    columns = right[:, :, np.newaxis] if right.ndim == 2 else right
    try:
        found = np.linalg.solve(safe, columns)
    except np.linalg.LinAlgError:  # one of them is singular
        found = np.linalg.pinv(safe) @ columns
    found_: Array = found.reshape(right.shape)
    return found_
