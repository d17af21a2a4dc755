"""A formula of the three angles, given by its operations, with derivatives up to order 2 in balls.

An operation is a list of its kind and its operands: ["theta", axis], ["constant", number], or a
kind and the places of earlier operations, as in ["*", 0, 3] or ["sin", 2]. That of "**" are a place
and a whole number. A constant stands for all numbers that round to it. "square_above" is
max(x, 0)², which has a continuous slope.
"""

from collections.abc import Callable, Mapping, Sequence
from itertools import product
from types import MappingProxyType
from typing import Any

from flint import arb, arb_mat

from rbstab.analysis.proof_check.boxes import AXES
from rbstab.analysis.proof_check.formulas import series
from rbstab.analysis.proof_check.formulas.series import Series
from rbstab.analysis.proof_check.trigonometric import Ball, rounded

MOST_OPERATIONS = 5_000

MOST_POWER = 16

PARTS = (12, 6, 12)
"""The boxes by axis over which the steepest slopes are bounded."""

MOST_PARTS = 5_000
"""The most boxes for this; those without a bound are halved along each axis until then."""

VARIABLES = frozenset({"theta", "length"})
"""The kinds of variables: angles, and entries of X, of which a reduced energy has none."""

Operation = tuple[Any, ...]

BINARY = frozenset({"+", "-", "*", "/"})


class Over:
    """E over a box: its value and slopes at the centre, and all three over the whole box.

    Args:
        at_centre: The Taylor polynomial at the centre.
        whole: That over the box.
    """

    def __init__(self, at_centre: Series, whole: Series) -> None:
        self.value = at_centre[series.ZERO]
        self.gradient = [series.slope(at_centre, i) for i in AXES]
        self.hessian = arb_mat([[series.curvature(whole, i, j) for j in AXES] for i in AXES])
        self.values = whole[series.ZERO]
        self.slopes = [series.slope(whole, i) for i in AXES]


class Formula:
    """The energy E(Θ) of an element of a user.

    Args:
        data: Its name and its operations.

    Raises:
        ValueError: They are no formula.
    """

    def __init__(self, data: Mapping[str, Any]) -> None:
        self.operations = operations_of(data, {"theta": 3})
        self._middle: tuple[tuple[Any, ...], list[Series]] | None = None
        self._steepest: list[Ball] | None = None

    @property
    def cost(self) -> int:
        """How many evaluations of an energy of sines and cosines take as long."""
        return 1 + len(self.operations) // 12

    @property
    def periodic(self) -> bool:
        """Whether θ1 and θ3 are used in sines and cosines alone, so that whole turns do nothing."""
        return is_periodic(self.operations)

    def value(self, Theta: Sequence[Ball]) -> Ball:
        """Return E at a ball of Θ."""
        return self._series(Theta)[series.ZERO]

    def switches(self, Theta: Sequence[Ball]) -> list[Ball]:
        """Return at a point what changes its sign where the formula switches."""
        found = self._at(Theta)
        above = (one[1] for one in self.operations if one[0] == "square_above")
        return [found[place][series.ZERO] for place in above]

    def over(self, centre: Sequence[Ball], step: Sequence[Ball]) -> "Over":
        """Return E over the box of all Θ = centre + step."""
        whole = self._series([point + ball for point, ball in zip(centre, step, strict=True)])
        return Over(self._series(centre), whole)

    def steepest(self, axis: int) -> Ball:
        """Bound the derivative along an axis for |θ2| <= π/2, and |θ1| and |θ3| <= π."""
        if self._steepest is None:

            def slopes(box: Sequence[Ball]) -> Sequence[Ball]:
                found = self._series(box)
                return [series.slope(found, k) for k in AXES]

            self._steepest = bounds_over_parts(slopes)
        return self._steepest[axis]

    def _series(self, Theta: Sequence[Ball]) -> Series:
        """Return the Taylor polynomial; over a wide ball, also bounded about its middle."""
        middle = [angle.mid() for angle in Theta]
        step = tuple(angle - point for angle, point in zip(Theta, middle, strict=True))
        if all(one == 0 for one in step):
            return self._at(middle)[-1]
        return self._computed(Theta, self._at(middle), step)[-1]

    def _at(self, point: Sequence[Ball]) -> list[Series]:
        """Return the results of all operations at a point; those of the last one are kept."""
        key = tuple((angle.man_exp()) for angle in point)
        if self._middle is None or self._middle[0] != key:
            self._middle = (key, self._computed(point))
        return self._middle[1]

    def _computed(
        self,
        Theta: Sequence[Ball],
        middle: Sequence[Series] = (),
        step: tuple[Ball, ...] = (),
    ) -> list[Series]:
        def leaf(_: str, axis: int) -> Series:
            return series.variable(Theta[axis], axis)

        return computed(self.operations, leaf, middle, step)


def bounds_over_parts(slopes: Callable[[Sequence[Ball]], Sequence[Ball]]) -> list[Ball]:
    """Bound the slopes by those over boxes; boxes without a bound are halved, a few times.

    Args:
        slopes: Returns the three slopes over a box.
    """
    ends = [3.1416, 1.5708, 3.1416]
    pending = [
        [
            arb(-end + 2 * end * (place + 0.5) / count, 1.001 * end / count)
            for end, place, count in zip(ends, places, PARTS, strict=True)
        ]
        for places in product(*(range(count) for count in PARTS))
    ]
    sizes, examined = [arb(0)] * 3, 0
    while pending:
        examined += len(pending)
        left = []
        for box in pending:
            found = slopes(box)
            if all(one.is_finite() for one in found):
                sizes = _larger(sizes, found)
            else:
                left.append((box, found))
        # Where a formula has no value at all, as tan θ2 at ±π/2, no box is small enough.
        if examined + 2**3 * len(left) > MOST_PARTS:
            for _, found in left:
                sizes = _larger(sizes, found)
            break
        pending = [half for box, _ in left for half in _halves(box)]
    return sizes


def _larger(sizes: Sequence[Ball], slopes: Sequence[Ball]) -> list[Ball]:
    """Return the larger ones of bounds on slopes and of the sizes of others; a NaN has no bound."""
    bounds = (one.abs_upper() if one.is_finite() else arb.pos_inf() for one in slopes)
    return [size.max(one) for size, one in zip(sizes, bounds, strict=True)]


def _halves(box: Sequence[Ball]) -> list[list[Ball]]:
    """Return the eight parts of a box that is halved along each axis."""
    sides = [[one.mid() + side * one.rad() * arb(0.5, 0.5) for side in (-1, 1)] for one in box]
    return [list(part) for part in product(*sides)]


def computed(
    operations: Sequence[Operation],
    leaf: Callable[[str, int], Series],
    middle: Sequence[Series] = (),
    step: tuple[Ball, ...] = (),
    known: Mapping[int, Series] = MappingProxyType({}),
) -> list[Series]:
    """Return the results of all operations as Taylor polynomials.

    Args:
        operations: The operations.
        leaf: Returns a variable, from its kind and its number.
        middle: The results at the middle of a box; with them, bounds over the box are closer.
        step: The balls of y - m over this box.
        known: Results that need not be computed, by their places.
    """
    found: list[Series] = []
    for place, operation in enumerate(operations):
        kind, first, *others = operation
        if place in known:
            one = known[place]
        elif kind in VARIABLES:
            one = leaf(kind, first)
        elif kind == "constant":
            one = {series.ZERO: rounded(first)}
        else:
            operands = [found[k] for k in _operands(operation)]
            one = _combined(kind, operands, others)
            if middle:
                one = series.closer(one, middle[place], step)
        found.append(one)
    return found


def parts_fixed(operations: Sequence[Operation]) -> set[int]:
    """Return the places of the operations that depend on Θ alone."""
    found = set[int]()
    for place, operation in enumerate(operations):
        if operation[0] != "length" and found.issuperset(_operands(operation)):
            found.add(place)
    return found


def is_periodic(operations: Sequence[Operation]) -> bool:
    """Return whether θ1 and θ3 are used in sines and cosines alone."""
    turning = {k for k, one in enumerate(operations) if one in {("theta", 0), ("theta", 2)}}
    others = (one for one in operations if one[0] not in {"sin", "cos"})
    used = {place for one in others for place in _operands(one)}
    return turning.isdisjoint(used | {len(operations) - 1})


def _combined(kind: str, operands: Sequence[Series], others: Sequence[int]) -> Series:
    """Return the result of an operation."""
    f, *rest = operands
    if kind == "neg":
        return series.scaled(f, arb(-1))
    if kind == "**":
        return series.through(series.power(f[series.ZERO], others[0]), f)
    if not rest:
        return series.through(series.FUNCTIONS[kind](f[series.ZERO]), f)
    (g,) = rest
    if kind in {"+", "-"}:
        return series.added(f, g, 1 if kind == "+" else -1)
    if kind == "*":
        return (
            series.through(series.power(f[series.ZERO], 2), f) if f is g else series.product(f, g)
        )
    return series.product(f, series.through(series.power(g[series.ZERO], -1), g))


def _operands(operation: Sequence[Any]) -> Sequence[int]:
    """Return the places of the operations that an operation needs."""
    kind, *operands = operation
    if kind in VARIABLES or kind == "constant":
        return ()
    return operands[:1] if kind == "**" else operands


def operations_of(data: Mapping[str, Any], variables: Mapping[str, int]) -> list[Operation]:
    """Return the operations of a formula.

    Args:
        data: Its name and its operations.
        variables: The kinds of variables on which it may depend, and how many there are of each.

    Raises:
        ValueError: They are no formula.
    """
    operations = [tuple(one) for one in data["operations"]]
    if not 0 < len(operations) <= MOST_OPERATIONS:
        raise ValueError(f"A formula has none, or more than {MOST_OPERATIONS} operations")
    for place, operation in enumerate(operations):
        kind, *operands = operation
        if kind in variables:
            valid = len(operands) == 1 and operands[0] in range(variables[kind])
        elif kind == "constant":
            valid = len(operands) == 1 and isinstance(operands[0], float)
        elif kind == "**":
            valid = len(operands) == 2 and abs(operands[1]) <= MOST_POWER
        else:
            known = kind in BINARY | {"neg"} | set(series.FUNCTIONS)
            valid = known and len(operands) == (2 if kind in BINARY else 1)
        if not valid or not all(type(k) is int and 0 <= k < place for k in _operands(operation)):
            raise ValueError(f"Operation {place} of a formula is none")
    return operations
