"""The equations of a system as a graph, so that they can be evaluated for many numbers at once.

The nodes are the variables, products, and functions of one number. Between them stand sums with
constant factors: rational numbers, or balls where they are functions of constants. The graph is
traced from the equations of the house: a `Form` is one more kind of number.

Two equal balls need not stand for the same number, so only forms of equal rational numbers (or of
balls without an error) are taken to be equal.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from fractions import Fraction
from functools import partialmethod
from typing import Any, NoReturn

import numpy as np

from rbstab.analysis.exact import decimals
from rbstab.mechanics.numbers import Array, power
from rbstab.proof.exact.expr import Functions, meant

VARIABLE, PRODUCT, INVERSE = "variable", "product", "inverse"
SINE, COSINE, EXPONENTIAL = "sin", "cos", "exp"
ROOT, LOGARITHM, INVERSE_TANGENT = "sqrt", "log", "atan"

PRECISION = 80
"""Bits of a ball: rounding its middle to a double loses far more than the ball does."""

Key = tuple[Any, ...]


@contextmanager
def proof_precision() -> Iterator[None]:
    """Return a context in which balls have `PRECISION` bits."""
    from flint import ctx  # imported late: most runs need no balls

    with ctx.workprec(PRECISION):
        yield


@dataclass(frozen=True, eq=False)
class Node:
    """A node: its kind, and the forms from which it is computed."""

    kind: str
    operands: tuple["Form", ...]


class Form(Functions):
    """A number: a constant plus nodes with constant factors.

    Args:
        graph: The graph of the nodes.
        terms: The factor of each node, a constant, by the number of the node.
        constant: The constant: an `fmpq` or an `arb`.
    """

    __slots__ = ("constant", "graph", "terms")

    def __init__(self, graph: "Graph", terms: dict[int, Any], constant: Any) -> None:
        self.graph, self.terms, self.constant = graph, terms, constant

    def __add__(self, other: Any) -> Any:
        if isinstance(other, np.ndarray):
            return NotImplemented  # numpy takes over, entry by entry
        other = self.graph.form(other)
        terms = dict(self.terms)
        for node, factor in other.terms.items():
            total = terms.pop(node) + factor if node in terms else factor
            if total != 0:
                terms[node] = total
        return Form(self.graph, terms, self.constant + other.constant)

    __radd__ = __add__

    def __neg__(self) -> "Form":
        return self._scaled(-1)

    def __sub__(self, other: Any) -> Any:
        return NotImplemented if isinstance(other, np.ndarray) else self + -1 * other

    def __rsub__(self, other: Any) -> Any:
        return NotImplemented if isinstance(other, np.ndarray) else -self + other

    def __mul__(self, other: Any) -> Any:
        if isinstance(other, np.ndarray):
            return NotImplemented
        other = self.graph.form(other)
        if not other.terms:
            return self._scaled(other.constant)
        if not self.terms:
            return other._scaled(self.constant)
        (a, factor), (b, other_factor) = self._without_factor(), other._without_factor()
        product = self.graph.node(PRODUCT, *sorted((a, b), key=lambda one: one.key))
        return product._scaled(factor * other_factor)

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Any:
        if isinstance(other, np.ndarray):
            return NotImplemented
        return self * self.graph.form(other).inverse()

    def __rtruediv__(self, other: Any) -> Any:
        return NotImplemented if isinstance(other, np.ndarray) else self.inverse() * other

    def __pow__(self, exponent: Any) -> Any:
        """Return a whole power."""
        if isinstance(exponent, np.ndarray):
            return NotImplemented
        if exponent != int(exponent):
            raise TypeError(f"a form to the power of {exponent!r}")
        base: Any = self
        found: Any = power(base, abs(int(exponent))) if exponent else self.graph.form(1.0)
        return found if exponent >= 0 else found.inverse()

    def _refuse(self, *_: Any) -> NoReturn:
        raise TypeError("a form has no value that could be compared or converted")

    # Without these methods Python would compare identities, and take every number to be true.
    __bool__ = __eq__ = __ne__ = __lt__ = __le__ = __gt__ = __ge__ = _refuse
    __float__ = __int__ = __complex__ = _refuse
    __hash__ = object.__hash__

    def inverse(self) -> "Form":
        """Return 1/x."""
        if not self.terms:
            return Form(self.graph, {}, 1 / self.constant)
        whole, factor = self._without_factor()
        return self.graph.node(INVERSE, whole)._scaled(1 / factor)

    def _function(self, kind: str) -> "Form":
        from flint import arb

        if not self.terms:
            return Form(self.graph, {}, getattr(arb(self.constant), kind)())
        return self.graph.node(kind, self)

    def _scaled(self, factor: Any) -> "Form":
        if factor == 0:
            return self.graph.form(0.0)
        if factor == 1:
            return self
        terms = {node: one * factor for node, one in self.terms.items()}
        return Form(self.graph, terms, self.constant * factor)

    def _without_factor(self) -> tuple["Form", Any]:
        """Return a node without its factor, and the factor; a sum stays as it is, with 1."""
        if len(self.terms) == 1 and self.constant == 0:
            ((node, factor),) = self.terms.items()
            return self.graph.only(node), factor
        return self, 1

    @property
    def is_zero(self) -> bool:
        """Whether it is surely zero."""
        return not self.terms and bool(self.constant == 0)

    @property
    def key(self) -> Key:
        """A key that only equal forms share."""
        terms = sorted((node, *_constant_key(factor)) for node, factor in self.terms.items())
        return (tuple(terms), _constant_key(self.constant))


for _name in (SINE, COSINE, EXPONENTIAL, ROOT, LOGARITHM, INVERSE_TANGENT):
    setattr(Form, _name, partialmethod(Form._function, _name))


def _constant_key(constant: Any) -> Key:
    from flint import fmpq

    if isinstance(constant, fmpq):
        return (0, int(constant.p), int(constant.q))
    if constant.rad() == 0:
        return (1, *(int(x) for x in constant.mid().man_exp()))
    return (2, id(constant))  # the nodes of the graph keep their balls


@dataclass(eq=False)
class Graph:
    """The nodes of some functions, in an order in which they can be computed."""

    nodes: list[Node] = field(default_factory=list)
    _known: dict[Key, int] = field(default_factory=dict)
    _derivatives: dict[tuple[int, int], Form] = field(default_factory=dict)

    def variables(self, count: int) -> Array:
        """Add variables, and return them as an object array of forms."""
        first = len(self.nodes)
        self.nodes += [Node(VARIABLE, ()) for _ in range(count)]
        return _objects([self.only(first + k) for k in range(count)])

    def form(self, number: Any) -> Form:
        """Return a rational number, what a double means, a ball or a form as a form.

        Raises:
            TypeError: It is a number of another kind.
        """
        from flint import arb, fmpq

        if isinstance(number, Form):
            return number
        if isinstance(number, float | int | np.integer | Fraction):
            exact = meant(number)
            return Form(self, {}, fmpq(exact.numerator, exact.denominator))
        if not isinstance(number, arb | fmpq):
            raise TypeError(f"a form cannot be combined with {type(number).__name__}")
        return Form(self, {}, number)

    def only(self, node: int) -> Form:
        """Return a node as a form."""
        from flint import fmpq

        return Form(self, {node: fmpq(1)}, fmpq(0))

    def node(self, kind: str, *operands: Form) -> Form:
        """Return a node as a form; equal nodes are made once."""
        key = (kind, *(operand.key for operand in operands))
        if key not in self._known:
            self._known[key] = len(self.nodes)
            self.nodes.append(Node(kind, operands))
        return self.only(self._known[key])

    def numbers(self, values: Array) -> Array:
        """Return the numbers of a config as constants; forms stay as they are.

        This is a kind of number for `system_of` and `start_of`.
        """
        entries = [
            entry if isinstance(entry, Form) else self.form(decimals(np.array(entry))[()])
            for entry in values.ravel().tolist()
        ]
        return _objects(entries).reshape(values.shape)

    def traced(self, function: Callable[[Array], Any], variables: Array) -> tuple[Form, ...]:
        """Return the entries of a function of variables as forms."""
        return tuple(self.form(entry) for entry in np.ravel(function(variables)))

    def slope(self, node: int) -> Form:
        """Return the derivative of a function node by its operand."""
        kind, (x,), y = self.nodes[node].kind, self.nodes[node].operands, self.only(node)
        found: Form
        if kind == INVERSE:
            found = -(y * y)
        elif kind == SINE:
            found = x._function(COSINE)
        elif kind == COSINE:
            found = -x._function(SINE)
        elif kind == EXPONENTIAL:
            found = y
        elif kind == ROOT:
            found = 0.5 * y.inverse()
        elif kind == LOGARITHM:
            found = x.inverse()
        else:
            found = (1.0 + x * x).inverse()
        return found

    def derivative(self, of: Form, by: int) -> Form:
        """Return the derivative of a form by a variable, with nodes of this graph."""
        total = self.form(0.0)
        for node, factor in of.terms.items():
            total = total + self._node_derivative(node, by)._scaled(factor)
        return total

    def _node_derivative(self, node: int, by: int) -> Form:
        key = (node, by)
        if key not in self._derivatives:
            self._derivatives[key] = self._new_derivative(node, by)
        return self._derivatives[key]

    def _new_derivative(self, node: int, by: int) -> Form:
        kind, operands = self.nodes[node].kind, self.nodes[node].operands
        if kind == VARIABLE:
            return self.form(1.0 if node == by else 0.0)
        slopes = [self.derivative(operand, by) for operand in operands]
        if kind == PRODUCT:
            (a, b), (da, db) = operands, slopes
            found: Form = da * b + a * db
            return found
        return self.form(0.0) if slopes[0].is_zero else self.slope(node) * slopes[0]


def _objects(entries: list[Any]) -> Array:
    """Return numbers as an object array."""
    found = np.empty(len(entries), dtype=object)
    found[:] = entries
    return found
