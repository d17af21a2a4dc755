"""An axis on s = F + κE is held if its bound allows it, and otherwise leaves to the right side."""

from dataclasses import replace

import numpy as np
import pytest
from support.sliding import connector, paper_problem, pushed_ball

from rbstab.integrate.implicit.axis_modes import (
    Modes,
    SurfaceDynamics,
    modes_on_surface,
    system_for_modes,
)
from rbstab.integrate.switching import modes as switching_modes

SLOPE, K = 20.0, 30.0


def body_on_the_surface(rng, axes):
    """Return the paper's body in a random state with s = 0 on these axes, and random bounds."""
    system = paper_problem(1.0, slope=SLOPE).system
    y = np.concatenate([rng.normal(0, 0.3, 3), rng.normal(0, 15, 3), np.zeros(6)])
    y[6:9] = rng.normal(0, 0.05, 3)
    y[9:12] = rng.normal(0, 1, 3)
    y[9:12][axes] = -SLOPE * y[6:9][axes]
    every = Modes((0.0, 0.0, 0.0), held=(1.0, 1.0, 1.0))
    needed = np.abs(SurfaceDynamics(system_for_modes(system, every), y).force)
    bounds = replace(connector(1.0, SLOPE), K_s=needed * rng.uniform(0.3, 1.7, 3))
    return replace(system, elements=(*system.elements[:-1], bounds)), y


@pytest.mark.parametrize("axes", [[0], [1, 2], [0, 2], [0, 1, 2]])
def test_the_choice_is_consistent(axes):
    """A held axis needs at most its bound; another one leaves to the side where s grows.

    The body couples the axes: whether one can be held depends on the others.
    """
    rng, kinds = np.random.default_rng(5), set()
    for _ in range(60):
        system, y = body_on_the_surface(rng, axes)
        others = rng.choice([-1.0, 1.0], 3)
        chosen = modes_on_surface(system, y, Modes(tuple(others.tolist())), axes)
        now = SurfaceDynamics(system_for_modes(system, chosen), y)
        bounds = system.elements[-1].K_s
        for axis in range(3):
            side = chosen.mode[axis]
            if axis not in axes:
                assert side == others[axis]
            elif chosen.held[axis]:
                assert side == 0
                assert abs(now.force[axis]) <= bounds[axis] * (1 + 1e-9)
                assert now.surface_rate[axis] == pytest.approx(0, abs=1e-8)
            else:
                assert side * now.surface_rate[axis] > 0
                assert now.force[axis] == pytest.approx(-bounds[axis] * side)
        kinds.add(sum(chosen.held))
    assert len(kinds) == len(axes) + 1


@pytest.mark.parametrize("strength", [1e9, 1.0])
def test_a_choice_needs_the_dynamics_once(monkeypatch, strength):
    """Of the 27 choices for three axes, none is tried by the equations of motion."""
    examined = []

    class Counted(SurfaceDynamics):
        def __init__(self, *args):
            super().__init__(*args)
            examined.append(self)

    monkeypatch.setattr(switching_modes, "SurfaceDynamics", Counted)
    system, y = body_on_the_surface(np.random.default_rng(2), [0, 1, 2])
    strong = replace(system.elements[-1], K_s=np.full(3, strength))
    system = replace(system, elements=(*system.elements[:-1], strong))
    chosen = modes_on_surface(system, y, Modes((1.0, 1.0, 1.0)), [0, 1, 2])
    assert chosen.held == ((1, 1, 1) if strength > 1 else (0, 0, 0))
    assert len(examined) == 1


@pytest.mark.parametrize(
    ("load", "mode"),
    [
        (0.0, 0), (K, 0), (-K, 0), (K * (1 + 1e-10), 0), (-K * (1 + 1e-10), 0),
        (K * (1 + 1e-6), 1), (-K * (1 + 1e-6), -1),
    ],
)  # fmt: skip
def test_a_tie_to_round_off_is_held(load, mode):
    """The force that holds a ball at rest on the surface is its load."""
    axis = 1
    forces = np.array([50.0, load, 50.0])
    problem = pushed_ball(
        2.0, np.full(3, K), forces, np.zeros((3, 3)), np.zeros(3), np.zeros(3), [0, 1], 4.0
    )
    chosen = modes_on_surface(problem.system, problem.start, Modes((1.0, -1.0, 1.0)), [axis])
    assert chosen.mode == (1, mode, 1)
    assert chosen.held == (0, mode == 0, 0)
