"""The stored form of a proof: one energy as a list of exact operations, and claims about it.

A record is plain data (JSON), some 2 kB of it. `rbstab.proof.check` checks it and knows nothing
else of this package; this module writes records, reads them, and compares them with an energy.

    {"format": 1,
     "energy": {"operations": [...], "digest": "...", "free": [], "stop": null, "closed": [1]},
     "ranges": [{"end": ["pi", "pi/2", "pi"], "complete": true, "states": [...], ...}]}

An operation takes the results of earlier ones by their numbers; the last one is the energy:

    ["var", n]                  a variable: 0 to 2 are Θ, others z
    ["sum", c0, c, k, c, k]     c0 + Σ c x_k, with rational numbers as text, such as "-3/8"
    ["times", j, k]             a product
    ["pow", n, k]               a whole power, which may be negative
    ["sin", k]                  a function: also cos, exp, sqrt, log, atan
    ["step", n, k]              1 where x_k > 0, else 0; derivatives below the n-th do not jump
    ["positive", k]             x_k where it is positive, else 0
"""

from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import Any

from rbstab.proof.exact.atoms import FUNCTIONS, LET, POSITIVE, STEP, VAR, Atom, Monomial, term_order
from rbstab.proof.exact.expr import Expr, as_factor, expr, summed, variable
from rbstab.proof.exact.rewriting import with_outlined_steps
from rbstab.proof.model import Energy

FORMAT = 1
"""The number of this format."""

Record = dict[str, Any]
"""Plain data: what JSON can hold."""


class WrongRecordError(ValueError):
    """Data that is no record of this format."""


# -- operations -----------------------------------------------------------------------------------


class _Writer:
    """Writes an expression as operations; equal ones are written once."""

    def __init__(self) -> None:
        self.operations: list[list[Any]] = []
        self._numbers: dict[tuple[Any, ...], int] = {}

    def _put(self, *operation: Any) -> int:
        if operation not in self._numbers:
            self._numbers[operation] = len(self.operations)
            self.operations.append(list(operation))
        return self._numbers[operation]

    def sum(self, e: Expr) -> int:
        """Write an expression; return its number."""
        entries: list[Any] = [str(e.terms.get((), Fraction(0)))]
        for m, c in sorted(e.terms.items(), key=term_order):
            if m:
                entries += [str(c), self._monomial(m)]
        return self._put("sum", *entries)

    def _monomial(self, m: Monomial) -> int:
        factors = [self._power(a, p, alone=len(m) == 1) for a, p in m]
        product = factors[0]
        for other in factors[1:]:
            product = self._put("times", product, other)
        return product

    def _power(self, a: Atom, p: int, *, alone: bool) -> int:
        base = self._atom(a)
        # A sum that is one monomial is not to be read as several.
        return base if p == 1 and not (alone and a.kind == LET) else self._put("pow", p, base)

    def _atom(self, a: Atom) -> int:
        if a.kind == VAR:
            return self._put(VAR, a.argument)
        inner = self._argument(a.inner)
        if a.kind == LET:
            return inner
        return self._put(STEP, a.extra, inner) if a.kind == STEP else self._put(a.kind, inner)

    def _argument(self, e: Expr) -> int:
        """Write an expression; one that is an atom as such."""
        if len(e.terms) == 1:
            ((m, c),) = e.terms.items()
            if c == 1 and m:
                return self._monomial(m)
        return self.sum(e)


def operations_of(e: Expr) -> list[list[Any]]:
    """Return an expression as operations: the same ones for equal expressions."""
    writer = _Writer()
    last = writer.sum(e)
    assert last == len(writer.operations) - 1
    return writer.operations


def shared_operations(expressions: Sequence[Expr]) -> tuple[list[list[Any]], list[int]]:
    """Return several expressions as operations, and the number of each."""
    writer = _Writer()
    numbers = [writer.sum(e) for e in expressions]
    results = expressions_of(writer.operations)
    assert all(results[k] == e for k, e in zip(numbers, expressions, strict=True))
    return writer.operations, numbers


def expression_of(operations: Sequence[Sequence[Any]]) -> Expr:
    """Return the expression that operations describe.

    Raises:
        WrongRecordError: They describe none.
    """
    results = expressions_of(operations)
    if not results:
        raise WrongRecordError("there are no operations")
    return results[-1]


def expressions_of(operations: Sequence[Sequence[Any]]) -> list[Expr]:
    """Return the results of all operations.

    Raises:
        WrongRecordError: One of them cannot be read.
    """
    results: list[Expr] = []
    try:
        for kind, *rest in operations:
            results.append(_result(kind, rest, results))
    except (ArithmeticError, IndexError, TypeError, ValueError) as error:
        raise WrongRecordError(f"operation {len(results) + 1} cannot be read: {error}") from error
    return results


def _result(kind: str, rest: Sequence[Any], results: Sequence[Expr]) -> Expr:
    if any(isinstance(k, int) and k < 0 for k in rest[kind in {"pow", STEP} :]):
        raise IndexError("a negative number of an operation")
    if kind == VAR:
        return variable(rest[0])
    if kind == "sum":
        terms = zip(rest[1::2], rest[2::2], strict=True)
        return summed(
            [expr(Fraction(rest[0])), *(results[k].scaled(Fraction(c)) for c, k in terms)]
        )
    if kind == "times":
        return _factor(results[rest[0]]) * _factor(results[rest[1]])
    if kind == "pow":
        return _factor(results[rest[1]]) ** rest[0]
    if kind == STEP:
        return results[rest[1]].step(rest[0])
    if kind in FUNCTIONS or kind == POSITIVE:
        return results[rest[0]].function(kind)
    raise ValueError(f"there is no operation {kind!r}")


def _factor(e: Expr) -> Expr:
    return e if e.constant is not None else as_factor(e)


# -- the energy -----------------------------------------------------------------------------------


def energy_record(energy: Energy) -> Record:
    """Return an energy as plain data: the value of "energy" in a record."""
    U = energy.U if energy.plain is None else energy.plain
    operations = operations_of(U)
    assert expression_of(operations) == U
    return {
        "operations": operations,
        "digest": U.digest,
        "free": list(energy.free),
        "stop": None if energy.stop is None else str(energy.stop),
        "closed": sorted(energy.closed),
    }


def read_energy(record: Mapping[str, Any]) -> Energy:
    """Return the energy of a record, without what was eliminated from it.

    Raises:
        WrongRecordError: It is no record of an energy, or its digest is not that of its operations.
    """
    try:
        U, stop = expression_of(record["operations"]), record["stop"]
        free = tuple(int(k) for k in record["free"])
        closed = frozenset(int(k) for k in record["closed"])
        exact = None if stop is None else Fraction(stop)
        digest = record["digest"]
    except (KeyError, TypeError, ValueError) as error:
        raise WrongRecordError(f"the energy cannot be read: {error}") from error
    if U.digest != digest:
        raise WrongRecordError("the digest of the energy is not that of its operations")
    return Energy(with_outlined_steps(U), free, stop=exact, closed=closed, plain=U)


def difference_from(record: Mapping[str, Any], energy: Energy) -> str | None:
    """Return in which way a stored energy is not the one that is given; None if they are equal.

    Args:
        record: The value of "energy" in a record.
        energy: The energy that was traced from a config.
    """
    try:
        stored = read_energy(record)
    except WrongRecordError as error:
        return str(error)
    if stored.U != energy.U:
        return "their expressions are different"
    if stored.free != energy.free:
        return "they depend on different variables"
    if stored.stop != energy.stop:
        return "their stops are different"
    return None if stored.closed == energy.closed else "barriers close different angles"
