"""Where a step changes, U is as smooth as its operations say: proved in exact arithmetic.

Where the argument h of a step is positive, U is U1, with 1 for the step and h for its positive
part; elsewhere U is U0, with 0 for the step. If the first derivative that jumps at h = 0 has the
order k, U1 - U0 has to be a multiple of h^k. Here h is a symbol p, and functions of other
operations are symbols too: U1 - U0 has to be zero modulo h - p and p^k.
"""

from typing import Any

from flint import fmpq, fmpq_mpoly_ctx
from flint.utils.flint_exceptions import FlintError

from rbstab.proof.check.energy import Energy, operands

Poly = Any
"""An `fmpq_mpoly` of python-flint."""

MOST_TERMS = 2000


class _NoFormError(Exception):
    """An operation has another form, or too many terms."""


def why_not_smooth(U: Energy) -> str | None:
    """Return what is not shown about the steps of an energy; None if all is."""
    steps = {k: operation[2] for k, operation in enumerate(U.operations) if operation[0] == "step"}
    for k in steps:
        try:
            smooth = _Switch(U, k).is_smooth
        except _NoFormError as error:
            return f"That step {k + 1} is as smooth as it says could not be confirmed: {error}"
        if not smooth:
            return f"Step {k + 1} is not as smooth as it says"
    if any(
        operation[0] == "positive" and operation[1] not in steps.values()
        for operation in U.operations
    ):
        return "A positive part has no step of its own"
    return None


class _Switch:
    """One step of an energy."""

    def __init__(self, U: Energy, step: int) -> None:
        self.U, self.step = U, step
        _, self.order, self.inner = U.operations[step]
        named = [
            k for k, operation in enumerate(U.operations) if operation[0] not in ("sum", "times")
        ]
        self.ring = fmpq_mpoly_ctx.get([*(f"x{k}" for k in named), "p"])
        *symbols, self.p = self.ring.gens()
        self.symbols = dict(zip(named, symbols, strict=True))
        h = self._values(None)[self.inner]
        if h.is_constant():
            raise _NoFormError("its argument is a number")
        self.relation = h - self.p  # p is the last symbol: the largest monomial is one of h

    @property
    def is_smooth(self) -> bool:
        """Whether U1 - U0 has no power of h below the order."""
        U1, U0 = (self._values(on)[-1] for on in (True, False))
        return not self._reduced(U1 - U0)

    def _values(self, on: bool | None) -> list[Poly]:
        """Return all operations as polynomials of symbols, where the step is on, off, or either."""
        values, touched = list[Poly](), list[bool]()
        for k, (kind, *rest) in enumerate(self.U.operations):
            positive = kind == "positive" and rest[0] == self.inner
            touched.append(
                k == self.step or positive or any(touched[j] for j in operands((kind, *rest)))
            )
            if kind == "sum":
                x = self.ring.constant(rest[0])
                for c, j in rest[1]:
                    x += values[j] * c
            elif kind == "times":
                x = _times(values[rest[0]], values[rest[1]])
            elif kind == "pow" and rest[0] > 0:
                x = values[rest[1]]
                for _ in range(rest[0] - 1):
                    x = _times(x, values[rest[1]])
            elif on is not None and k == self.step:
                x = self.ring.constant(int(on))
            elif on and positive:
                # Where the step is off, a positive part has another form: it is a symbol.
                x = self.p
            elif on is None or kind == "var":
                # With None for `on`, all functions are symbols.
                x = self.symbols[k]
            else:
                x = self._function(k, kind, rest, values[rest[-1]], must=on and touched[k])
            values.append(x)
        return values

    def _function(self, k: int, kind: str, rest: list[Any], x: Poly, *, must: bool) -> Poly:
        """Return a function of a series in p with numbers, near h = 0."""
        x = self._reduced(x)
        parts = x.to_dict()
        c0 = fmpq(0)
        if not any(any(m[:-1]) for m in parts):
            c0 = parts.get((0,) * (len(self.symbols) + 1), c0)
        # A step and a positive part must not change near h = 0.
        if c0 and kind in ("step", "positive"):
            side = self.ring.constant(int(c0 > 0))
            return side if kind == "step" else side * x
        if c0 > 0 and kind in ("sqrt", "pow"):
            try:
                n, root = (fmpq(1, 2), c0.sqrt()) if kind == "sqrt" else (rest[0], c0 ** rest[0])
                return self._power(x / c0 - 1, n, root)
            except FlintError:  # the root is no rational number
                pass
        # If the step is on, only functions that do not depend on it are symbols.
        if must:
            raise _NoFormError(f"{kind} of it has no series")
        return self.symbols[k]

    def _power(self, u: Poly, n: Any, factor: Any) -> Poly:
        """Return the binomial series factor·(1 + u)^n up to the order."""
        total, term = self.p * 0, self.ring.constant(factor)
        for k in range(self.order):
            total += term
            term = _times(term, u) * (fmpq(n - k) / (k + 1))
        return total

    def _reduced(self, x: Poly) -> Poly:
        """Return a polynomial modulo h - p and p^k."""
        _, left = divmod(x, self.relation)
        kept = {m: c for m, c in left.to_dict().items() if m[-1] < self.order}
        return self.ring.from_dict(kept)


def _times(x: Poly, y: Poly) -> Poly:
    if len(x) * len(y) > MOST_TERMS:
        raise _NoFormError("it has too many terms")
    return x * y
