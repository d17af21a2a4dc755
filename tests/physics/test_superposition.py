"""Forces of elements add: two connectors that share a force move the body like one."""

from dataclasses import replace

import numpy as np
import pytest
from support.problems import problem, solve
from support.systems import random_system

TIMES = np.linspace(0.0, 0.5, 11)


def gains_scaled(element, part):
    return replace(
        element, **{name: part * getattr(element, name) for name in ("K_c", "L_c", "K_d", "L_d")}
    )


@pytest.mark.parametrize("order", [1, -1], ids=["in order", "reversed"])
def test_two_connectors_of_part_strength_pull_as_one(order):
    # Parts of 0.3 and 0.7, each with its own state. Only the mean of the states with these weights
    # acts on the body, and it moves like the state of the single connector.
    rng = np.random.default_rng(4)
    one = random_system(rng, "embedded")
    connector = one.elements[-1]
    parts = (gains_scaled(connector, 0.3), gains_scaled(connector, 0.7))
    two = replace(one, elements=(*one.elements[:-1], *parts)[::order])
    Z = np.concatenate([[0.2, -0.3, 0.1], rng.normal(size=3), rng.normal(size=6) * 0.1])
    D, apart = np.array([0.05, -0.02, 0.03]), np.array([0.1, 0.2, -0.1])
    own = [D + 0.7 * apart, D - 0.3 * apart][::order]
    expected = solve("scipy", problem(one, np.concatenate([Z, D]), TIMES))
    found = solve("scipy", problem(two, np.concatenate([Z, *own]), TIMES))
    np.testing.assert_allclose(found.states[:, :12], expected.states[:, :12], rtol=0, atol=1e-10)
    first, second = (found.states[:, 12:15], found.states[:, 15:18])[::order]
    mean = 0.3 * first + 0.7 * second
    np.testing.assert_allclose(mean, expected.states[:, 12:], rtol=0, atol=1e-10)
    assert np.abs(first - second).max() > 0.1
    np.testing.assert_allclose(found.contact_work, expected.contact_work, rtol=0, atol=1e-8)
