"""The program of the process in which codac checks claims: it imports nothing but codac.

Importing codac makes the whole process round upward, which the rest of rbstab must not do, and in a
thread that was started before its intervals are wrong. So this file is run by its path, and gets a
record of `rbstab.proof.record` on stdin, with doubles in hexadecimal, as reading decimals depends
on the rounding. The answers on stdout are JSON: [range, claim, verdict, text] of each claim.
"""

import json
import sys
from collections.abc import Iterator, Sequence
from fractions import Fraction
from itertools import product
from typing import Any

import codac
from codac import AnalyticFunction, EvalMode, Interval, IntervalMatrix, IntervalVector, PavingOut

PROVED, REFUTED, OPEN = "proved", "refuted", "not decided"

SIZES = (0.1, 0.01, 0.001, 0.0001)
"""The sizes to which codac's solver cuts boxes, rad, one after the other."""

RADII = [10.0 ** (k / 2 - 13) for k in range(27)]
"""Of the boxes about a point in which a zero is looked for, rad: up to 1."""

WIDER = [1e-6 * 1.15**k for k in range(100)]
"""By how much a box about a zero is widened in which there is no other, rad: up to 1."""

MOST_TRIED = 64
"""With more boxes left, no zero is looked for in each."""

SAME = 1e-9
"""Relative: so near is U to the stored energy in doubles."""

CONFIG = "the config"

Box = Any
Expression = Any


def interval_of(text: str) -> Any:
    """Return an interval about a rational number, or a double in hexadecimal."""
    if "x" in text:
        return Interval(float.fromhex(text))
    number = Fraction(text)
    ends = [(float(n), n) for n in (number.numerator, number.denominator)]
    top, bottom = (
        Interval(x) if int(x) == n else Interval(codac.prev_float(x), codac.next_float(x))
        for x, n in ends
    )
    return top / bottom


def total(*terms: tuple[Expression | None, Expression | None]) -> Expression | None:
    """Return a sum of products; None is zero."""
    found = None
    for a, b in terms:
        if a is not None and b is not None:
            found = a * b if found is None else found + a * b
    return found


def energy(operations: Sequence[Sequence[Any]], x: Any) -> tuple[Expression, list[Expression]]:
    """Return U and its slopes as expressions of codac."""
    values, slopes = list[Expression](), list[list[Expression | None]]()
    for kind, *rest in operations:
        if kind == "var":
            value, own = x[rest[0]], [Interval(1) if k == rest[0] else None for k in range(3)]
        elif kind == "sum":
            terms = [(interval_of(c), k) for c, k in zip(rest[1::2], rest[2::2], strict=True)]
            value = sum((c * values[k] for c, k in terms), interval_of(rest[0]) + 0 * x[0])
            own = [total(*((c, slopes[k][i]) for c, k in terms)) for i in range(3)]
        elif kind == "times":
            j, k = rest
            value = values[j] * values[k]
            own = [total((slopes[j][i], values[k]), (values[j], slopes[k][i])) for i in range(3)]
        else:
            pitch = list(operations[rest[-1]]) == ["var", 1]
            value, slope = function(kind, values[rest[-1]], rest[0], pitch=pitch)
            own = [total((slope, one)) for one in slopes[rest[-1]]]
        values.append(value)
        slopes.append(own)
    return values[-1], [0 * x[0] if one is None else one for one in slopes[-1]]


def function(kind: str, x: Expression, n: int, *, pitch: bool) -> tuple[Expression, Expression]:
    """Return a function of an expression, which may be θ2, and its derivative."""
    if kind in {"sin", "cos"}:
        sine, cosine = codac.sin(x), codac.cos(x)
        # cos θ2 is not negative in the range, so that a barrier has one sign up to its ends.
        cosine = codac.max(cosine, Interval(0) + 0 * x) if pitch else cosine
        return (sine, cosine) if kind == "sin" else (cosine, -sine)
    if kind == "pow":
        return power(x, n), Interval(n) * power(x, n - 1)
    value = getattr(codac, kind)(x)
    return value, value if kind == "exp" else Interval(0.5) / value


def power(x: Expression, n: int) -> Expression:
    """Return a whole power."""
    if n < 0:
        return 1 / power(x, -n)
    return [Interval(1) + 0 * x, x, codac.sqr(x)][n] if n <= 2 else codac.pow(x, n)


class Body:
    """U and ∇U of a body, as functions of codac."""

    def __init__(self, operations: Sequence[Sequence[Any]]) -> None:
        self.x = codac.VectorVar(3)
        value, self.slopes = energy(operations, self.x)
        self.U = AnalyticFunction([self.x], value)

    def slope(self, *axes: int) -> Any:
        """Return ∂U/∂Θ along some axes as a function."""
        return AnalyticFunction([self.x], codac.vec(*(self.slopes[k] for k in axes)))


class Zeros:
    """All zeros of ∇U along some axes in a box of Θ: by codac's solver, and Krawczyk's operator.

    Args:
        body: The body.
        axes: The axes; the other angles are fixed.
        box: The box.
        also: A contractor that takes away what does not matter.

    Attributes:
        zeros: Boxes with one zero each.
        domains: For each the widest box found in which there is no other.
        left: Boxes in which there may be others.
    """

    def __init__(self, body: Body, axes: Sequence[int], box: Box, also: Any = None) -> None:
        self.axes, self.f = tuple(axes), body.slope(*axes)
        contractor = codac.CtcInverse_IntervalVector(self.f, IntervalVector([[0, 0]] * len(axes)))
        contractor = contractor if also is None else contractor & also
        self.zeros, self.domains, self.left = list[Box](), list[Box](), [box]
        for size in SIZES:
            left = list[Box]()
            for one in self.left:
                if one.max_diam() <= size:  # the solver would refuse it
                    left.append(one)
                else:
                    left += codac.pave(one, contractor, size).boxes(PavingOut.outer)
            left = [one for one in left if not (one.is_empty() or self._done(one))]
            many = len(left) > MOST_TRIED
            self.left = left if many else [one for one in left if not self._zero_about(one)]

    def _done(self, box: Box) -> bool:
        return any(all(box[k].is_subset(d[k]) for k in self.axes) for d in self.domains)

    def _zero_about(self, box: Box) -> bool:
        """Look for a zero in a box and near it; return whether there is no other in the box."""
        zero = self._zero_near(box)
        if zero is not None and not self._done(zero):
            domain = zero
            for radius in WIDER:
                wider = self._wider(zero, radius)
                if not self._image(wider)[1]:
                    break
                domain = wider
            self.zeros.append(zero)
            self.domains.append(domain)
        return self._done(box)

    def _zero_near(self, box: Box) -> Box | None:
        for radius in RADII:
            around = self._wider(self._middle(box), radius)
            image, unique = self._image(around)
            if image is None or not unique or not self.inside(image, around):
                continue
            for _ in range(8):
                narrower, _ = self._image(image)
                image = image if narrower is None else image & narrower
            return image
        return None

    def _image(self, box: Box) -> tuple[Box | None, bool]:
        """Return Krawczyk's image of a box, and whether there is at most one zero in it."""
        H, n, middle = self.hessian(box), len(self.axes), self._middle(box)
        if H.is_unbounded() or H.mid().inverse().is_nan():
            return None, False
        Y = IntervalMatrix(H.mid().inverse())
        rest = IntervalMatrix([[Interval(i == j) for j in range(n)] for i in range(n)]) - Y * H
        step = Y * self.f.eval(EvalMode.NATURAL, middle)
        away = rest * IntervalVector([box[k] - middle[k] for k in self.axes])
        image = IntervalVector(box)
        for i, k in enumerate(self.axes):
            image[k] = middle[k] - step[i] + away[i]
        rows = [sum((Interval(rest(i, j).mag()) for j in range(n)), Interval(0)) for i in range(n)]
        return image, all(row.ub() < 1 for row in rows)

    def hessian(self, box: Box) -> Any:
        """Return the derivatives of ∇U along these axes."""
        J = self.f.diff(box)
        return IntervalMatrix([[J(i, k) for k in self.axes] for i in range(len(self.axes))])

    def inside(self, inner: Box, outer: Box) -> bool:
        """Return whether a box lies strictly in another along these axes."""
        return all(
            outer[k].lb() < inner[k].lb() and inner[k].ub() < outer[k].ub() for k in self.axes
        )

    def _middle(self, box: Box) -> Box:
        found = IntervalVector(box)
        for k in self.axes:
            found[k] = Interval(box[k].mid())
        return found

    def _wider(self, box: Box, radius: float) -> Box:
        found = IntervalVector(box)
        for k in self.axes:
            found[k] = box[k] + Interval(-radius, radius)
        return found

    def index(self, box: Box) -> int | None:
        """Return the number of negative eigenvalues of the Hessian in a box, or None."""
        H, n, negative = self.hessian(box), range(len(self.axes)), 0
        rows = [[H(i, j) for j in n] for i in n]
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


class Range:
    """The claims about a range of Θ: a stop ends it at a closed face, on which it may hold a body.

    Args:
        body: The body.
        claims: Them, as plain data.
        stop: The largest |θ2| that a stop allows, or None.
    """

    def __init__(self, body: Body, claims: dict[str, Any], stop: str | None) -> None:
        self.body, self.claims, self.stop = body, claims, stop
        ends = [interval_of(end) for end in claims["end"]]
        self.ends = [{sign: Interval(sign) * end for sign in (-1, 1)} for end in ends]
        self.box = IntervalVector([-end | end for end in ends])
        self.states = [box_of(one["enclosure"]) for one in claims["states"]]
        self.searches = {0: Zeros(body, (0, 1, 2), self.box)}
        for sign in (-1, 1) if stop else ():
            push = AnalyticFunction([body.x], Interval(sign) * body.slopes[1])
            inward = codac.CtcInverse_Interval(push, Interval(-codac.oo, 0))
            search = Zeros(body, (0, 2), self.part({1: sign}), inward)
            pushes = [(zero, push.eval(zero)) for zero in search.zeros]
            search.zeros = [zero for zero, push in pushes if push.ub() < 0]  # held there
            search.left += [zero for zero, push in pushes if push.contains(0)]
            self.searches[sign] = search

    def part(self, signs: dict[int, int]) -> Box:
        """Return a face, an edge or a corner of the range."""
        found = IntervalVector(self.box)
        for axis, sign in signs.items():
            found[axis] = self.ends[axis][sign]
        return found

    def answers(self) -> Iterator[Answer]:
        """Yield the verdicts on all claims."""
        for number, state in enumerate(self.claims["states"]):
            yield f"rest state {number + 1}", *self._state(state, self.states[number])
        if self.claims["complete"]:
            yield "no other rest state", *self._list()
        if "level" in self.claims:
            yield "certified region", *self._level(interval_of(self.claims["level"]))

    def _state(self, state: dict[str, Any], box: Box) -> tuple[str, str]:
        """Check that exactly one zero is in a box, and how many directions lead down there."""
        sign = 0
        if state["held"]:
            at = [sign for sign, end in self.ends[1].items() if box[1].intersects(end)]
            if not (self.stop and at):
                return OPEN, "A force that jumps holds the body there."
            sign = at[0]
        search = self.searches[sign]
        zeros = [zero for zero in search.zeros if zero.intersects(box)]
        if any(one.intersects(box) for one in search.left):
            return OPEN, "There may be several zeros of the gradient in its box."
        if not zeros:
            return REFUTED, "No zero of the gradient is in its box."
        zero = zeros[0]
        if len(zeros) > 1 or not search.inside(zero, box):
            return OPEN, "No zero of the gradient was isolated in its box."
        index = search.index(zero)
        if state["index"] is not None and index != state["index"]:
            verdict = OPEN if index is None else REFUTED
            return verdict, f"Its index is {index}, and not {state['index']}."
        return PROVED, "Exactly one zero of the gradient is in its box, with its index."

    def _list(self) -> tuple[str, str]:
        """Check that there is no other rest state in the range."""
        left = sum(len(search.left) for search in self.searches.values())
        for search in self.searches.values():
            for zero in search.zeros:
                listed = any(zero.intersects(state) for state in self.states)
                if listed or not zero.intersects(self.box):
                    continue
                if search.inside(zero, self.box):
                    place = ", ".join(f"{zero[k].mid():.6f}" for k in range(3))
                    return REFUTED, f"There is another one near Θ = ({place})."
                left += 1
        if left:
            return OPEN, f"In {left} boxes there may be another one."
        return PROVED, "The solver leaves no box in which there may be another one."

    def _level(self, level: Any) -> tuple[str, str]:
        """Check that U is not below a level where the range ends, nor at rest states but the first.

        U is least on a face at a zero of its slopes along the face, along an edge, or at a corner.
        """
        zeros = [zero for search in self.searches.values() for zero in search.zeros]
        for state in self.states[1:]:
            values = [self.body.U.eval(zero) for zero in zeros if zero.intersects(state)]
            if any(value.ub() < level.lb() for value in values):
                return REFUTED, "Another rest state is below its level."
            if not values or any(value.lb() < level.ub() for value in values):
                return OPEN, "Another rest state may be below its level."
        low = codac.CtcInverse_Interval(self.body.U, Interval(-codac.oo, level.ub()))
        for choice in product((-1, 0, 1), repeat=3):
            signs = {axis: sign for axis, sign in enumerate(choice) if sign}
            if not signs or (self.stop and [*signs] == [1]):
                continue  # a stop keeps the motion in the range
            if self.claims.get("everywhere") and [*signs] != [1]:
                continue  # U rises without end beyond a box that confines all rest states
            part = self.part(signs)
            axes = [axis for axis in range(3) if axis not in signs]
            search = Zeros(self.body, axes, part, low) if axes else None
            for zero in [part] if search is None else search.zeros:
                if not zero.intersects(part):
                    continue
                value, where = self.body.U.eval(zero), f"U{{}} below its level at Θ = {zero}"
                if value.ub() < level.lb() and zero.is_subset(part):
                    return REFUTED, f"{where.format(' is')}."
                if value.lb() < level.ub():
                    return OPEN, f"{where.format(' may be')}."
            if search is not None and search.left:
                return OPEN, f"U may be below its level in {len(search.left)} boxes at its ends."
        return PROVED, "U is not below its level where the range ends, nor where others rest."


def box_of(corners: Sequence[Sequence[str]]) -> Box:
    """Return a box from its lower and upper corner."""
    low, high = corners
    return IntervalVector([interval_of(a) | interval_of(b) for a, b in zip(low, high, strict=True)])


def verdicts(data: dict[str, Any]) -> Iterator[tuple[str, ...]]:
    """Yield range, claim, verdict and text of each claim; first of the energy itself."""
    body = Body(data["energy"]["operations"])
    for Theta, value in data["samples"]:
        found, expected = body.U.eval(box_of([Theta, Theta])).mid(), float.fromhex(value)
        if not abs(found - expected) <= SAME * (1 + abs(expected)):
            yield CONFIG, "energy", REFUTED, "U is not the least stored energy of the config."
            return
    yield CONFIG, "energy", PROVED, "U is the least stored energy of the config, as sampled."
    for claims in data["ranges"]:
        for answer in Range(body, claims, data["energy"]["stop"]).answers():
            yield claims["name"], *answer


def main() -> None:
    """Print the verdicts, each as soon as it is known."""
    for verdict in verdicts(json.load(sys.stdin)):
        sys.stdout.write(json.dumps(verdict) + "\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main()
