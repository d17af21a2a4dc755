"""The program of the process in which codac checks claims: it imports nothing but codac.

Importing codac makes the whole process round upward, which the rest of rbstab must not do, and in a
thread that was started before its intervals are wrong. So this file is run by its path, and gets
plain data on stdin: the energy, as the operations of `recorded`, and the claims. Doubles are in
hexadecimal, as reading decimals depends on the rounding. The answers on stdout are JSON:
[range, claim, verdict, text] of each claim, as soon as it is decided.
"""

import json
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from fractions import Fraction
from typing import Any

import codac
from codac import AnalyticFunction, EvalMode, Interval, IntervalMatrix, IntervalVector, PavingOut

PROVED, REFUTED, OPEN = "proved", "refuted", "not decided"

SIZES, ON_FACE = (0.1, 0.01, 0.001, 0.0001), (0.1, 0.004, 0.0004)
"""The sizes to which codac's solver cuts boxes, rad, one after the other: in the range, and on its
faces, where U has a minimum near which it cannot tell U from a level."""

RADII = [10.0 ** (k / 2 - 13) for k in range(27)]
"""Of the boxes about a point in which a zero is looked for, rad: up to 1."""

WIDER = [1e-6 * 1.15**k for k in range(100)]
"""By how much a box about a zero is widened in which there is no other, rad: up to 1."""

MOST_TRIED = 64
"""Boxes that are left in which another zero is looked for."""

Expression = Any
Box = Any


def near(number: int) -> Any:
    """Return the interval of a whole number, which may be no double."""
    x = float(number)
    exact = int(x) == number
    return Interval(x) if exact else Interval(codac.prev_float(x), codac.next_float(x))


def interval_of(text: str) -> Any:
    """Return an interval about a rational number."""
    number = Fraction(text)
    return near(number.numerator) / near(number.denominator)


def plus(a: Expression | None, b: Expression | None) -> Expression | None:
    """Return a sum; None is zero."""
    return b if a is None else a if b is None else a + b


class Jet:
    """An expression of Θ and its three derivatives, each None where it is zero."""

    def __init__(self, value: Expression, slopes: Sequence[Expression | None]) -> None:
        self.value, self.slopes = value, list(slopes)

    def times(self, factor: Expression, value: Expression) -> "Jet":
        """Return another value with these derivatives times a factor."""
        return Jet(value, [None if g is None else factor * g for g in self.slopes])


def energy(operations: Sequence[Sequence[Any]], x: Any) -> Jet:
    """Return U and its derivatives as expressions of codac."""
    found: list[Jet] = []
    for kind, *rest in operations:
        if kind == "var":
            slopes = [Interval(1) if k == rest[0] else None for k in range(3)]
            found.append(Jet(x[rest[0]], slopes))
        elif kind == "sum":
            total = Jet(interval_of(rest[0]) + 0 * x[0], [None] * 3)
            for c, k in zip(rest[1::2], rest[2::2], strict=True):
                term = found[k].times(interval_of(c), interval_of(c) * found[k].value)
                slopes = [plus(a, b) for a, b in zip(total.slopes, term.slopes, strict=True)]
                total = Jet(total.value + term.value, slopes)
            found.append(total)
        elif kind == "times":
            one, two = found[rest[0]], found[rest[1]]
            left, right = two.times(one.value, None), one.times(two.value, None)
            slopes = [plus(a, b) for a, b in zip(left.slopes, right.slopes, strict=True)]
            found.append(Jet(one.value * two.value, slopes))
        else:
            of = found[rest[-1]]
            pitch = list(operations[rest[-1]]) == ["var", 1]
            value, slope = function(kind, of.value, rest[0], pitch=pitch)
            found.append(Jet(value, [None] * 3) if slope is None else of.times(slope, value))
    return found[-1]


def function(
    kind: str, x: Expression, n: int, *, pitch: bool
) -> tuple[Expression, Expression | None]:
    """Return a function of an expression, which may be θ2, and its derivative; None is zero."""
    if kind in {"sin", "cos"}:
        sine, cosine = codac.sin(x), codac.cos(x)
        # cos θ2 is not negative in the range, so that a barrier has one sign up to its ends.
        cosine = codac.max(cosine, Interval(0) + 0 * x) if pitch else cosine
        return (sine, cosine) if kind == "sin" else (cosine, -sine)
    if kind == "pow":
        return power(x, n), near(n) * power(x, n - 1)
    if kind == "step":
        return codac.chi(x, 0 * x, Interval(1) + 0 * x), None
    value = getattr(codac, kind)(x)
    slopes: dict[str, Callable[[], Expression]] = {
        "exp": lambda: value,
        "log": lambda: 1 / x,
        "sqrt": lambda: Interval(0.5) / value,
        "atan": lambda: 1 / (1 + codac.sqr(x)),
    }
    return value, slopes[kind]()


def power(x: Expression, n: int) -> Expression:
    """Return a whole power."""
    if n < 0:
        return 1 / power(x, -n)
    return [Interval(1) + 0 * x, x, codac.sqr(x)][n] if n <= 2 else codac.pow(x, n)


class Body:
    """U and ∇U of a body, for codac's solver.

    Args:
        data: The energy, and the time after which claims are not decided, s.
    """

    def __init__(self, data: dict[str, Any]) -> None:
        self.x = codac.VectorVar(3)
        self.jet = energy(data["operations"], self.x)
        self.stop = data["stop"]
        self.end_time = time.process_time() + data["seconds"]
        self.U = AnalyticFunction([self.x], self.jet.value)
        self.slopes = [0 * self.x[0] if g is None else g for g in self.jet.slopes]

    def slope(self, axes: Sequence[int]) -> Any:
        """Return ∂U/∂Θ along some axes as a function."""
        return AnalyticFunction([self.x], codac.vec(*(self.slopes[k] for k in axes)))

    def left(
        self,
        box: Box,
        contractor: Any,
        done: Callable[[Box], bool],
        sizes: Sequence[float] = SIZES,
    ) -> list[Box]:
        """Return boxes to which the solver cuts a box down, and that are not done otherwise."""
        boxes = [box]
        for size in sizes:
            found = []
            for one in boxes:
                if one.max_diam() <= size:  # the solver would refuse it
                    found.append(one)
                    continue
                if time.process_time() > self.end_time:
                    return boxes
                # The solver itself heeds no limit of time.
                paving = codac.pave(one, contractor, size)
                found += [b for b in paving.boxes(PavingOut.outer) if not (b.is_empty() or done(b))]
            boxes = found
        return boxes


class Zeros:
    """The zeros of ∇U along some axes, with the other angles fixed.

    Args:
        body: The body.
        axes: The axes.
    """

    def __init__(self, body: Body, axes: Sequence[int] = (0, 1, 2)) -> None:
        self.body, self.axes = body, tuple(axes)
        self.f = body.slope(axes)
        zero = IntervalVector([[0, 0]] * len(self.axes))
        self.contractor = codac.CtcInverse_IntervalVector(self.f, zero)

    def hessian(self, box: Box) -> Any:
        """Return the derivatives of ∇U along these axes."""
        J = self.f.diff(box)
        return IntervalMatrix([[J(i, k) for k in self.axes] for i in range(len(self.axes))])

    def middle(self, box: Box) -> Box:
        """Return the middle of a box along these axes."""
        found = IntervalVector(box)
        for k in self.axes:
            found[k] = Interval(box[k].mid())
        return found

    def wider(self, box: Box, radius: float) -> Box:
        """Return a box that is wider along these axes."""
        found = IntervalVector(box)
        for k in self.axes:
            found[k] = box[k] + Interval(-radius, radius)
        return found

    def image(self, box: Box) -> tuple[Box | None, bool]:
        """Return Krawczyk's image of a box, and whether there is at most one zero in it."""
        H = self.hessian(box)
        if H.is_unbounded():
            return None, False
        n, middle = len(self.axes), self.middle(box)
        inverse = H.mid().inverse()
        if inverse.is_nan():
            return None, False
        Y = IntervalMatrix(inverse)
        rest = IntervalMatrix([[Interval(i == j) for j in range(n)] for i in range(n)]) - Y * H
        step = Y * self.f.eval(EvalMode.NATURAL, middle)
        away = rest * IntervalVector([box[k] - middle[k] for k in self.axes])
        image = IntervalVector(box)
        for i, k in enumerate(self.axes):
            image[k] = middle[k] - step[i] + away[i]
        rows = [sum((Interval(rest(i, j).mag()) for j in range(n)), Interval(0)) for i in range(n)]
        return image, all(row.ub() < 1 for row in rows)

    def zero_near(self, box: Box) -> Box | None:
        """Return a narrow box with exactly one zero, near the middle of a box; None without."""
        for radius in RADII:
            around = self.wider(self.middle(box), radius)
            image, unique = self.image(around)
            if image is None or not unique or not self.inside(image, around):
                continue
            for _ in range(8):
                narrower, _ = self.image(image)
                if narrower is None:
                    break
                image = image & narrower
            return image
        return None

    def inside(self, inner: Box, outer: Box) -> bool:
        """Return whether a box lies strictly in another along these axes."""
        return all(
            outer[k].lb() < inner[k].lb() and inner[k].ub() < outer[k].ub() for k in self.axes
        )

    def domain(self, box: Box, holds: Callable[[Box], bool] | None = None) -> Box:
        """Return the widest box found about a zero in which there is no other, or that holds."""
        found, test = box, holds or (lambda wider: self.image(wider)[1])
        for radius in WIDER:
            wider = self.wider(box, radius)
            if not test(wider):
                break
            found = wider
        return found

    def index(self, box: Box) -> int | None:
        """Return the number of negative eigenvalues of the Hessian in a box, or None."""
        H = self.hessian(box)
        n = range(len(self.axes))
        rows = [[H(i, j) for j in n] for i in n]
        negative = 0
        while rows:  # the signs of the pivots (Sylvester)
            p = max(range(len(rows)), key=lambda i: rows[i][i].mig())
            pivot = rows[p][p]
            if pivot.contains(0):
                return None
            negative += pivot.ub() < 0
            kept = [i for i in range(len(rows)) if i != p]
            rows = [[rows[i][j] - rows[i][p] * rows[p][j] / pivot for j in kept] for i in kept]
        return negative


Answer = tuple[str, str, str]
"""A claim, its verdict, and sentences about it."""


class BelowError(Exception):
    """The energy is below a level."""


class Range:
    """The claims about a range of Θ.

    Args:
        body: The body.
        claims: Them, as plain data.
    """

    def __init__(self, body: Body, claims: dict[str, Any]) -> None:
        self.body, self.claims = body, claims
        ends = [float.fromhex(end) for end in claims["end"]]
        self.box = IntervalVector([[-end, end] for end in ends])
        self.faces = dict[int, Any]()
        if body.stop is not None:
            end = interval_of(body.stop)
            self.box[1] = -end | end
            self.faces = {sign: Interval(sign) * end for sign in (-1, 1)}
        self.states = [box_of(one["enclosure"]) for one in claims["states"]]
        self.zeros = Zeros(body)
        self.on_face = Zeros(body, (0, 2)) if self.faces else self.zeros
        self.domains = list[tuple[Zeros, Box]]()

    def answers(self) -> Iterator[Answer]:
        """Yield the verdicts on all claims."""
        for number, state in enumerate(self.claims["states"]):
            yield self._state(number, state, self.states[number])
        if self.claims["complete"]:
            yield self._list()
        if self.claims["level"] is not None:
            yield self._level(float.fromhex(self.claims["level"]))

    def _state(self, number: int, state: dict[str, Any], box: Box) -> Answer:
        """Check that exactly one zero is in a box, and how many directions lead down there."""
        name = f"rest state {number + 1}"
        zeros = self.zeros
        if state["held"]:
            at = [sign for sign, end in self.faces.items() if box[1].intersects(end)]
            if not at:
                return name, OPEN, "A force that jumps holds the body there."
            zeros, box = self.on_face, IntervalVector(box)
            box[1] = self.faces[at[0]]
            push = at[0] * self.body.slope((1,)).eval(EvalMode.NATURAL, box)[0]
            if push.ub() >= 0:
                return name, REFUTED if push.lb() > 0 else OPEN, "The stop may not hold it."
        zero = zeros.zero_near(box)
        apart = zero is not None and not zero.intersects(box)
        near = apart and box.is_subset(zeros.domain(zero))
        if near or any(not slope.contains(0) for slope in zeros.f.eval(box)):
            return name, REFUTED, "No zero of the gradient is in its box."
        if zero is None or not zeros.inside(zero, box):
            return name, OPEN, "No zero of the gradient was isolated in its box."
        self.domains.append((zeros, zeros.domain(zero)))
        self.states[number] = zero & box
        index = zeros.index(zero)
        if state["index"] is not None and index != state["index"]:
            verdict = OPEN if index is None else REFUTED
            return name, verdict, f"Its index is {index}, and not {state['index']}."
        return name, PROVED, "Exactly one zero of the gradient is in its box, with its index."

    def _list(self) -> Answer:
        """Check that there is no other rest state in the range."""
        left = [(self.zeros, one) for one in self._undone(self.zeros, self.box)]
        for sign, end in self.faces.items():
            face = IntervalVector(self.box)
            face[1] = end
            push = AnalyticFunction([self.body.x], Interval(sign) * self.body.slopes[1])
            inward = codac.CtcInverse_Interval(push, Interval(-codac.oo, 0))
            left += [(self.on_face, b) for b in self._undone(self.on_face, face, inward)]
        name = "no other rest state"
        for zeros, box in left[:MOST_TRIED]:
            zero = zeros.zero_near(box)
            if zero is None or any(zero.intersects(state) for state in self.states):
                continue
            if zeros.inside(zero, self.box):
                place = ", ".join(f"{zero[k].mid():.6f}" for k in range(3))
                return name, REFUTED, f"There is another one near Θ = ({place})."
        if left:
            return name, OPEN, f"In {len(left)} boxes there may be another one."
        return name, PROVED, "The solver leaves no box in which there may be another one."

    def _undone(self, zeros: Zeros, box: Box, also: Any = None) -> list[Box]:
        domains = [domain for owner, domain in self.domains if owner is zeros]
        contractor = zeros.contractor if also is None else zeros.contractor & also

        def done(b: Box) -> bool:
            return any(all(b[k].is_subset(d[k]) for k in zeros.axes) for d in domains)

        return self.body.left(box, contractor, done)

    def _level(self, level: float) -> Answer:
        """Check that U is not below a level on the faces, and at all rest states but the first."""
        name, U = "certified region", self.body.U
        first, *others = [U.eval(state) for state in self.states]
        below = [value for value in others if value.lb() < level]
        if below:
            verdict = REFUTED if any(value.ub() < level for value in below) else OPEN
            return name, verdict, "Another rest state is below its level."
        depth = Interval(level) - first
        stated = float.fromhex(self.claims["depth"])
        if not stated <= depth.lb():
            return name, REFUTED if stated > depth.ub() else OPEN, "It is not as deep as stated."
        for axis in range(3):
            if axis == 1 and self.faces:
                continue  # a stop keeps the motion in the range
            for end in (self.box[axis].lb(), self.box[axis].ub()):
                face = IntervalVector(self.box)
                face[axis] = Interval(end)
                try:
                    left = self._below(level, face, axis)
                except BelowError:
                    return name, REFUTED, f"U is below its level where θ{axis + 1} ends."
                if left:
                    return name, OPEN, f"U may be below its level where θ{axis + 1} ends."
        return name, PROVED, "U is not below its level where the range ends, nor where others rest."

    def _below(self, level: float, face: Box, axis: int) -> list[Box]:
        """Return boxes of a face in which U may be below a level.

        Raises:
            BelowError: U is below it at a point.
        """
        U, others = self.body.U, [k for k in range(3) if k != axis]
        low = codac.CtcInverse_Interval(U, Interval(-codac.oo, level))
        slopes, bowls = {k: self.body.slope((k,)) for k in others}, list[Box]()

        def done(b: Box) -> bool:
            """Return whether U is not below the level there: where it is least, it is convex."""
            if U.eval(IntervalVector(b.mid())).ub() < level:
                raise BelowError
            least, flat = IntervalVector(b), []
            for k in others:
                slope = slopes[k].eval(EvalMode.NATURAL, b)[0]
                if slope.contains(0):
                    flat.append(k)
                else:
                    least[k] = Interval(b[k].lb() if slope.lb() > 0 else b[k].ub())
            if U.eval(least).lb() >= level or any(least.is_subset(bowl) for bowl in bowls):
                return True
            zeros = Zeros(self.body, flat) if flat else None
            zero = None if zeros is None else zeros.zero_near(least)
            if zeros is None or zero is None or not U.eval(zero).lb() >= level:
                return False
            bowls.append(zeros.domain(zero, lambda wider: zeros.index(wider) == 0))
            return bool(least.is_subset(bowls[-1]))

        return self.body.left(face, low, done, ON_FACE)


def box_of(corners: Sequence[Sequence[str]]) -> Box:
    """Return a box from its lower and upper corner, in hexadecimal."""
    low, high = corners
    return IntervalVector(
        [[float.fromhex(a), float.fromhex(b)] for a, b in zip(low, high, strict=True)]
    )


def main() -> None:
    """Print the verdict on each claim."""
    data = json.load(sys.stdin)
    body = Body(data)
    for claims in data["ranges"]:
        for answer in Range(body, claims).answers():
            sys.stdout.write(json.dumps([claims["name"], *answer]) + "\n")
            sys.stdout.flush()


if __name__ == "__main__":
    main()
