"""Graphs of equations: their values and derivatives are those of the equations in doubles."""

from functools import partial
from typing import Any

import numpy as np
import pytest
from flint import arb
from support.configs import BY_VARIANT, plain
from support.systems import random_state, random_system

from rbstab.analysis.motion_proof.motion import proof_precision
from rbstab.analysis.motion_proof.sets import equations as equations_module
from rbstab.analysis.motion_proof.sets.equations import equations_of
from rbstab.analysis.motion_proof.sets.graph import COSINE, SINE, Graph, traced
from rbstab.analysis.motion_proof.sets.models import Model, evaluated
from rbstab.analysis.motion_proof.sets.monomials import Monomials
from rbstab.config.load import load_config
from rbstab.experiment.convergence.enclosed_system import enclosed_system
from rbstab.mechanics.derivatives import jacobian
from rbstab.systems.coordinates import CentreCoordinates, ContactCoordinates, ReducedCoordinates
from rbstab.systems.parameters import map_parameters

CASES: list[tuple[str, Any]] = [
    ("free", CentreCoordinates()),
    ("free", ContactCoordinates()),
    ("permanent", ReducedCoordinates()),
    ("visco-elastic", CentreCoordinates()),
    ("visco-elastic", ContactCoordinates()),
    ("embedded", CentreCoordinates()),
    ("embedded", ContactCoordinates()),
]
NAMES = [f"{variant}-{coordinates.name}" for variant, coordinates in CASES]

OPERATIONS: dict[str, Any] = {
    "product": lambda a, b: a * b,
    "inverse": lambda a: 1 / a,
    "sine": np.sin,
    "cosine": np.cos,
}


def computed(graph, forms, point):
    """Return the values of forms in doubles, node by node."""
    values: list[float] = []

    def value(form):
        return float(arb(form.constant)) + sum(
            float(arb(factor)) * values[node] for node, factor in form.terms.items()
        )

    for number, node in enumerate(graph.nodes):
        if node.kind == "variable":
            values.append(point[number])
        else:
            values.append(OPERATIONS[node.kind](*map(value, node.operands)))
    return np.array([value(form) for form in forms])


def graph_of(system):
    """Return a graph, its variables, and the system with forms as parameters."""
    graph = Graph()
    return (
        graph,
        graph.variables(system.size),
        map_parameters(system, lambda _, x: graph.numbers(x)),
    )


def assert_near(found, expected):
    """Check that two arrays agree to some round-off of their largest entry."""
    assert found == pytest.approx(expected, rel=1e-9, abs=1e-11 * np.abs(expected).max())


@pytest.mark.parametrize("seed", range(len(CASES)), ids=NAMES)
def test_values_and_derivatives_are_those_of_the_equations(seed):
    """Random bodies, full matrices of gains, gravity, and any anchor."""
    rng, (variant, coordinates) = np.random.default_rng(seed), CASES[seed]
    system = random_system(rng, variant, coordinates)
    graph, variables, exact = graph_of(system)

    def energies(y):
        return system.observe(y).energy

    functions = [(system.rates, exact.rates), (energies, lambda y: exact.observe(y).energy)]
    found = []
    for doubles, forms_of in functions:
        forms = traced(forms_of, graph, variables)
        slopes = [graph.derivative(form, j) for form in forms for j in range(system.size)]
        found.append((doubles, forms, slopes))
    for _ in range(3):
        y = random_state(rng, system)
        for doubles, forms, slopes in found:
            assert_near(computed(graph, forms, y), doubles(y))
            expected = jacobian(doubles, y)
            assert_near(computed(graph, slopes, y).reshape(expected.shape), expected)


@pytest.mark.parametrize("anchor", ["origin", "equilibrium"])
@pytest.mark.parametrize("variant", ["permanent", "visco-elastic", "embedded"])
def test_equations_of_a_config(variant, anchor):
    rng, data = np.random.default_rng(9), plain(BY_VARIANT[variant])
    data["gravity"] = [3.0, -7.0, -9.81]
    data["controller"] |= {"anchor": anchor, "K_t": [[900, 20, 5], [20, 800, 9], [5, 9, 700]]}
    config = load_config(data)
    with proof_precision():
        equations = equations_of(partial(enclosed_system, config))
    system = enclosed_system(config, lambda values: values)
    y = rng.normal(size=system.size) * 0.3
    assert_near(values_of(equations.rates, y), system.rates(y))
    assert_near(values_of(equations.energy, y), np.array([system.observe(y).energy.sum()]))
    expected = jacobian(system.rates, y)
    found = np.zeros_like(expected)
    for place, value in zip(equations.places, values_of(equations.jacobian, y), strict=True):
        found[place] = value
    assert_near(found, expected)
    assert len(set(equations.places)) == len(equations.places)
    # No entry that depends on the state is left out, and no derivative is zero everywhere.
    seen = {(int(i), int(j)) for i, j in np.argwhere(expected)}
    assert seen <= set(equations.places)


def values_of(program, y):
    """Return the values of a program at one point, by models that are constants."""
    space = Monomials(1, 1)
    models = [Model(space, np.array([[x], [0.0]]), np.zeros(1)) for x in y.tolist()]
    return np.array([one.polynomial[0, 0] for one in evaluated(program, models)])


def variables_of_graph(count=2):
    graph = Graph()
    return graph, *graph.variables(count)


def test_factors_of_quotients_and_products():
    """They are taken out of nodes, and come back as they are."""
    graph, x, y = variables_of_graph()
    forms = [1 / (4 * x), x / (4 * y), (4 * x) * (8 * y), 3 / (2 * x + 1), -(x - 2 * y) / 4, 1 - x]
    a, b = 0.75, -1.25
    expected = [1 / (4 * a), a / (4 * b), 32 * a * b, 3 / (2 * a + 1), -(a - 2 * b) / 4, 1 - a]
    assert computed(graph, forms, [a, b]) == pytest.approx(expected, rel=1e-15)


def test_equal_nodes_are_made_once():
    graph, x, y = variables_of_graph()
    product = x * y
    assert (y * x).terms == product.terms
    assert (2 * x * (3 * y)).terms == (6 * product).terms
    assert ((x + y).inverse() - 1 / (y + x)).terms == {}
    assert (x.sin() - x.sin()).terms == {}
    assert len(graph.nodes) == 5  # with the product, the inverse and the sine
    assert [node.kind for node in graph.nodes].count(SINE) == 1
    assert x.cos().terms != x.sin().terms
    assert [node.kind for node in graph.nodes].count(COSINE) == 1


def test_equal_balls_are_not_equal_numbers():
    """Two products of decimals that differ by 3e-26 have the same ball in 80 bits."""
    with proof_precision():
        graph, x, _ = variables_of_graph()
        a, b, c, d = graph.numbers(
            np.array([1.0000000000001, 0.9999999999999, 1.0000000000002, 0.9999999999998])
        )
        difference = (x + a * b).inverse() - (x + c * d).inverse()
        assert len(difference.terms) == 2
        same = (x + a * b).inverse() - (x + b * a).inverse()
        assert same.terms == {}
        # Sines of numbers are balls; each stands for itself.
        one, other = a.sin(), a.sin()
        assert len(((x + one).inverse() - (x + other).inverse()).terms) == 2
        assert not equations_module._is_zero(a.sin() - a.sin())
        assert len((x * one - x * one).terms) == 1


def test_numbers_of_other_kinds_are_refused():
    graph, x, _ = variables_of_graph()
    for wrong in (1j, "1", None):
        with pytest.raises(TypeError):
            graph.form(wrong)
    with pytest.raises(TypeError):
        x * 1j


def test_a_constant_is_the_decimal_and_not_its_double():
    graph, x, _ = variables_of_graph()
    (tenth,) = graph.numbers(np.array([0.1]))
    assert (10 * tenth - 1).constant == 0
    assert (graph.form(0.1) * 10 - 1).constant != 0
    assert (3 - x * 0.0).constant == 3
    assert (x / 4 - 0.25 * x).terms == {}
    assert (1 - x).terms[0] == -1
    assert graph.form(0.0).cos().constant == 1


def test_derivatives_that_are_zero_are_left_out():
    graph, x, y = variables_of_graph()
    assert equations_module._is_zero(graph.derivative(x * x + 3, 1))
    assert equations_module._is_zero(graph.derivative(x * y - y * x, 1))
    assert not equations_module._is_zero(graph.derivative(x * y, 1))
    assert not equations_module._is_zero(graph.derivative(3 * y, 1))
