"""The program of the process in which codac checks claims: it imports nothing but codac.

Importing codac makes the whole process round upward, and in threads its intervals may be wrong. So
it runs by itself: from plain data to [range, claim, verdict, text] of each claim, a line for each.
"""

import json
import sys
from collections.abc import Callable, Iterator, Sequence
from fractions import Fraction
from typing import Any

import codac
from codac import AnalyticFunction, EvalMode, Interval, IntervalVector, PavingOut

PROVED, REFUTED, OPEN = "proved", "refuted", "not decided"
SIZES = (0.02, 0.001, 3e-5, 1e-6)  # rad: to which codac's solver cuts boxes
AROUND = (0.1, 0.01, 0.001, 1e-4)  # rad: so much about a box, just one zero is looked for
MOST_TRIED, MOST = 64, 10_000  # so many boxes are tried, or cut further
ENDS = {"pi": Interval.pi().ub(), "pi/2": Interval.half_pi().ub()}  # points: quick to cut
SAME = 1e-9  # relative: so near is U to the stored energy in doubles


def interval(number: Any) -> Any:
    """Return an interval about a rational number."""
    exact = Fraction(number)
    near = float(exact)
    return Interval(near).inflate(0 if near == exact else abs(near) * 2.0**-52 + 2.0**-1000)


def expression(operations: Sequence[Any], x: Any) -> Any:
    """Return an expression of codac, from operations of a record."""
    values = list[Any]()
    for kind, *rest in operations:
        if kind == "var":
            value = x[rest[0]]
        elif kind == "sum":
            terms = zip(rest[1::2], rest[2::2], strict=True)
            value = sum((interval(c) * values[k] for c, k in terms), interval(rest[0]) + 0 * x[0])
        elif kind == "times":
            value = values[rest[0]] * values[rest[1]]
        else:
            value = getattr(codac, kind)(values[rest[-1]], *rest[:-1])
            if kind == "cos" and operations[rest[-1]] == ["var", 1]:
                value = codac.max(value, Interval(0) + 0 * x[0])  # so a barrier has one sign
        values.append(value)
    return values[-1]


def solve(box: Any, contractor: Any, settled: Sequence[Any], wrong: Callable[..., bool]) -> Any:
    """Return whether a box is wrong, or may be, with this box; None if all is settled.

    Args:
        box: The box that is searched.
        contractor: Cuts away what cannot be wrong.
        settled: The boxes about which nothing is left to ask.
        wrong: Returns whether a box is wrong for certain.
    """
    left = [box]
    for size in SIZES:
        left = codac.pave(box, contractor, size).boxes(PavingOut.outer) if left else []
        left = [b for b in left if not b.is_empty() and not any(map(b.is_subset, settled))]
        for counterexample in filter(wrong, left[:MOST_TRIED]):
            return REFUTED, counterexample
        if len(left) > MOST:
            break
    return (OPEN, left[0]) if left else None


class Search:
    """Rest states in a range; with a sign, in its face at a stop, where U falls outwards."""

    def __init__(self, slopes: Any, box: Any, sign: int, zeros: list[Any]) -> None:
        self.slopes, self.box, self.axes = slopes, box, (0, 2) if sign else (0, 1, 2)
        push = [Interval(0), Interval(-codac.oo, 0), Interval(0, codac.oo)][sign]
        self.push = IntervalVector([Interval(0), push, Interval(0)])
        self.contractor = codac.CtcInverse_IntervalVector(slopes, self.push)
        self.zeros, self.settled = zeros, list[Any]()

    def isolate(self, box: Any) -> tuple[Any, Any] | None:
        """Return a box about the only zero near a box, and one in which it is the only one."""
        for radius in AROUND:
            wide = IntervalVector(self.box)
            for k in self.axes:
                wide[k] = box[k] + Interval(-radius, radius)
            zero = self.newton(wide)
            if self.inside(zero, wide):
                for _ in range(8):
                    zero &= self.newton(zero)
                slope, push = self.slopes.eval(zero)[1], self.push[1]
                if zero.is_subset(self.box) and (1 in self.axes or slope.is_interior_subset(push)):
                    return zero, wide
        return None

    def is_other(self, box: Any) -> bool:
        """Return whether a zero that is not listed is near a box."""
        isolated = self.isolate(box)
        return isolated is not None and not any(map(isolated[0].intersects, self.zeros))

    def newton(self, box: Any) -> Any:
        """Return the image of a box under Newton's operator."""
        middle = IntervalVector(box)
        for k in self.axes:
            middle[k] = Interval(box[k].mid())
        slopes = self.slopes.eval(EvalMode.NATURAL, middle)
        inverse = codac.inverse_enclosure(codac.IntervalMatrix(self.hessian(box)))
        step = inverse * IntervalVector([slopes[k] for k in self.axes])
        for i, k in enumerate(self.axes):
            middle[k] -= step[i]
        return middle

    def inside(self, inner: Any, outer: Any) -> bool:
        """Return whether a box lies strictly in another along the axes."""
        return all(inner[k].is_interior_subset(outer[k]) for k in self.axes)

    def hessian(self, box: Any) -> list[list[Any]]:
        """Return the second derivatives of U along the axes."""
        J = self.slopes.diff(box)
        return [[J(i, k) for k in self.axes] for i in self.axes]

    def index(self, box: Any) -> int | None:
        """Return the number of negative eigenvalues of the Hessian in a box, or None."""
        rows, negative = self.hessian(box), 0
        while rows:  # the signs of the pivots (Sylvester)
            (pivot, *top), *rest = rows
            if pivot.contains(0):
                return None
            negative += pivot.ub() < 0
            rows = [[a - r[0] * b / pivot for a, b in zip(r[1:], top, strict=True)] for r in rest]
        return negative


def listed(searches: dict[int, Search], claims: Any) -> tuple[str, str]:
    """Check that the rest states of a range are those that are listed, and their indices."""
    for number, state in enumerate(claims["states"], start=1):
        ends = zip(*state["enclosure"], strict=True)
        box = IntervalVector([Interval(interval(a).ub(), interval(b).lb()) for a, b in ends])
        search = searches.get((1 if box[1].mid() > 0 else -1) if state["held"] else 0, searches[0])
        isolated, place = search.isolate(box), f"the box of rest state {number}"
        if isolated is None:
            return OPEN, f"No zero of the gradient was isolated near {place}."
        zero, index = isolated[0], search.index(isolated[0])
        if not zero.intersects(box) or (index is not None and state["index"] not in {None, index}):
            return REFUTED, f"No zero of the gradient of index {state['index']} is in {place}."
        if not search.inside(zero, box) or index is None:
            return OPEN, f"A zero may be at the end of {place}, or have another index."
        search.zeros.append(zero)
        search.settled.append(isolated[1])
    for search in searches.values() if claims["complete"] else ():
        other = solve(search.box, search.contractor, search.settled, search.is_other)
        if other is not None:
            return other[0], f"There is, or may be, another one near {other[1]}."
    left = "no other is left" if claims["complete"] else "others were not looked for"
    return PROVED, f"Each has one zero of the gradient in its box, and its index; {left}."


def bounded(U: Any, boxes: Sequence[Any], level: Any) -> tuple[str, str]:
    """Check that U is not below a level at the ends of a range, and at its other rest states.

    Args:
        U: The energy, J, as a function of Θ.
        boxes: The ends of the range, and where the other rest states are.
        level: The level, J, an interval.
    """
    low = codac.CtcInverse_Interval(U, Interval(-codac.oo, level.ub()))
    for box in boxes:
        below = solve(box, low, (), lambda b: U.eval(IntervalVector(b.mid())).ub() < level.lb())
        if below is not None:
            return below[0], f"U is, or may be, below its level near {below[1]}."
    return PROVED, "U is not below its level where the range ends, nor where others rest."


def verdicts(data: Any) -> Iterator[tuple[str, ...]]:
    """Yield range, claim, verdict and text of each claim; first of the energy itself."""
    x = codac.VectorVar(3)
    U = AnalyticFunction([x], expression(data["energy"], x))
    slopes = AnalyticFunction(
        [x], codac.vec(*(expression(operations, x) for operations in data["slopes"]))
    )
    for angles, energy in data["samples"]:
        Theta = IntervalVector([interval(angle) for angle in angles])
        gradient, given = U.diff(Theta), slopes.eval(Theta)
        pairs = [(U.eval(Theta), energy), *((given[k], gradient(0, k).mid()) for k in range(3))]
        if not all(abs(a.mid() - b) <= SAME * (1 + abs(b)) for a, b in pairs):
            yield "the config", "energy", REFUTED, "U is not the least stored energy of the config."
            return
    yield "the config", "energy", PROVED, "U is the least stored energy of the config, as sampled."
    for claims in data["ranges"]:
        ends, zeros = [interval(ENDS.get(end, end)) for end in claims["end"]], list[Any]()
        box, faces = IntervalVector([-end | end for end in ends]), dict[tuple[int, int], Any]()
        for axis, sign in ((k, s) for k in range(3) for s in (-1, 1)):
            faces[axis, sign] = IntervalVector(box)
            faces[axis, sign][axis] = Interval(sign) * ends[axis]
        signs = (0, -1, 1) if data["stop"] else (0,)
        searches = {s: Search(slopes, faces.pop((1, s), box), s, zeros) for s in signs}
        finding = listed(searches, claims)
        yield claims["name"], "rest states", *finding
        if "level" in claims and finding[0] == PROVED:
            # For all θ1 and θ3, U rises without end beyond a box that confines all rest states.
            border = [f for (k, _), f in faces.items() if k == 1 or not claims.get("everywhere")]
            finding = OPEN, "The list is not complete: other rest states may be below the level."
            if claims["complete"]:
                finding = bounded(U, border + zeros[1:], interval(claims["level"]))
            yield claims["name"], "certified region", *finding


if __name__ == "__main__":
    for verdict in verdicts(json.load(sys.stdin)):
        sys.stdout.write(json.dumps(verdict) + "\n")
