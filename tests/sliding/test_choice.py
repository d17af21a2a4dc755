"""An axis on s = F + κE is held if its bound allows it, and otherwise leaves to the right side."""

from dataclasses import replace

import numpy as np
import pytest
from support.sliding import by_modes, connector, paper_problem, pushed_ball, sides_and_holds

from rbstab.systems.connector import connector_of, with_connector
from rbstab.systems.filippov import chosen

SLOPE, K = 20.0, 30.0


def body_on_the_surface(rng, axes):
    """Return the paper's body in a random state with s = 0 on these axes, and random bounds."""
    problem = paper_problem(1.0, slope=SLOPE)
    y = np.concatenate([rng.normal(0, 0.3, 3), rng.normal(0, 15, 3), np.zeros(6)])
    y[6:9] = rng.normal(0, 0.05, 3)
    y[9:12] = rng.normal(0, 1, 3)
    y[9:12][axes] = -SLOPE * y[6:9][axes]
    every = by_modes(problem, (0, 0, 0), (1, 1, 1))
    needed = np.abs(every.observe(y).contact_force)
    bounds = replace(connector(1.0, SLOPE), K_s=needed * rng.uniform(0.3, 1.7, 3))
    return replace(problem, system=with_connector(problem.system, bounds)), y


def surface_rate(system, y):
    """Return ṡ = Ḟ + κĖ of each axis."""
    rates = system.rates(y)
    return connector_of(system).surface(rates[6:9], rates[9:12])


@pytest.mark.parametrize("axes", [[0], [1, 2], [0, 2], [0, 1, 2]])
def test_the_choice_is_consistent(axes):
    """A held axis needs at most its bound; another one leaves to the side where s grows.

    The body couples the axes: whether one can be held depends on the others.
    """
    rng, kinds = np.random.default_rng(5), set()
    for _ in range(60):
        problem, y = body_on_the_surface(rng, axes)
        others = rng.choice([-1.0, 1.0], 3)
        now, after = chosen(by_modes(problem, others), y, np.array(axes))
        assert after == pytest.approx(y, abs=1e-11)
        bounds, force, rate = (
            connector_of(now).K_s,
            now.observe(y).contact_force,
            surface_rate(now, y),
        )
        sides, held = sides_and_holds(now)
        for axis in range(3):
            if axis not in axes:
                assert sides[axis] == others[axis]
            elif held[axis]:
                assert abs(force[axis]) <= bounds[axis] * (1 + 1e-9)
                assert rate[axis] == pytest.approx(0, abs=1e-8)
            else:
                assert sides[axis] * rate[axis] > 0
                assert force[axis] == pytest.approx(-bounds[axis] * sides[axis])
        kinds.add(sum(held))
    assert len(kinds) == len(axes) + 1


@pytest.mark.parametrize(
    ("load", "side"),
    [
        (0.0, 0), (K * (1 - 1e-6), 0), (-K * (1 - 1e-6), 0), (K, 1), (-K, -1),
        (K * (1 + 1e-6), 1), (-K * (1 + 1e-6), -1),
    ],
)  # fmt: skip
def test_an_axis_that_needs_its_whole_force_is_not_held(load, side):
    """The force that holds a ball at rest on the surface is its load.

    At the bound the motion is the same, held or not; a held axis would be released at once.
    """
    axis = 1
    forces = np.array([50.0, load, 50.0])
    problem = pushed_ball(
        2.0, np.full(3, K), forces, np.zeros((3, 3)), np.zeros(3), np.zeros(3), [0, 1], 4.0
    )
    now, _ = chosen(by_modes(problem, (1, -1, 1)), problem.start, np.array([axis]))
    assert sides_and_holds(now) == ([1, side, 1], [0, side == 0, 0])
