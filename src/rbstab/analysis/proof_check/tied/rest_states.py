"""Check the rest states of a tied body in six variables: existence, index, and no other.

A box of Θ is examined with all z at which ∂W/∂z = 0. They are enclosed by z = -S⁻¹Σ w_j u_j, or by
Newton's method with ligaments and formulas, again and again, and halved where they are too many.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from typing import Any

from flint import arb, arb_mat

from rbstab.analysis.proof_check.boxes import AXES, Box, box_between
from rbstab.analysis.proof_check.claims import RestState, fault_of
from rbstab.analysis.proof_check.findings import Range
from rbstab.analysis.proof_check.tied.energy import SHIFT, SIX, Pose, Values
from rbstab.analysis.proof_check.tied.extent import BoundedEnergy
from rbstab.analysis.proof_check.trigonometric import Ball, misses_zero

NARROWINGS = 4
"""The number of times that z is enclosed before a box is tested."""

NARROW = 1e-6
"""rad: no rest state is looked for in a wider undecided box."""

STEPS = 8
"""The number of times that z is narrowed there."""

PROGRESS = 0.8
"""z is not narrowed again if no part became smaller than this part of what it was."""

MOST_PARTS = 60
"""The largest number of parts of z in a box of Θ; then the box of Θ is halved."""


def tied_states(claims: Mapping[str, Any]) -> list[RestState]:
    """Return the rest states that are claimed to be proved."""
    return [
        RestState(
            number,
            state["index"],
            bool(state["index_proved"]),
            state["orientation"],
            (*box_between(state["enclosure"]), *box_between(state["shift"])),
        )
        for number, state in enumerate(claims["states"], start=1)
        if state["proved"] and state.get("shift") is not None
    ]


class Expansion:
    """W about the centre of a box of Θ and z: ∇W = gradient + H δ, with H over all of the box."""

    def __init__(self, W: BoundedEnergy, box: Box, pose: Pose | None = None) -> None:
        self.pose = pose or Pose(W, box[:3])
        middle = [arb(low / 2 + high / 2) for low, high in box[3:]]
        whole = [arb(low).union(arb(high)) for low, high in box[3:]]
        z = [ball - point for ball, point in zip(whole, middle, strict=True)]
        self.box = box
        self.centre = [*self.pose.centre, *middle]
        self.step = arb_mat([[one] for one in [*self.pose.step, *z]])
        self.at_centre = self.pose.at(middle)
        self.over = self.pose.at(whole, "over")
        self.gradient = arb_mat([[one] for one in self.at_centre.gradient])
        self.hessian = self.over.hessian
        self.inverse = _inverse(self.at_centre.hessian)

    @property
    def residual(self) -> Any:
        """I - YH over the box; None if Y does not exist."""
        if self.inverse is None:
            return None
        unit = arb_mat([[arb(int(i == j)) for j in SIX] for i in SIX])
        return unit - self.inverse * self.hessian

    @property
    def is_unique(self) -> bool:
        """Whether |I - YH| has a norm below 1, in the norm of the radii of the box."""
        residual = self.residual
        if residual is None:
            return False
        radii = [one.abs_upper() for one in self.step.entries()]
        sums = [sum((residual[i, j].abs_upper() * radii[j] for j in SIX), arb(0)) for i in SIX]
        return all(total < radius for total, radius in zip(sums, radii, strict=True))

    @property
    def has_zero(self) -> bool:
        """Whether Krawczyk's map takes the box into its interior."""
        residual = self.residual
        if residual is None:
            return False
        image = residual * self.step - self.inverse * self.gradient
        found = [self.centre[i] + image[i, 0] for i in SIX]
        pairs = zip(self.box, found, strict=True)
        return all(arb(low) < one < arb(high) for (low, high), one in pairs)

    @property
    def excludes_zero(self) -> bool:
        """Whether ∇W, or Y∇W, has no zero in the box."""
        entries = (self.gradient + self.hessian * self.step).entries()
        if self.inverse is not None:
            turned = self.inverse * self.gradient + (self.inverse * self.hessian) * self.step
            entries += turned.entries()
        return any(map(misses_zero, entries))


def faults(W: BoundedEnergy, states: list[RestState], range_: Range) -> Iterator[str]:
    """Yield what is wrong with rest states."""
    for state in states:
        fault = _fault(W, state, range_)
        if fault is not None:
            yield f"Of {state.name}, {fault}."
    for i, one in enumerate(states):
        for other in states[:i]:
            if one.enclosure and _touches(one.enclosure, other.enclosure):
                yield f"The enclosures of {other.name} and {one.name} have a common point."


def _fault(W: BoundedEnergy, state: RestState, range_: Range) -> str | None:
    # Only an enclosure inside the range is expanded.
    expansion = cache(lambda: Expansion(W, state.enclosure))
    return fault_of(
        state,
        range_,
        unique=lambda: expansion().is_unique,
        exists=lambda: expansion().has_zero,
        index=lambda: index_of(expansion().at_centre.hessian),
    )


def index_of(H: Any) -> int | None:
    """Return the number of negative eigenvalues of a matrix from the signs of its leading minors.

    Jacobi: it is the number of changes of sign, if none of them is zero. The variables z come
    first, as their block is nearly S.
    """
    order = [3, 4, 5, 0, 1, 2]
    changes, last = 0, arb(1)
    for n in range(1, 7):
        minor = arb_mat([[H[i, j] for j in order[:n]] for i in order[:n]]).det()
        if not (minor > 0 or minor < 0):
            return None
        changes += bool((minor > 0) != (last > 0))
        last = minor
    return changes


def domain(W: BoundedEnergy, enclosure: Box) -> Box:
    """Return a large box about an enclosure in which there is no other zero."""
    share = 1.0
    scale = _scale(W)
    while share > 1e-12:
        pairs = zip(enclosure, scale, strict=True)
        wide: Box = tuple((low - share * one, high + share * one) for (low, high), one in pairs)
        if Expansion(W, wide).is_unique:
            return wide
        share *= 0.8
    return enclosure


def domain_of_undecided(W: BoundedEnergy, Theta: Box) -> Box | None:
    """Return a box of Θ and z with no rest state but one with Θ in an undecided box.

    It is None if no rest state is shown to be there, as there is on the border of a range.
    """
    if max(high - low for low, high in Theta) > NARROW:
        return None
    pose = Pose(W, Theta)
    z: Box | None = tuple((-_above(one), _above(one)) for one in W.scale)
    for _ in range(STEPS):
        z = None if z is None else _narrowed(pose, z, lambda _: False)
    if z is None:
        return None
    room = max(high - low for low, high in Theta) / 2
    wide = (
        (low - room * b, high + room * b) for (low, high), b in zip(z, _scale(W)[3:], strict=True)
    )
    enclosure = (*Theta, *wide)
    return domain(W, enclosure) if Expansion(W, enclosure).has_zero else None


def _scale(W: BoundedEnergy) -> list[float]:
    """Return 1 rad for each angle, and the bounds on z."""
    return [1.0, 1.0, 1.0, *(float(one) for one in W.scale)]


def no_zero(W: BoundedEnergy, Theta: Box, places: Sequence[Box]) -> bool:
    """Return whether a box of Θ has no zero of ∇W outside of some boxes of Θ and z."""
    pose = Pose(W, Theta)
    width = max(high - low for low, high in Theta)

    def settled(part: Box) -> bool:
        box = (*Theta, *part)
        return any(_within(box, place) for place in places) or Expansion(W, box, pose).excludes_zero

    def reason(values: Values) -> bool:
        return any(map(misses_zero, values.gradient))

    return all_settled(pose, W.scale, settled, reason, width)


def all_settled(
    pose: Pose, scale: Sequence[Ball], settled: Any, at_once: Any, width: float
) -> bool:
    """Return whether all z with ∂W/∂z = 0 are settled, for all Θ of a pose.

    Args:
        pose: The pose.
        scale: Bounds on |z_i| at these z.
        settled: Returns whether a box of z is.
        at_once: Returns the same of the values of W over it, which are cheaper.
        width: The largest width of the box of Θ, rad: wider parts of z are halved.
    """
    sizes_of_all = [float(one) for one in scale]
    pending: list[Box] = [tuple((-one, one) for one in map(_above, sizes_of_all))]
    for _ in range(MOST_PARTS):
        if not pending:
            return True
        part = pending.pop()
        found = _narrowed(pose, part, at_once)
        if found is None or settled(found):
            continue
        sizes = [(b - a) / size for (a, b), size in zip(found, sizes_of_all, strict=True)]
        axis = sizes.index(max(sizes))
        if sizes[axis] < width:
            return False
        low, high = found[axis]
        middle = low / 2 + high / 2
        before, after = found[:axis], found[axis + 1 :]
        pending += [(*before, (low, middle), *after), (*before, (middle, high), *after)]
    return not pending


def _narrowed(pose: Pose, part: Box, at_once: Any) -> Box | None:
    """Enclose the z of a box at which ∂W/∂z = 0; None if there is none, or it is settled."""
    z = [arb(low).union(arb(high)) for low, high in part]
    for _ in range(NARROWINGS):
        values = pose.at(z, "over")
        if at_once(values) or not values.balanced:
            return None
        bounds = [values.shift]
        if pose.W.is_smooth:
            bounds.append(_by_newton(pose, z, values))
        before = z
        for bound in bounds:
            if not all(one.overlaps(other) for one, other in zip(z, bound, strict=True)):
                return None
            z = [one.intersection(other) for one, other in zip(z, bound, strict=True)]
        # More of the same would change little.
        if all(one.rad() > PROGRESS * old.rad() for one, old in zip(z, before, strict=True)):
            break
    return tuple((_below(one), _above(one)) for one in z)


def block_of_shift(values: Values) -> Any:
    """Return the part of the Hessian for z."""
    hessian = values.hessian
    return arb_mat([[hessian[i, j] for j in SHIFT] for i in SHIFT])


def _by_newton(pose: Pose, z: Sequence[Ball], values: Values) -> list[Ball]:
    """Return balls with all z at which ∂W/∂z = 0: m - Yg(Θ, m) + (I - YH)(z - m), g = ∂W/∂z.

    Args:
        pose: The pose.
        z: The balls of z, with the middle m.
        values: W over them; H is the part of its Hessian for z, and Y near its inverse.
    """
    H = block_of_shift(values)
    inverse = _inverse(H)
    if inverse is None:
        return list(z)
    middle = [one.mid() for one in z]
    away = arb_mat([[one - point] for one, point in zip(z, middle, strict=True)])
    g = arb_mat([[one] for one in pose.at(middle, "over").gradient[3:]])
    unit = arb_mat([[arb(int(i == j)) for j in AXES] for i in AXES])
    image = (unit - inverse * H) * away - inverse * g
    found = [point + image[i, 0] for i, point in enumerate(middle)]
    return [new if new.is_finite() else old for new, old in zip(found, z, strict=True)]


def _below(number: Any) -> float:
    return -_above(-number)


def _above(number: Any) -> float:
    """Return a double above a ball or a double."""
    return math.nextafter(float(arb(number).upper()), math.inf)


def _inverse(H: Any) -> Any:
    try:
        inverse = H.mid().inv().mid()
    except ZeroDivisionError:
        return None
    return inverse if all(entry.is_finite() for entry in inverse.entries()) else None


def _within(box: Box, other: Box) -> bool:
    return all(c <= a and b <= d for (a, b), (c, d) in zip(box, other, strict=True))


def _touches(box: Box, other: Box) -> bool:
    return all(a <= d and c <= b for (a, b), (c, d) in zip(box, other, strict=True))
