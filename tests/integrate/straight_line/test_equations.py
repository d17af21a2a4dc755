"""The code that is made from the equations gives their numbers, for every element and coordinates.

The reference is the equations with intervals of 53 bits: each operation widens its result by its
rounding. So the result of the same operations on doubles is within two radii of the ball, and the
radius is as small as the sizes of the terms allow. An error that is not rounding is larger.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from flint import arb, ctx
from support.balls import arbs
from support.differences import relative_error
from support.elements import CASES, case_id, random_element
from support.systems import random_body, random_state, random_system

from rbstab.config.build import problem_of
from rbstab.config.load import load_config
from rbstab.elements.registry import CONNECTORS
from rbstab.integrate.implicit import after_step, end_of_step, with_sides
from rbstab.integrate.straight_line.equations import StraightLine
from rbstab.mechanics.derivatives import jacobian
from rbstab.systems.coordinates import (
    CentreCoordinates,
    ContactCoordinates,
    ManifoldCoordinates,
    ReducedCoordinates,
)
from rbstab.systems.parameters import map_parameters
from rbstab.systems.system import System

CONFIGS = sorted((Path(__file__).parents[3] / "configs").glob("*/*.yaml"))
CONFIGS = [path for path in CONFIGS if path.parent.name in {"paper", "examples"}]

COORDINATES = {
    "free": (CentreCoordinates(), ContactCoordinates()),
    "permanent": (ReducedCoordinates(), ManifoldCoordinates(), ManifoldCoordinates(3.0)),
    **{variant: (CentreCoordinates(), ContactCoordinates()) for variant in CONNECTORS},
}
EVERY = [(variant, chosen) for variant, every in COORDINATES.items() for chosen in every]


def audited(system, y):
    return np.concatenate([y, [0.3, -0.2]])


def balls(equations, system, x):
    """Return the equations at a state, in intervals of 53 bits."""
    with ctx.workprec(53):
        in_balls = map_parameters(system, lambda _, value: arbs(value))
        return [arb(entry) for entry in equations(in_balls, arbs(x))]


def check(equations, system, x):
    """Assert that the code gives the numbers of the equations, but for round-off."""
    line = StraightLine(equations, system, len(x))
    values, bounds = line.finite_value(x), balls(equations, system, x)
    assert values is not None
    assert values.dtype == float
    assert len(values) == len(bounds)
    scale = max(abs(float(bound.mid())) for bound in bounds)
    for value, bound in zip(values.tolist(), bounds, strict=True):
        assert abs(value - float(bound.mid())) <= 2.0 * float(bound.rad())
        assert float(bound.rad()) < 1e-11 * scale
    in_complex = line.finite_value(x + 0j)
    assert in_complex is not None
    assert relative_error(in_complex, values) < 1e-14
    slopes = jacobian(lambda z: equations(system, z), x)
    assert relative_error(jacobian(line, x), slopes, np.abs(slopes).max() or 1.0) < 1e-13


@pytest.mark.parametrize(("variant", "coordinates"), EVERY, ids=str)
def test_every_variant_in_all_coordinates(rng, variant, coordinates):
    system = random_system(rng, variant, coordinates)
    check(System.audited_rates, system, audited(system, random_state(rng, system)))


@pytest.mark.parametrize(("kind", "form"), CASES, ids=map(case_id, CASES))
@pytest.mark.parametrize("coordinates", [CentreCoordinates(), ContactCoordinates()], ids=str)
def test_every_element_alone(rng, kind, form, coordinates):
    element = random_element(rng, kind, form)
    system = System(random_body(rng), (element,), coordinates, rng.normal(size=3) * 0.1)
    check(System.audited_rates, system, audited(system, random_state(rng, system)))


@pytest.mark.parametrize("path", CONFIGS, ids=lambda path: path.stem)
def test_every_config_with_its_zeros(path):
    problem = problem_of(load_config(path, allow_python=True))
    rng = np.random.default_rng(5)
    for _ in range(3):
        state = random_state(rng, problem.system)
        check(System.audited_rates, problem.system, audited(problem.system, state))


@pytest.mark.parametrize("h", [1e-4, 0.1])
def test_the_implicit_step(rng, h):
    system = with_sides(random_system(rng, "sliding", ContactCoordinates()), np.zeros(3))
    y = audited(system, random_state(rng, system))
    check(end_of_step, system, np.append(y, h))
    check(after_step, system, np.concatenate([y, [h], rng.uniform(-1.0, 1.0, 3)]))


def test_negative_zeros_and_integers_are_parameters_too(rng):
    system = random_system(rng, "visco-elastic")
    body = replace(system.body, mass=3, contact_point=np.array([1, 0, -2]))
    system = replace(system, body=body, anchor=np.array([-0.0, 0.1, 0.0]))
    check(System.audited_rates, system, audited(system, random_state(rng, system)))
