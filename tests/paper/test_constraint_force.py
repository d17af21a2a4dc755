"""Eq. 15, 16 and 17: the force of constraint holds C, also by projection, on the submanifold."""

from typing import Any, NamedTuple

import numpy as np
import pytest
from scipy.linalg import block_diag
from support.differences import along, derivative, relative_error
from support.path import held_path
from support.pose import attitude, turned
from support.systems import random_body, random_Z

from rbstab.mechanics import reduced
from rbstab.mechanics.body import Body
from rbstab.mechanics.constraint import (
    centripetal_acceleration,
    constraint_force,
)
from rbstab.mechanics.motion import (
    Motion,
    Wrench,
    applied_forces,
    contact_directions,
    free_rates,
    motion_from_centre,
)
from rbstab.systems.coordinates import ManifoldCoordinates


class Held(NamedTuple):
    """A body with the forces on it, and the quantities of eq. 9, 10 and 13."""

    body: Body
    motion: Motion
    Z: Any
    force: Any
    couple: Any
    applied: Any
    c: Any
    demand: Any


def under_forces(rng, body, anchor, Z):
    motion = motion_from_centre(body, anchor, Z)
    force, couple = rng.normal(size=3) * 100, rng.normal(size=3) * 100
    applied = applied_forces(body, motion, force, couple)
    c, demand = contact_directions(body, motion), centripetal_acceleration(body, motion)
    return Held(body, motion, Z, force, couple, applied, c, demand)


@pytest.fixture
def anywhere(rng):
    """Return a body under random forces, in a state that may lie off the submanifold."""
    return under_forces(rng, random_body(rng), rng.normal(size=3), random_Z(rng))


@pytest.fixture
def on_manifold(rng):
    body, anchor = random_body(rng), rng.normal(size=3)
    return under_forces(rng, body, anchor, held_path(rng, body, anchor).Z())


def contact_acceleration(held, Z_rates):
    """Return Ḟ along a flow, with F, the velocity of C, by geometry."""

    def F(Z):
        A = attitude(Z[0:3])
        return Z[9:12] + derivative(lambda t: turned(A, Z[3:6], t) @ held.body.contact_point)

    return along(F, held.Z, Z_rates)


def dynamics(held):
    """Return Ż and Λ in all twelve states."""
    wrench = Wrench(held.force, held.couple, np.zeros(3))
    return ManifoldCoordinates().dynamics(held.body, held.motion, wrench)


def mass_matrix(body):
    return block_diag(np.eye(3), body.inertia, np.eye(3), body.mass * np.eye(3))


def test_eq_15_force_of_constraint_stops_the_contact_point(anywhere):
    def acceleration_under(demand):
        Lambda_ = constraint_force(anywhere.body, anywhere.c, anywhere.applied, demand)
        wrench = Wrench(anywhere.force, anywhere.couple, Lambda_)
        rates = free_rates(anywhere.body, anywhere.motion, wrench)
        return np.abs(contact_acceleration(anywhere, rates)).max()

    scale = acceleration_under(np.zeros(3))
    assert acceleration_under(anywhere.demand) < 1e-9 * scale
    assert acceleration_under(-anywhere.demand) > 1e-2 * scale


def test_eq_15_and_17_solve_the_equations_of_motion_with_multipliers(anywhere):
    # 𝒥Ż - cΛ = 𝓔 and c'Ż = -γ as one linear system; γ is Ḟ without the terms of Ω̇ and V̇.
    c = anywhere.c
    turning_only = np.concatenate([anywhere.applied[0:3], np.zeros(9)])
    gamma = contact_acceleration(anywhere, turning_only)
    system = np.block([[mass_matrix(anywhere.body), -c], [c.T, np.zeros((3, 3))]])
    solution = np.linalg.solve(system, np.concatenate([anywhere.applied, -gamma]))
    rates, Lambda_ = dynamics(anywhere)
    assert relative_error(Lambda_, solution[12:]) < 1e-11
    assert relative_error(rates, solution[:12]) < 1e-11


def test_eq_16_projection_is_the_nearest_force_at_C(anywhere):
    # The nearest force in the metric 𝒥⁻¹, by least squares.
    root = np.linalg.cholesky(np.linalg.inv(mass_matrix(anywhere.body))).T
    nearest = np.linalg.lstsq(root @ anywhere.c, root, rcond=None)[0]
    Lambda_ = constraint_force(anywhere.body, anywhere.c, anywhere.applied, np.zeros(3))
    assert relative_error(-Lambda_, nearest @ anywhere.applied) < 1e-13


def test_eq_17_20_and_21_agree_on_the_sub_manifold(on_manifold):
    held = on_manifold
    rates, Lambda_ = dynamics(held)
    Omega_rate = reduced.angular_acceleration(held.body, held.motion, held.force, held.couple)
    assert relative_error(Omega_rate, rates[3:6]) < 1e-13
    holding = reduced.holding_force(held.body, held.motion, held.force, Omega_rate)
    assert relative_error(holding, Lambda_) < 1e-13
