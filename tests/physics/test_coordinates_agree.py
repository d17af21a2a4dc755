"""All coordinates give the same motion, and the held body is the limit of a stiff connector."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from support.paper_runs import paper_config, reference_case
from support.problems import held_start, problem, solve
from support.systems import random_system

import rbstab
from rbstab.systems.coordinates import (
    CentreCoordinates,
    ContactCoordinates,
    ManifoldCoordinates,
    ReducedCoordinates,
)

TIMES = np.linspace(0.0, 1.0, 41)
ANGLES = np.array([0.2, -0.3, 0.1])
ERROR = 1e-10
FORCE_ERROR = 1e-10  # of the largest force on the trace

# With an empty cache heyoka compiles these coordinates for four to eight seconds.
COMPILED = pytest.param("heyoka", marks=pytest.mark.slow)


def observed(engine, system, start, **changes):
    """Return the observations of a trajectory, sample by sample."""
    trajectory = solve(engine, problem(system, start, TIMES, **changes))
    assert trajectory.status == "completed"
    return [system.observe(state) for state in trajectory.states]


def assert_same_motion(found, expected):
    for symbol in ("Theta", "Omega", "X", "V", "E", "F"):
        np.testing.assert_allclose(
            [getattr(o.motion, symbol) for o in found],
            [getattr(o.motion, symbol) for o in expected],
            rtol=0,
            atol=ERROR,
            err_msg=symbol,
        )
    force = np.array([o.contact_force for o in expected])
    np.testing.assert_allclose(
        [o.contact_force for o in found], force, rtol=0, atol=FORCE_ERROR * np.abs(force).max()
    )


@pytest.mark.parametrize(
    ("rate", "project"),
    [(0.0, False), (0.0, True), (10.0, False)],
    ids=["no control", "projection", "baumgarte"],
)
@pytest.mark.parametrize("engine", ["scipy", COMPILED])
def test_manifold_moves_as_reduced_coordinates(engine, rate, project):
    rng = np.random.default_rng(7)
    reduced = random_system(rng, "permanent", ReducedCoordinates())
    manifold = replace(reduced, coordinates=ManifoldCoordinates(rate))
    Omega = rng.normal(size=3) * 2
    expected = observed("scipy", reduced, held_start(reduced, ANGLES, Omega))
    start = held_start(manifold, ANGLES, Omega)
    assert_same_motion(observed(engine, manifold, start, project=project), expected)


@pytest.mark.parametrize(
    ("engine", "variant"),
    [
        ("scipy", "free"),
        ("scipy", "visco-elastic"),
        ("scipy", "embedded"),
        pytest.param("heyoka", "embedded", marks=pytest.mark.slow),
    ],
)
def test_contact_coordinates_move_as_centre_coordinates(engine, variant):
    rng = np.random.default_rng(11)
    by_centre = random_system(rng, variant, CentreCoordinates())
    by_contact = replace(by_centre, coordinates=ContactCoordinates())
    own = rng.normal(size=by_centre.size - 12) * 0.05
    Z = np.concatenate([ANGLES, rng.normal(size=3) * 2, rng.normal(size=6) * 0.2])
    motion = by_centre.motion(Z)
    expected = observed("scipy", by_centre, by_centre.start(motion, own))
    found = observed(engine, by_contact, by_contact.start(motion, own))
    assert_same_motion(found, expected)
    np.testing.assert_allclose(
        [o.own_states for o in found],
        [o.own_states for o in expected],
        rtol=0,
        atol=ERROR,
    )


def test_held_body_is_the_limit_of_a_stiff_connector():
    held = reference_case("permanent", with_gravity=True)
    sampling: dict[str, Any] = {"engine": "heyoka", "duration": 1.0, "samples": 11}
    limit = rbstab.simulate(paper_config("permanent", with_gravity=True, **sampling))
    errors = []
    for stiffness in (4e6, 8e6, 16e6, 32e6):
        # Strong damping prevents oscillation, so that only the connector's slow creep remains.
        gains = {
            "L_t": held["params"]["Lt"],
            "K_c": [stiffness] * 3,
            "L_c": [stiffness / 100] * 3,
        }
        start = {"velocity": held["initial"]["V"]}
        config = paper_config(
            "visco-elastic", with_gravity=True, controller=gains, initial=start, **sampling
        )
        tied = rbstab.simulate(config)
        names = ("orientation", "angular_velocity", "position", "contact_force")
        errors.append([np.abs(tied[name] - limit[name])[1:].max() for name in names])
    ratios = np.array(errors[:-1]) / np.array(errors[1:])
    # The error is of first order in 1/K: each doubling of K halves it.
    np.testing.assert_allclose(ratios, 2.0, rtol=0.02)
