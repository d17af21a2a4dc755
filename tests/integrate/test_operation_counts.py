"""How many operations one more element adds to the compiled equations, and a switch to a run.

Times depend on the machine, and these counts do not. Every common expression is computed once.
"""

import re
from collections import Counter
from dataclasses import replace
from typing import Any

import numpy as np
from support.config_elements import CONTROLLER
from support.problems import solve
from support.switching import problem

from rbstab.elements.visco_elastic import ViscoElasticTie
from rbstab.integrate.heyoka.equations import compiled_equations
from rbstab.integrate.heyoka.symbols import compiled_zeros
from rbstab.integrate.problem import Problem
from rbstab.integrate.switching.driver import Driver
from rbstab.integrate.switching.phase import Phase
from rbstab.systems.system import System

RTOL = 1e-9

LOOSE = 0.1
"""The operations are the same for all tolerances. With this one they compile in a moment."""

PRODUCT, SQUARE = "(u * u)", f"u**{2.0:.16f}"
"""A product of two variables and a square, as heyoka prints them."""

ENDS = {"point": [0.15, 0.1, -0.3], "anchor": [0.15, 0.3, -0.5]}
GAINS = {"K_c": [5.0, 6.0, 7.0], "L_c": [0.5, 0.6, 0.7]}
FULL = [[5.0, 0.1, 0.2], [0.1, 6.0, 0.3], [0.2, 0.3, 7.0]]

TIE = {"kind": "visco-elastic", **ENDS, **GAINS}
SPRING = {"kind": "spring", **ENDS, "stiffness": 700.0, "rest_length": 0.28, "damping": 2.0}
ATTITUDE = {"kind": "attitude", "K": [5.0, 6.0, 7.0], "L": [0.5, 0.6, 0.7]}
LIGAMENT = {
    "kind": "ligament",
    **ENDS,
    "stiffness": 200.0,
    "slack_length": 0.28,
    "toe_strain": 0.03,
    "damping": 2.0,
}


def case(*elements):
    """Return a spinning body with a visco-elastic controller and some elements."""
    named = {f"element_{number}": element for number, element in enumerate(elements)}
    controller = CONTROLLER | {
        "variant": "visco-elastic",
        "K_c": [400.0, 400.0, 320.0],
        "L_c": [60.0, 60.0, 42.0],
    }
    config = {
        "schema_version": 2,
        "body": {"mass": 41, "inertia": [10, 8, 9], "contact_point": [0.15, 0.1, -0.42]},
        "controller": controller,
        "elements": named,
        "initial": {"angular_velocity": [2.0, 1.0, 3.0]},
        "integration": {"duration": 2.0, "samples": 201, "engine": "heyoka"},
    }
    given: Problem = problem(config)
    return replace(given, rtol=RTOL)


def operations(given):
    """Return how many operations of each kind the compiled equations have."""
    integrator = compiled_equations(given.system, LOOSE).integrator
    states = len(integrator.state)
    steps = [str(step) for step, _ in integrator.decomposition[states:-states]]
    kinds = (re.sub(r"[up]_?\d+", lambda name: name.group()[0], step) for step in steps)
    return Counter(kinds)


def added(*elements):
    """Return what the last of some elements adds to the operations."""
    more, fewer = operations(case(*elements)), operations(case(*elements[:-1]))
    more.subtract(fewer)
    return more


def test_products_of_two_variables_are_few():
    """In a Taylor series such a product takes longest: twice as long as a square."""
    tie, spring, attitude = added(TIE), added(SPRING), added(ATTITUDE)
    # A (Ω × p) and A'f with nine each, and the squares of F. None with p, which is a constant.
    assert (tie[PRODUCT], tie[SQUARE]) == (9 + 9, 3)
    # A'X; e'V and q'Ω; e and q times the tension by ℓ. The squares of dℓ/dt and of e, of which two
    # are one operation.
    assert (spring[PRODUCT], spring[SQUARE]) == (9 + 6 + 6, 1 + 1)
    # A damped controller has the squares of Ω already.
    assert (attitude[PRODUCT], attitude[SQUARE]) == (0, 0)


def test_zeros_of_gains_and_points_cost_nothing():
    full, diagonal = added(TIE | {"K_c": FULL, "L_c": FULL}), added(TIE)
    # K e and L ė: six products and six sums more, each; so has ė'L ė, with the sums of L.
    assert full.total() == diagonal.total() + 3 * 12
    # A p and Ω × p then have three and two products, and A'f is needed by one row less.
    on_axis = added(TIE | {"point": [0.0, 0.0, -0.3]})
    assert on_axis[PRODUCT] == 6 + 6


def test_systems_with_other_zeros_are_compiled_again_and_are_right():
    """The gains of a tie with and without zeros, one after the other, both ways round."""
    diagonal, full = case(TIE), case(TIE | {"K_c": FULL, "L_c": FULL})
    assert compiled_zeros(diagonal.system) != compiled_zeros(full.system)
    for given in (diagonal, full, diagonal):
        trajectory = solve("heyoka", given)
        expected = solve("scipy", replace(given, rtol=1e-12))
        np.testing.assert_allclose(trajectory.states, expected.states, rtol=0, atol=1e-7)
    again = replace(diagonal.system, elements=tuple(map(_stiffer, diagonal.system.elements)))
    assert compiled_equations(again, RTOL) is compiled_equations(diagonal.system, RTOL)
    assert compiled_equations(full.system, RTOL) is not compiled_equations(diagonal.system, RTOL)


def _stiffer(element):
    """Return a tie of other gains with the same zeros; any other element as it is."""
    tied = isinstance(element, ViscoElasticTie)
    return replace(element, K_c=2.0 * element.K_c) if tied else element


def test_a_run_with_switches_evaluates_its_margins_once_a_step(monkeypatch):
    """Also where a mode switches inside heyoka's loop, and once before the first step.

    A switch that the driver makes itself ends a step whose margins are looked at again.
    """
    given = case(LIGAMENT)
    calls: Counter[str] = Counter()

    def counted(name: str, function: Any) -> Any:
        def call(*args: Any) -> Any:
            calls[name] += 1
            return function(*args)

        return call

    monkeypatch.setattr(Phase, "margin_list", counted("lists", Phase.margin_list))
    cross = Driver.cross_alone
    monkeypatch.setattr(Driver, "cross_alone", counted("switches", cross))
    monkeypatch.setattr(Phase, "margins", counted("margins", Phase.margins))
    owners = vars(System)["clearance_owners"].fget
    monkeypatch.setattr(System, "clearance_owners", property(counted("owners", owners)))
    trajectory = solve("heyoka", given)
    assert calls["switches"] >= 2
    assert trajectory.steps < calls["lists"] <= trajectory.steps + 2
    assert calls["margins"] == 0
    assert calls["owners"] == 1
