"""Protects rest states on kinks of the energy: closed forms of a mass, and least energies by SciPy.

A mass on springs K_t with a tie of K_s on s = E has the energy ½ K_t x² - f x + K_s |x|: it rests
at x = 0 if |f| <= K_s, and at (|f| - K_s)/K_t beyond. A guard of constant couple holds θ2 at its
soft angle, if it is strong enough. A tie on s = F + κE holds its point by any force up to K_s.
"""

import numpy as np
import pytest
from scipy.optimize import minimize
from support.stops import stop
from support.switching import MASS, data, problem

from rbstab.analysis.configuration import as_at_rest, configurations
from rbstab.analysis.rest_state import nearest_rest_state
from rbstab.systems.modes import with_modes_at

K_T, K_S = np.array([40.0, 50.0, 60.0]), np.array([3.0, 5.0, 8.0])
FREE = {
    "variant": "free",
    "K_t": K_T.tolist(),
    "L_t": [2.0] * 3,
    "K_r": [9.0] * 3,
    "L_r": [1.0] * 3,
}


def tie(surface="position", point=(0.0, 0.0, 0.0), **changes):
    ends = {"point": list(point), "anchor": list(point)}
    return {"kind": "sliding", **ends, "K_s": K_S.tolist(), "surface": surface} | changes


def loaded(force, elements, **sections):
    gravity = (np.array(force) / MASS).tolist()
    return data(elements, controller=FREE, gravity=gravity, **sections)


def at_rest(force):
    """Return x of the mass: its springs carry what exceeds the force of the tie."""
    force = np.array(force)
    return np.sign(force) * np.maximum(np.abs(force) - K_S, 0.0) / K_T


FORCES = {
    "held": (1.0, -4.9, 7.9),
    "one axis is free": (1.0, 4.0, -20.0),
    "free": (4.0, -6.0, 30.0),
    "just held": (3.0 - 1e-6, -5.0 + 1e-6, 8.0 - 1e-6),
    "just free": (3.0 + 1e-4, 5.0 + 1e-4, -8.0 - 1e-4),
}


@pytest.mark.parametrize("surface", ["position", {"slope": 5.0}], ids=["position", "slope"])
@pytest.mark.parametrize("case", FORCES)
def test_a_mass_rests_where_the_force_of_its_tie_ends(case, surface):
    """On s = E the tie stores K_s |x|; on a slope it holds its point too, and stores nothing."""
    force = FORCES[case]
    rest = nearest_rest_state(problem(loaded(force, {"tie": tie(surface)})).system)
    x, stores = at_rest(force), surface == "position"
    assert rest.rests_in_range
    assert not stores or rest.on_kink == (case not in {"free", "just free"})
    np.testing.assert_allclose(rest.motion.X, x, atol=1e-9)
    np.testing.assert_allclose(rest.motion.Theta, 0.0, atol=1e-9)
    stored = 0.5 * K_T @ x**2 - np.array(force) @ x + stores * K_S @ np.abs(x)
    assert rest.energy == pytest.approx(stored, abs=1e-7)


@pytest.mark.parametrize("couple", [0.5, 5.0, 30.0])
def test_a_guard_of_constant_couple_holds_a_body_at_its_soft_angle(couple):
    """K_r θ2 + K = m g l cos θ2 beyond the soft angle; SciPy finds θ2 where K is too weak."""
    soft, lever = 0.2, 0.5
    controller = {"variant": "permanent"} | {k: FREE[k] for k in FREE if k != "variant"}
    elements = {"range": {"kind": "guard", "method": "repelling", "couple": couple}}
    elements["range"]["soft_angle"] = soft
    config = data(elements, controller=controller, gravity=[0, 0, -9.81])
    config["body"]["contact_point"] = [-lever, 0, 0]
    rest = nearest_rest_state(problem(config).system)
    assert rest.rests_in_range

    def value(angle):
        # X = A(θ2) l from the held point: K_t acts on X less its value at θ2 = 0.
        x, z = lever * (np.cos(angle) - 1.0), -lever * np.sin(angle)
        springs = 0.5 * (K_T[0] * x * x + K_T[2] * z * z + 9.0 * angle * angle)
        return springs + MASS * 9.81 * z + couple * max(abs(angle) - soft, 0.0)

    grid = np.linspace(-0.5, 1.2, 17_001)
    expected = grid[np.argmin([value(angle) for angle in grid])]
    assert abs(rest.motion.Theta[1] - expected) < 2e-4
    assert rest.on_kink == (expected == pytest.approx(soft, abs=1e-6))
    if rest.on_kink:
        assert rest.motion.Theta[1] == pytest.approx(soft, abs=1e-9)
    assert rest.energy == pytest.approx(value(rest.motion.Theta[1]), abs=1e-8)


def test_a_tie_beside_a_stop():
    """SciPy finds no lower energy within the stop, from another start."""
    angle = 0.05
    elements = {"grip": tie(point=(0.4, 0.0, 0.1)), "end": stop(0.5, angle)}
    system = problem(loaded((2.0, 1.0, -19.6), elements)).system
    rest = nearest_rest_state(system)
    assert rest.rests_in_range
    space = configurations(system)
    q = space.configuration(rest.motion, rest.element_states)
    assert abs(q[1]) == angle
    bounds = [(None, None), (-angle, angle), *[(None, None)] * 4]
    options = {"xatol": 1e-9, "fatol": 1e-12, "maxiter": 2000, "maxfev": 2000}
    moved = np.clip(q + 0.01, [-9, -angle] + [-9] * 4, [9, angle] + [9] * 4)
    low = minimize(space.energy, moved, method="Nelder-Mead", bounds=bounds, options=options)
    assert low.fun >= rest.energy - 1e-9


def test_the_forces_of_elements_at_rest_are_those_of_their_energies():
    """As they are stated for a body at rest, by differences of the energy."""
    layered = tie({"slope": 3.0}, (0.1, 0.2, 0.0), law={"boundary_layer": 0.2})
    system = problem(loaded((0, 0, 0), {"tie": layered})).system
    acting = as_at_rest(system)
    for size in (0.01, 0.3):
        q = np.array([0.1, 0.2, -0.1, size, -size, 2 * size])
        gradient = configurations(acting).gradient(q)
        y = configurations(system).state(q)
        there = with_modes_at(configurations(system).system, y)
        force = sum(wrench.force for wrench in there.observe(y).wrenches)
        np.testing.assert_allclose(-gradient[3:6], force, atol=1e-10)
