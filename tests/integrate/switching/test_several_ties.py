"""Protects several sliding ties together, whose forces are solved together.

Independent facts: equivalent forces solve the equations of the body with multipliers; Filippov's
choice is the only consistent one of all, and the least in the box.
"""

from typing import Any

import numpy as np
import pytest
from support.pose import attitude
from support.sliding_ties import BODY, CONTROLLER, TWO, several, tie
from support.switching import problem
from support.systems import random_state

import rbstab
from rbstab.integrate.switching.saltation import tangent_at_start
from rbstab.mechanics.derivatives import STEP
from rbstab.systems.filippov import chosen, held_at_rest, residuals, sides, slide_modes
from rbstab.systems.modes import modes_of, with_modes


def held_system(rng, elements, rows, controller=CONTROLLER):
    """Return a system with some axes held, and a random state."""
    system = problem(several(elements, controller)).system
    modes = np.array(modes_of(system))
    modes[slide_modes(system)[:, rows]] = 1.0
    return with_modes(system, tuple(modes)), random_state(rng, system)


@pytest.mark.parametrize("variant", ["free", "permanent"])
def test_equivalent_forces_solve_the_equations_with_multipliers(variant, rng):
    """[M -J'; J 0] [v̇; Λ] = [forces; -J̇v - κF] with J by differences; also of the held body."""
    rows = np.array([0, 2, 4])
    controller = CONTROLLER | {"variant": variant}
    elements = TWO | {"a": TWO["a"] | {"point": [0.2, 0.0, -0.3]}}
    system, y = held_system(rng, elements, rows, controller)
    motion, pairs = system.loads(y)
    ties: list[Any] = [element for element, _ in pairs if element.slides]
    J: Any
    J, L = BODY["inertia"], np.array(BODY["contact_point"])
    A, Omega = motion.A, motion.Omega
    np.testing.assert_allclose(A, attitude(motion.Theta), atol=1e-14)

    def velocities(v):
        """Return the velocities of both points, and of C if it is held, for v = [V, Ω]."""
        points = [np.array(tie.point) for tie in ties] + ([L] if variant == "permanent" else [])
        return np.concatenate([v[:3] + A @ np.cross(v[3:], p) for p in points])

    whole = np.array([velocities(unit) for unit in np.eye(6)]).T
    drift = np.concatenate(
        [A @ np.cross(Omega, np.cross(Omega, p)) for p in [*(t.point for t in ties), L]]
    )[: len(whole)]
    slopes = np.repeat([20.0, 10.0], 3)
    F = velocities(np.concatenate([motion.V, Omega]))
    chosen_rows = [*rows, 6, 7, 8] if variant == "permanent" else list(rows)
    demand = -drift.copy()
    demand[:6] -= slopes * F[:6]
    # All other forces on the body: gravity, stabilizers, and the axes that are not held.
    wrenches = [element.wrench(motion, states) for element, states in pairs]
    force = sum(w.force for w in wrenches)
    couple = sum(w.couple for w in wrenches) - np.cross(Omega, J * Omega)
    M = np.diag([41.0] * 3 + J)
    Jacobian = whole[chosen_rows]
    n = len(chosen_rows)
    matrix = np.block([[M, -Jacobian.T], [Jacobian, np.zeros((n, n))]])
    right = np.concatenate([force, couple, demand[chosen_rows]])
    multipliers = np.linalg.solve(matrix, right)[6:]
    _, acting = system.acting(y)
    forces = np.concatenate([states for element, states in acting if element.slides])
    np.testing.assert_allclose(forces[rows], multipliers[:3], rtol=1e-9, atol=1e-7)
    np.testing.assert_array_equal(np.delete(forces, rows), 0)


@pytest.mark.parametrize("rank", [3, 5, 9])
def test_filippov_s_choice_is_the_least_in_the_box(rng, rank):
    """Nine axes, also of a mobility without full rank: another program finds the same least."""
    from scipy.optimize import lsq_linear

    choices = set()
    for _ in range(40):
        root, K_s = rng.normal(size=(rank, 9)), rng.uniform(0.5, 2, size=9)
        right = 5 * rng.normal(size=rank)
        # ½ |root Λ - right|² is ½ Λ'WΛ + b'Λ but for a constant.
        least = lsq_linear(root, right, bounds=(-K_s, K_s), method="bvls", tol=1e-14)
        choice = sides(root.T @ root, -root.T @ right, K_s)
        rate = root.T @ (root @ least.x - right)
        # Where a rate is not zero the force is at its bound; the rates are the same for all least.
        is_free = np.abs(rate) > 1e-6
        np.testing.assert_array_equal(choice[is_free], np.sign(rate)[is_free])
        choices |= set(choice)
    assert choices == {0.0, 1.0, -1.0}


def test_the_choice_lands_on_the_surfaces(rng):
    """Held axes get s = 0 by impulses; the pose and the surfaces of free axes do not matter."""
    system = problem(several(TWO)).system
    y = random_state(rng, system)
    y[3:6] *= 0.05
    y[9:12] *= 0.05
    rows = np.array([0, 1, 5])
    after, moved = chosen(system, y, rows)
    motion, pairs = after.acting(moved)
    ties: list[Any] = [element for element, _ in pairs if element.slides]
    s = np.concatenate([sliding_tie.distance_along(motion) for sliding_tie in ties])
    modes = np.array(modes_of(after))
    assert np.abs(s[rows]).max() < 2e-13
    held = modes[slide_modes(after)[1]] > 0
    assert set(np.flatnonzero(held)) <= set(rows)
    np.testing.assert_array_equal(moved[[0, 1, 2, 6, 7, 8]], y[[0, 1, 2, 6, 7, 8]])


def test_a_derivative_is_tangent_to_the_surfaces_of_held_axes(rng):
    """It moves along their forces alone: s and its derivative are zero, the pose stays."""
    rows = np.array([0, 1, 5])
    system, y = held_system(rng, TWO, rows)
    z = rng.normal(size=len(y))
    system, at = held_at_rest(system, y, rows)
    moved = tangent_at_start(system, system, at, z, 0.0)
    assert np.abs(residuals(system, at + 1j * STEP * moved)[rows].imag / STEP).max() < 1e-9
    # z times STEP, and divided by it, may have another last digit.
    np.testing.assert_allclose(moved[[0, 1, 2, 6, 7, 8]], z[[0, 1, 2, 6, 7, 8]], rtol=1e-15)


def test_v_falls_with_ties_on_position():
    """They store Σ K_s|E| and dissipate nothing, so v' is that of the stabilizers alone."""
    elements = {
        "one": tie([0.15, 0.1, -0.42], 500.0),
        "two": tie([-0.2, 0.1, 0.3], 400.0, law={"boundary_layer": 0.02}),
    }
    result = rbstab.simulate(several(elements))
    v, parts = result["lyapunov"], result["part"].tolist()
    assert (np.diff(v) < 0).all()
    assert np.abs(result["energy_residual"]).max() < 1e-11 * v[0]
    assert (result["dissipation"][:, [parts.index("one"), parts.index("two")]] == 0).all()
