"""Bounds over boxes contain what differences of 300 bits say, with switches and with z."""

from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import Any

import pytest
from flint import arb, ctx, fmpq
from hypothesis import given, settings
from hypothesis import strategies as st

from rbstab.proof.check.bounds import Bounds
from rbstab.proof.check.energy import read_energy
from rbstab.proof.exact.expr import Expr, variable
from rbstab.proof.record import operations_of

X, Y, Z, OWN = variable(0), variable(1), variable(2), variable(3)
H = Y + X / 2 - Fraction(1, 5)

HELD: dict[str, Expr] = {
    "sines": X.sin() * Y.cos() ** 3 * 5 - X * Y * Z + Z**4 * X.cos(),
    "roots": (3 + X.sin() * Z.cos()).sqrt() * (X + Y) + (2 + Y.cos()) ** -3,
    "others": (X * Y - Z).exp() + (4 + X + Y * Z).log() + (2 * X - Z * Y).atan(),
    "a force that jumps": X**2 * Y + 3 * H * Z.cos() * H.step(1),
    "a kink": X.sin() * Z + H**2 * (X + 2) * H.step(2),
    "a kink in a root": X * Z + (2 + H.step(2) * (H**2 + H**3)).sqrt() * (1 + X),
    "a ligament": X * Z + H**3 * (Y.sin() + 2) * H.step(3),
}
WITH_Z: dict[str, Expr] = {
    "quartic": 3 * OWN**2 + OWN**4 + X.sin() * Y * OWN + Z * X,
    "exponential": OWN**2 + (OWN + X.sin() - Z).exp() + Y.cos() * X,
}

Point = Sequence[Any]


def value(operations: Sequence[Sequence[Any]], point: Point) -> Any:
    """Return the value of operations, each in its plain meaning."""
    x: list[Any] = []
    for kind, *rest in operations:
        if kind == "var":
            x.append(point[rest[0]])
        elif kind == "sum":
            numbers = [arb(fmpq(*Fraction(c).as_integer_ratio())) for c in (rest[0], *rest[1::2])]
            terms = zip(numbers[1:], rest[2::2], strict=True)
            x.append(numbers[0] + sum((c * x[k] for c, k in terms), arb(0)))
        elif kind == "times":
            x.append(x[rest[0]] * x[rest[1]])
        elif kind == "pow":
            base = x[rest[1]] if rest[0] > 0 else 1 / x[rest[1]]
            product = arb(1)
            for _ in range(abs(rest[0])):
                product *= base
            x.append(product)
        elif kind == "step":
            x.append(arb(1 if x[rest[1]] > 0 else 0))
        else:
            x.append(getattr(x[rest[0]], kind)())
    return x[-1]


def slope(f: Callable[[Point], Any], point: Point, axis: int) -> Any:
    """Return ∂f/∂x by a central difference."""
    h = arb(10) ** -30
    ends = ([p + s * h if k == axis else p for k, p in enumerate(point)] for s in (1, -1))
    above, below = map(f, ends)
    return (above - below) / (2 * h)


def least(operations: Sequence[Sequence[Any]], point: Point) -> Any:
    """Return the least value over z, by Newton's method."""
    z = arb(0)

    def at(w: Any) -> Any:
        return value(operations, [*point, w])

    h = arb(10) ** -25
    for _ in range(60):
        above, here, below = at(z + h), at(z), at(z - h)
        z = (z - (above - below) * h / (2 * (above - 2 * here + below))).mid()
    return at(z)


boxes = st.lists(st.tuples(st.floats(-0.9, 0.9), st.floats(1e-6, 0.5)), min_size=3, max_size=3)
places = st.lists(st.floats(-1, 1), min_size=3, max_size=3)


def _contains(b: Bounds, f: Callable[[Point], Any], m: Point, point: Point, error: float) -> None:
    """Check the value and the slopes at a point; `error` is that of the differences."""
    slack = arb(0, error)
    v = f(point)
    assert (b.values + slack).overlaps(v)
    assert b.at_least(v.lower() + 1e-9) is False
    g = [slope(f, point, k) for k in range(3)]
    for a, found in zip(b.slopes, g, strict=True):
        assert (a + slack).overlaps(found)
    delta = [p - q for p, q in zip(point, m, strict=True)]
    for i in range(3):  # ∇U = ∇U(m) + S (Θ - m)
        by_mean = b.gradient[i, 0] + sum((b.slope[i, j] * delta[j] for j in range(3)), arb(0))
        assert not by_mean.is_finite() or (by_mean + slack).overlaps(g[i])


def _case(box: Any, place: Any) -> tuple[tuple[tuple[float, float], ...], Point]:
    sides = tuple((c - r, c + r) for c, r in box)
    point = [
        arb(a) + (arb(b) - a) * (arb(t) + 1) / 2 for (a, b), t in zip(sides, place, strict=True)
    ]
    return sides, point


@pytest.mark.parametrize("name", HELD)
@settings(max_examples=25, deadline=None)
@given(box=boxes, place=places)
def test_bounds_contain_the_energy_and_its_slopes(name: str, box: Any, place: Any) -> None:
    operations = operations_of(HELD[name])
    with ctx.workprec(300):
        sides, point = _case(box, place)
        b = Bounds(read_energy(operations), sides)
        _contains(b, lambda p: value(operations, p), b.middle, point, 1e-20)


@pytest.mark.parametrize("name", WITH_Z)
@settings(max_examples=25, deadline=None)
@given(box=boxes, place=places)
def test_bounds_contain_the_least_energy_over_z(name: str, box: Any, place: Any) -> None:
    operations = operations_of(WITH_Z[name])
    with ctx.workprec(300):
        sides, point = _case(box, place)
        b = Bounds(read_energy(operations, (3,)), sides)
        if b.value.is_finite():
            _contains(b, lambda p: least(operations, p), b.middle, point, 1e-12)


def test_bounds_of_the_least_energy_are_finite_on_small_boxes() -> None:
    box = ((0.1, 0.2), (0.3, 0.35), (-0.2, -0.1))
    for e in WITH_Z.values():
        with ctx.workprec(128):
            found = Bounds(read_energy(operations_of(e), (3,)), box)
            assert all(x.is_finite() for x in found.slopes)
