"""All rest states in a range: the zeros of smooth gradients, one search for each piece of it.

Where the force jumps at surfaces h = 0, the energy is smooth on each side of them: a step is a
number there, 0 or 1. On a surface, L(Θ, λ) is the energy with λ in place of its step. The gradient
of L by Θ is that of U with a share λ of the jump, and its slope by λ is the jump in energy, which
is zero where h = 0. So the body rests on the surface where ∇L = 0 and 0 < λ < 1: the same search,
with one more variable. Where two surfaces meet, nothing is shown but that forces do not balance.
At a stop, θ2 is a number, and ∂U/∂θ2 has to press against it.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import product

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.proof.boxes import Box, Boxes, as_boxes, joined
from rbstab.proof.enclosures.bounds import UP, BoundedEnergy, Bounds
from rbstab.proof.enclosures.intervals import Intervals, constant
from rbstab.proof.exact.atoms import STEP, VAR, Atom
from rbstab.proof.exact.expr import atom, expr, variable
from rbstab.proof.exact.rewriting import substituted
from rbstab.proof.model import THETA, Energy
from rbstab.proof.search import Search, Zeros
from rbstab.proof.zeros import Zero, ordered

LAMBDA = 1000
"""The number of the variable λ."""

STARTS = 1024
"""Random points from which zeros are looked for."""

UPWARDS = np.array([0.0, 1.0, 0.0])
"""Across the surface at which a stop holds θ2."""

REACH = 1e-6
"""rad: along a line of this length, a state is shown to lie on a surface."""

Condition = Callable[[Boxes], Intervals]
"""Returns bounds over boxes of Θ on what must be positive at a rest state."""


def _same(boxes: Boxes) -> Boxes:
    return boxes


@dataclass(frozen=True, eq=False)
class Piece:
    """A part of a range on which rest states are zeros of one smooth gradient.

    Args:
        V: The energy on it.
        box: The box of its variables.
        conditions: What holds on it.
        whole: Returns boxes of Θ for boxes of its variables.
        state: Returns a zero as a rest state; None if it is not shown to be one.
    """

    V: BoundedEnergy
    box: Box
    conditions: Sequence[Condition] = ()
    whole: Callable[[Boxes], Boxes] = _same
    state: Callable[[Zero], Zero | None] = lambda zero: zero

    def zeros(self, limit: int, seed: int = 0) -> Zeros:
        """Return the rest states on it; arguments as for `rest_zeros`."""
        search = Search(self.V, self.box, also=self._is_elsewhere)
        searched = search.run(limit)
        if searched.undecided.count and searched.stopped:
            searched = search.with_zeros_near(random_points(self.box, seed))
        zeros, undecided = list[Zero](), [self.whole(searched.undecided)]
        for zero in searched.zeros:
            at = self.whole(as_boxes(zero.enclosure))
            over = [condition(at) for condition in self.conditions]
            if any(interval.hi[0] < 0 for interval in over):
                continue
            state = self.state(zero) if all(interval.lo[0] > 0 for interval in over) else None
            if state is None:
                undecided.append(at)
            else:
                zeros.append(state)
        return replace(searched, zeros=tuple(zeros), undecided=joined(undecided, 3))

    def _is_elsewhere(self, boxes: Boxes, _: Bounds) -> Array:
        whole, elsewhere = self.whole(boxes), np.zeros(boxes.count, dtype=bool)
        for condition in self.conditions:
            elsewhere |= condition(whole).hi < 0
        return elsewhere


def jumps(energy: Energy) -> list[Atom]:
    """Return the steps at which the force jumps, in order."""
    steps = [a for a in energy.U.all_atoms if a.kind == STEP and a.extra == 1]
    return sorted(steps, key=lambda a: a.order)


def rest_zeros(energy: Energy, V: BoundedEnergy, box: Box, limit: int, *, seed: int = 0) -> Zeros:
    """Return all rest states in a box of Θ, also those at which a jump or a stop holds the body.

    Args:
        energy: The energy.
        V: Bounds on it.
        box: The box.
        limit: The number of boxes at which the search stops; 0 to look for zeros alone.
        seed: The seed of random points from which zeros are looked for.
    """
    steps = [] if energy.free else jumps(energy)
    pieces = list(_sides(energy, box, steps)) if steps else [Piece(V, box)]
    if energy.stop is not None:
        pieces += [face_at_stop(energy, box, side) for side in (-1, 1)]
    by_piece, examined = list[Zeros](), 0
    for piece in pieces:
        by_piece.append(piece.zeros(max(0, limit - examined), seed))
        examined += by_piece[-1].examined
    return Zeros(
        ordered(zero for zeros in by_piece for zero in zeros.zeros),
        joined([zeros.undecided for zeros in by_piece], 3),
        examined,
        any(zeros.family for zeros in by_piece),
        min(zeros.share for zeros in by_piece),
        tuple(x for zeros in by_piece for x in zeros.singular if len(x) == 3),
        any(zeros.stopped for zeros in by_piece),
    )


def random_points(box: Box, seed: int) -> Array:
    """Return the middle of a box and random points of it, shape (n, points)."""
    middle, radius = 0.5 * (box.lo + box.hi), 0.5 * (box.hi - box.lo)
    points = np.random.default_rng(seed).uniform(-1, 1, (len(middle), STARTS))
    points[:, 0] = 0.0
    return middle[:, None] + points * radius[:, None]


# -- surfaces ---------------------------------------------------------------------------------


def _sides(energy: Energy, box: Box, steps: Sequence[Atom]) -> Iterator[Piece]:
    """Yield the sides of all surfaces, and each surface."""
    heights = [BoundedEnergy(step.inner, least=energy.least) for step in steps]
    for signs in product((-1, 1), repeat=len(steps)):
        numbers = {step: expr(int(sign > 0)) for step, sign in zip(steps, signs, strict=True)}
        V = BoundedEnergy(substituted(energy.U, numbers), least=energy.least)
        beside = [partial(_above, h, sign) for h, sign in zip(heights, signs, strict=True)]
        yield Piece(V, box, beside)
    for step, h in zip(steps, heights, strict=True):
        # Where another surface meets it, the other step is any number from 0 to 1.
        yield _surface(energy, box, step, h)


def _above(h: BoundedEnergy, sign: int, boxes: Boxes) -> Intervals:
    return _signed(h.over(*boxes).value_over, sign)


def _signed(of: Intervals, sign: int) -> Intervals:
    return of if sign > 0 else Intervals(-of.hi, -of.lo)


def _surface(energy: Energy, box: Box, step: Atom, h: BoundedEnergy) -> Piece:
    """Return the surface h = 0 at which a step changes."""
    before, after, shared = (
        substituted(energy.U, {step: share}) for share in (expr(0), expr(1), variable(LAMBDA))
    )
    jump = BoundedEnergy(after - before, least=energy.least)

    def is_met(boxes: Boxes) -> Intervals:
        over = h.over(*boxes).value_over
        sign = np.where((over.lo <= 0) & (over.hi >= 0), 1.0, -1.0)
        return Intervals(sign, sign)

    def angles(boxes: Boxes) -> Boxes:
        return Boxes(boxes.lo[:3], boxes.hi[:3])

    def held(zero: Zero) -> Zero | None:
        """Return a zero of ∇L with h = 0."""
        x, at = zero.point[:3], angles(as_boxes(zero.enclosure))
        # Along the normal n, the jump in energy rises or falls strictly. So if h reaches 0 on the
        # line through this point, as n'∇h is large enough, the jump is zero only there.
        normal = h.at(x[:, None])[1][:, 0]
        near = as_boxes(Box(x - REACH, x + REACH))
        rise, turn = (_along(normal, bounded.over(*near).slopes) for bounded in (h, jump))
        with np.errstate(all="ignore"):
            way = h.over(*at).value_over.mag / rise.lo * np.abs(normal).max()
        if not 0 <= way < 0.9 * (REACH - (at.hi - at.lo).max()) or turn.lo <= 0 <= turn.hi:
            return None
        ridge, enclosure = bool(turn.hi < 0), Box(at.lo[:, 0], at.hi[:, 0])
        # ∇²L has one negative eigenvalue more than the Hessian along the surface.
        index = None if zero.index is None else zero.index - 1 + ridge
        return Zero(x, enclosure, enclosure, index, zero.energy, normal, ridge)

    V = BoundedEnergy(shared, (*THETA, LAMBDA), least=energy.least)
    with_share = Box(np.append(box.lo, 0.0), np.append(box.hi, 1.0))
    return Piece(V, with_share, [is_met], angles, held)


def _along(normal: Array, g: Intervals) -> Intervals:
    """Return bounds on n'∇h for the three angles."""
    mid = normal @ g.mid
    rad = np.abs(normal) @ (g.rad + 1e-14 * np.abs(g.mid)) * UP
    return Intervals(mid - rad, mid + rad)


# -- stops ------------------------------------------------------------------------------------


def face_at_stop(energy: Energy, box: Box, side: int) -> Piece:
    """Return the end of θ2 at a stop; the body rests there if U falls outwards.

    Args:
        energy: The energy, with a stop.
        box: The box of Θ.
        side: The sign of θ2 there.
    """
    assert energy.stop is not None
    exact = side * energy.stop
    lo, hi = constant(exact)
    face = substituted(energy.U, {atom(VAR, 1): expr(exact)})
    V = BoundedEnergy(energy.U, free=energy.free, least=energy.least)

    def whole(boxes: Boxes) -> Boxes:
        return Boxes(
            *(np.insert(x, 1, end, axis=0) for x, end in zip(boxes, (lo, hi), strict=True))
        )

    def presses(boxes: Boxes) -> Intervals:
        return _signed(V.over(*boxes).slopes[1], -side)

    def held(zero: Zero) -> Zero:
        at = whole(as_boxes(zero.enclosure))
        around, point = Box(at.lo[:, 0], at.hi[:, 0]), np.insert(zero.point, 1, float(exact))
        return replace(zero, point=point, enclosure=around, domain=around, normal=UPWARDS)

    flat = Box(np.delete(box.lo, 1), np.delete(box.hi, 1))
    return Piece(BoundedEnergy(face, (0, 2), free=energy.free), flat, [presses], whole, held)
