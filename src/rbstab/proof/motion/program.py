"""A function of the states as a list of operations, each on many nodes of its graph at once."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.proof.motion.graph import PRODUCT, VARIABLE, Form, Graph
from rbstab.proof.motion.rounding import middle_and_radius


@dataclass(frozen=True, eq=False)
class Sums:
    """Sums of nodes with constant factors, plus constants: doubles, with bounds on their errors.

    Attributes:
        places: The places of the nodes of each sum, shape (sums, terms); shorter sums have factors
            of zero at their end.
        factors: Shape (sums, terms).
        radii: Bounds on their errors.
        constants: Shape (sums, 1).
        constant_radii: Bounds on their errors.
    """

    places: Array
    factors: Array
    radii: Array
    constants: Array
    constant_radii: Array

    def __len__(self) -> int:
        return len(self.places)

    def __getitem__(self, chosen: slice) -> "Sums":
        """Return some of the sums."""
        parts = (self.places, self.factors, self.radii, self.constants, self.constant_radii)
        return Sums(*(part[chosen] for part in parts))


@dataclass(frozen=True, eq=False)
class Operation:
    """Nodes of one kind, none of which needs another of them.

    Attributes:
        kind: Their kind.
        nodes: Their places.
        operands: Two operands of products, one of functions.
        slopes: The derivatives of functions by their operands; None for products.
    """

    kind: str
    nodes: slice
    operands: tuple[Sums, ...]
    slopes: Sums | None


@dataclass(frozen=True, eq=False)
class Program:
    """What is needed to compute some forms of a graph, in order.

    Attributes:
        numbers: The numbers in the graph of its nodes, by place: first all variables.
        operations: The operations.
        results: The forms.
        variables: The number of variables.
    """

    numbers: tuple[int, ...]
    operations: tuple[Operation, ...]
    results: Sums
    variables: int

    def __len__(self) -> int:
        return len(self.numbers)

    @cached_property
    def place(self) -> dict[int, int]:
        """The place of each node of the graph."""
        return {number: place for place, number in enumerate(self.numbers)}

    def places_in(self, larger: "Program") -> list[int]:
        """Return where another program, which has all these nodes, has them."""
        return [larger.place[number] for number in self.numbers]


def program(graph: Graph, variables: int, forms: Iterable[Form]) -> Program:
    """Return the program of some forms of a graph; its first nodes are the variables."""
    forms = tuple(forms)
    depth, slopes = dict.fromkeys(range(variables), 0), dict[int, Form]()
    pending = [node for form in forms for node in form.terms]
    while pending:
        node = pending.pop()
        if node in depth:
            continue
        needed = [graph.nodes[node].operands]
        if graph.nodes[node].kind != PRODUCT:
            slopes[node] = graph.slope(node)
            needed.append((slopes[node],))
        depth[node] = -1  # known below, when its operands are
        pending += [other for some in needed for form in some for other in form.terms]
    for node in sorted(depth):  # operands have smaller numbers
        below = [depth[one] for form in graph.nodes[node].operands for one in form.terms]
        depth[node] = 1 + max(below, default=-1)
    order = sorted(depth, key=lambda node: (depth[node], graph.nodes[node].kind, node))
    order = [*range(variables), *(node for node in order if node >= variables)]
    place = {node: k for k, node in enumerate(order)}
    groups: dict[tuple[int, str], list[int]] = {}
    for node in order[variables:]:
        groups.setdefault((depth[node], graph.nodes[node].kind), []).append(node)
    operations = []
    for (_, kind), nodes in groups.items():
        assert kind != VARIABLE
        operands = zip(*(graph.nodes[node].operands for node in nodes), strict=True)
        operations.append(
            Operation(
                kind,
                slice(place[nodes[0]], place[nodes[-1]] + 1),
                tuple(_sums(some, place) for some in operands),
                None if kind == PRODUCT else _sums([slopes[node] for node in nodes], place),
            )
        )
    return Program(tuple(order), tuple(operations), _sums(forms, place), variables)


def _sums(forms: Iterable[Form], place: dict[int, int]) -> Sums:
    forms = tuple(forms)
    terms = max((len(form.terms) for form in forms), default=0)
    places = np.zeros((len(forms), terms), dtype=int)
    factors, radii = np.zeros((2, len(forms), terms))
    constants, constant_radii = np.zeros((2, len(forms), 1))
    for k, form in enumerate(forms):
        constants[k], constant_radii[k] = _double(form.constant)
        for j, (node, factor) in enumerate(form.terms.items()):
            places[k, j] = place[node]
            factors[k, j], radii[k, j] = _double(factor)
    return Sums(places, factors, radii, constants, constant_radii)


def doubles_of(constants: Iterable[Form]) -> tuple[Array, Array]:
    """Return forms without nodes as doubles, and bounds on the errors."""
    found = np.array([_double(form.constant) for form in constants])
    return found[:, 0], found[:, 1]


def _double(constant: Any) -> tuple[float, float]:
    from flint import arb  # imported late: most runs need no balls

    return middle_and_radius(arb(constant))
