"""Where a step changes, U is as smooth as its operations say: proved in exact arithmetic.

Where the argument h of a step is positive, U is U1, with 1 for the step and h for its positive
part; elsewhere U is U0, with 0 for the step. If the first derivative that jumps at h = 0 has the
order k, U1 - U0 has to be a multiple of h^k. Here h is a symbol p: the largest monomial of h is
replaced by what it is then, and U1 - U0 has to have no power of p below k. Functions of other
operations are symbols too, so an identity among symbols is one of U.
"""

from typing import Any

from flint import fmpq
from flint.utils.flint_exceptions import FlintError

from rbstab.proof.check.energy import Energy, operands

P = -1
"""The number of the symbol p; others are operations."""

Monomial = tuple[tuple[int, int], ...]
"""Symbols with their powers, in order."""

Poly = dict[Monomial, Any]

MOST_TERMS = 2000


class _NoFormError(Exception):
    """An operation has another form, or too many terms."""


def why_not_smooth(U: Energy) -> str | None:
    """Return what is not shown about the steps of an energy; None if all is."""
    for k in U.steps:
        try:
            smooth = _Switch(U, k).is_smooth
        except _NoFormError as error:
            return f"That step {k + 1} is as smooth as it says could not be confirmed: {error}"
        if not smooth:
            return f"Step {k + 1} is not as smooth as it says"
    arguments = {U.operations[k][2] for k in U.steps}
    if any(one[0] == "positive" and one[1] not in arguments for one in U.operations):
        return "A positive part has no step of its own"
    return None


class _Switch:
    """One step of an energy."""

    def __init__(self, U: Energy, step: int) -> None:
        self.U, self.step = U, step
        _, self.order, self.inner = U.operations[step]
        h = self._values(None)[self.inner]
        assert h is not None
        largest = max((m for m in h if m), key=lambda m: (sum(n for _, n in m), m), default=None)
        if largest is None:
            raise _NoFormError("its argument is a number")
        c = h[largest]
        self.largest = largest
        self.instead = {m: -x / c for m, x in h.items() if m != largest} | {((P, 1),): 1 / c}

    @property
    def is_smooth(self) -> bool:
        """Whether U1 - U0 has no power of h below the order."""
        one, zero = (self._values(on)[-1] for on in (True, False))
        if one is None or zero is None:
            raise _NoFormError("a positive part stands without its step")
        return not self._reduced(_plus(one, zero, fmpq(-1)))

    def _values(self, on: bool | None) -> list[Poly | None]:
        """Return all operations where the step is on, or off, as polynomials of symbols.

        None is a positive part where the step is off: it has another form there. With None for
        `on`, operations that depend on the step are symbols as well.
        """
        found, touched = list[Poly | None](), list[bool]()
        for k, one in enumerate(self.U.operations):
            own = k == self.step or one == ("positive", self.inner)
            side = self._side(one, found) if on is not None and not own else None
            touched.append(own or side is not None or any(touched[j] for j in operands(one)))
            if side is None:
                side = self._value(k, one, found, on if touched[k] else None)
            found.append(side)
        return found

    def _side(self, one: Any, found: list[Poly | None]) -> Poly | None:
        """Return the value at h = 0 of a step, or positive part, whose argument is no zero there.

        None: it is not one whose argument is a number and powers of h.
        """
        x = found[one[-1]] if one[0] in ("step", "positive") else None
        x = None if x is None else self._reduced(x)
        if x is None or not x.get((), fmpq(0)) or any(a != P for m in x for a, _ in m):
            return None
        above = x[()] > 0
        return {} if not above else x if one[0] == "positive" else {(): fmpq(1)}

    def _value(  # noqa: PLR0911 (one return for each kind)
        self, k: int, one: Any, found: list[Poly | None], on: bool | None
    ) -> Poly | None:
        kind, *rest = one
        if on is not None and k == self.step:
            return {(): fmpq(1)} if on else {}
        if on is not None and kind == "positive":
            return {((P, 1),): fmpq(1)} if on else None
        if kind == "sum":
            total: Poly | None = {(): rest[0]} if rest[0] else {}
            for c, j in rest[1]:
                total = _plus(total, found[j], c)
            return total
        if kind == "times":
            return _times(found[rest[0]], found[rest[1]])
        if kind == "pow" and rest[0] > 0:
            base = power = found[rest[1]]
            for _ in range(rest[0] - 1):
                power = _times(power, base)
            return power
        if on is None:
            return {((k, 1),): fmpq(1)}
        return self._function(kind, rest, found[rest[-1]])

    def _function(self, kind: str, rest: list[Any], x: Poly | None) -> Poly | None:
        """Return a root or a power of a series in p with numbers."""
        if x is None:
            return None
        x = self._reduced(x)
        n = fmpq(1, 2) if kind == "sqrt" else fmpq(rest[0]) if kind == "pow" else None
        if n is None or any(a != P for m in x for a, _ in m):
            raise _NoFormError(f"{kind} of it has no series")
        c0 = x.pop((), fmpq(0))
        if not c0 > 0:
            raise _NoFormError(f"{kind} of it has no series")
        u = {m: c / c0 for m, c in x.items()}
        try:
            factor = c0.sqrt() if kind == "sqrt" else c0 ** rest[0]
        except FlintError as error:
            raise _NoFormError(f"{kind} of it has no series") from error
        total: Poly = {}
        power: Poly = {(): fmpq(1)}
        c = fmpq(1)
        for k in range(self.order):
            total = _plus(total, power, c)
            power, c = _times(power, u), c * (n - k) / (k + 1)
        return {m: v * factor for m, v in total.items()}

    def _reduced(self, x: Poly) -> Poly:
        """Replace the largest monomial of h wherever it is a factor, and drop high powers of p."""
        pending, found = dict(x), dict[Monomial, Any]()
        for _ in range(MOST_TERMS):
            if not pending:
                return found
            m, c = pending.popitem()
            powers = dict(m)
            if powers.get(P, 0) >= self.order:
                continue
            if all(powers.get(a, 0) >= n for a, n in self.largest):
                for a, n in self.largest:
                    powers[a] -= n
                left: Poly = {_monomial(powers): c}
                pending = _plus(pending, _times(left, self.instead), fmpq(1))
            else:
                found = _plus(found, {m: c}, fmpq(1))
        raise _NoFormError("it has too many terms")


def _monomial(powers: dict[int, int]) -> Monomial:
    return tuple(sorted((a, n) for a, n in powers.items() if n))


def _plus(x: Poly | None, y: Poly | None, factor: Any) -> Any:
    """Return x + factor·y, without terms that are zero."""
    if x is None or y is None:
        return None
    found = dict(x)
    for m, c in y.items():
        found[m] = found.get(m, fmpq(0)) + factor * c
        if not found[m]:
            del found[m]
    return found


def _times(x: Poly | None, y: Poly | None) -> Any:
    """Return a product; zero times anything is zero."""
    if x == {} or y == {}:
        return {}
    if x is None or y is None:
        return None
    if len(x) * len(y) > MOST_TERMS:
        raise _NoFormError("it has too many terms")
    found: Poly = {}
    for m, c in x.items():
        for k, d in y.items():
            powers = dict(m)
            for a, n in k:
                powers[a] = powers.get(a, 0) + n
            one = _monomial(powers)
            found[one] = found.get(one, fmpq(0)) + c * d
    return {m: c for m, c in found.items() if c}
