"""The least energy of an element of a user over its own states, as a part of a reduced energy.

    V(Θ) = min over D of f(Θ, D)

The body is held, so Θ fixes its position. f is convex in D, by the form of its formula. So it is
least where ∂f/∂D = 0, at one D if the Hessian H by D is positive definite there. Let m be the
centre of a box, δ = Θ - m, D̂ near the D at m, and C near ∂D/∂Θ there. With D = D̂ + Cδ + ζ and
W(Θ, ζ) = f, derivatives along Θ at constant ζ,

    ∂V/∂θ_i = W_i        ∂²V/∂θ_i∂θ_j = W_ij - W_iζ H⁻¹ W_ζj        where W_ζ = 0.

`lowest_point` bounds ζ over the box; without a bound, V has none there either.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from types import MappingProxyType
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
HALVINGS = 100
"""The largest numbers of Newton's steps, and of halvings of one of them."""

ROOMS = (2.0, 8.0)
"""The bounds that are tried for ξ are so many times |B'g|."""

CONVERGED = 1e-8
"""A step that is so short, relative to the longest one, is the last: it reaches round-off."""

BOX_LIMIT = 20_000
"""The boxes over which the bounds of all the range are computed at most."""

FAR_ABOVE = 3.0
"""Bounds are closer than so many times the largest magnitude at points, if this limit allows."""


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
        f = _OfOwnStates(self, Theta)
        D, left = np.zeros((len(Theta), self.count)), np.arange(len(Theta))
        found, longest = f.at(left, D), np.zeros(len(Theta))
        for _ in range(MAX_STEPS):
            step = -_solved(jets.hessian(found), jets.gradient(found))
            going = np.abs(step).max(axis=1) > CONVERGED * longest[left]
            tried = f.at(left, D[left] + step).rows
            worse = np.flatnonzero(going & ~_is_lower(tried, found.rows, self.count))
            for _ in range(HALVINGS):
                if not len(worse):
                    break
                step[worse] *= 0.5
                tried[:, worse] = f.at(left[worse], D[left[worse]] + step[worse]).rows
                lower = _is_lower(tried[:, worse], found.rows[:, worse], self.count)
                worse = worse[~lower]
            step[worse], going[worse] = 0.0, False  # as low as round-off allows
            D[left] += step
            longest[left] = np.maximum(longest[left], np.abs(step).max(axis=1))
            left, found = left[going], Jet(tried[:, going])
            if not len(left):
                break
        return D

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
        one = _Enclosure(self, boxes)
        slopes = one.slopes.size
        over = one.value.size + (slopes * boxes.radius).sum(axis=1) * WIDER
        return np.column_stack([over, slopes])

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


class _OfOwnStates:
    """f as a function of D alone, to round-off.

    Args:
        energy: V.
        Theta: The points, shape (m, 3).
    """

    def __init__(self, energy: OwnStatesEnergy, Theta: Array) -> None:
        self.energy, program = energy, energy.program

        def leaf(operation: Operation) -> Jet:
            kind, number = operation
            found = jets.constant(0.0, Theta[:, 0], energy.count)
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
            return jets.variable(D[:, operation[1]], operation[1], self.energy.count)

        found: Jet = computed(self.energy.program, leaf, jets.combined, known)[-1]
        return found


class _Enclosure:
    """The bounds over some boxes; no numbers where nothing bounds ζ.

    Args:
        energy: V.
        boxes: The boxes of Θ.
    """

    def __init__(self, energy: OwnStatesEnergy, boxes: Boxes) -> None:
        self.energy, self.centre, self.radius = energy, boxes.centre, boxes.radius
        self.own, nothing = energy.lowest(boxes.centre), np.zeros((len(boxes), energy.count))
        self.C, self.B = self._chosen()
        self.at_centre = self._results(np.zeros_like(self.radius), nothing)
        self.over = self._results(self.radius, nothing, self.at_centre)
        self.g = jets.gradient(self.at_centre[-1])[:, 3:]
        mixed = jets.hessian(self.over[-1])[:, 3:, :3]
        loads = load(self.B, self.g, mixed, boxes.radius)
        self.lowest = lowest_point(self.B, loads, ROOMS[0], self._bend)
        for room in ROOMS[1:]:
            if self.lowest.proved.all():
                break
            further = lowest_point(self.B, loads, room, self._bend)
            self.lowest = self.lowest.or_else(further)

    @property
    def value(self) -> Intervals:
        """V at the centres: at most ½ |B'g|²/λ below W at ζ = 0, as B'HB >= λ between them."""
        found = self.at_centre[-1].rows[0]
        below = 0.5 * size_of(self.B, self.g.size) ** 2 / self.lowest.least * WIDER
        return self._known(Intervals(found.middle, (found.radius + below) * WIDER))

    @property
    def gradient(self) -> Intervals:
        """∂V/∂Θ at the centres, with |ξ| <= |B'g|/λ."""
        widths = widths_of(self.B, size_of(self.B, self.g.size) / self.lowest.least)
        near = self._with_own(self.at_centre, np.zeros_like(self.radius), widths)
        return self._known(jets.gradient(near)[:, :3])

    @property
    def slopes(self) -> Intervals:
        """∂V/∂Θ over the boxes."""
        return self._known(jets.gradient(self._around_lowest)[:, :3])

    @cached_property
    def _around_lowest(self) -> Jet:
        """W over the boxes, for all ζ at which it may be least."""
        return self._within(self.lowest.widths)

    @property
    def hessian(self) -> Intervals:
        """The Hessian of V over the boxes."""
        bent = jets.hessian(self._around_lowest)
        found, taken = bent[:, :3, :3], lost(self.B, bent[:, 3:, :3], self.lowest.least)
        return self._known(Intervals(found.middle, (found.radius + taken) * WIDER))

    def _known(self, bounds: Intervals) -> Intervals:
        """Return bounds without a number where nothing is proved."""
        proved = self.lowest.proved.reshape(-1, *[1] * (bounds.middle.ndim - 1))
        return Intervals(bounds.middle, np.where(proved, bounds.radius, np.inf))

    def _chosen(self) -> tuple[Array, Array]:
        """Return C, and B with B'HB near 1, both at the centres, to round-off."""
        around = _Around(self.centre, self.own, np.zeros((*self.own.shape, 3)))
        jet = computed(self.energy.program, around.variable, jets.combined)[-1]
        bent = jets.hessian(jet)
        usable = np.all(np.isfinite(bent), axis=(1, 2), keepdims=True)
        bent = np.where(usable, bent, np.eye(bent.shape[1]))
        return _slopes(bent), scaling(bent[:, 3:, 3:])

    def _bend(self, widths: Array) -> Intervals:
        """Return bounds on B'HB for |ζ| <= widths over the boxes, shape (m, n, n)."""
        H = jets.hessian(self._within(widths))[:, 3:, 3:]
        return product(product(turned(self.B), H), exact(self.B))

    def _within(self, widths: Array) -> Jet:
        """Return W over the boxes, for all |ζ| <= widths."""
        return self._with_own(self.over, self.radius, widths, self.at_centre)

    def _with_own(
        self, known: Sequence[Jet], radius: Array, widths: Array, about: Sequence[Jet] = ()
    ) -> Jet:
        """Return W for all |δ| <= radius and |ζ| <= widths; what has no D in it is known."""
        fixed = {place: known[place] for place in self.energy.program.fixed}
        return self._results(radius, widths, about, fixed)[-1]

    def _results(
        self,
        radius: Array,
        widths: Array,
        about: Sequence[Jet] = (),
        known: Mapping[int, Jet] = MappingProxyType({}),
    ) -> list[Jet]:
        """Return the results of all operations, for all |δ| <= radius and |ζ| <= widths.

        Args:
            radius: The radii of the boxes, shape (m, 3).
            widths: Bounds on |ζ|, shape (m, n).
            about: The results at the centres, for closer bounds.
            known: Results that are known, by their places.
        """
        spread = np.einsum("mki,mi->mk", np.abs(self.C), radius) + widths
        own = Intervals(self.own, spread * WIDER)
        around = _Around(Intervals(self.centre, radius), own, self.C)
        program, reach = self.energy.program, np.concatenate([radius.T, widths.T])
        if not about:
            return computed(program, around.variable, jets.combined, known)
        places = (place for place in range(len(program.operations)) if place not in known)

        def tightened(make: Callable[..., Jet], *operands: object) -> Jet:
            return jets.tightened(make(*operands), about[next(places)], reach)

        leaf, combine = (partial(tightened, make) for make in (around.variable, jets.combined))
        return computed(program, leaf, combine, known)


def _is_lower(rows: Array, before: Array, count: int) -> Array:
    """Return whether a step lowers the energy or, where that is only round-off, its slopes."""
    steep, steep_before = (np.abs(one[1 : 1 + count]).max(axis=0) for one in (rows, before))
    found: Array = (rows[0] < before[0]) | (steep < steep_before)
    return found


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
