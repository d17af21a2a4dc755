"""Protects sliding ties: crossing, sliding and release at any points, and several ties together.

Independent facts: a tie at the contact point is the sliding controller, which has a driver of its
own; a mass alone bounces along parabolas, or decays as exp(-κt); equivalent forces solve the
equations of the body with multipliers; Filippov's choice is the only consistent one of all.
"""

from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from support.pose import attitude
from support.switching import ENGINES, MASS, data, ligament, problem, solved
from support.systems import random_state

import rbstab
from rbstab.config.errors import ConfigError
from rbstab.config.load import load_config
from rbstab.elements.sliding_ties import CrossingTie, FilippovTie, LayeredTie
from rbstab.mechanics.algebra import solved as solution
from rbstab.systems.filippov import chosen, sides, slide_modes
from rbstab.systems.modes import modes_of, with_modes

ROOT = Path(__file__).parents[3]

EACH = pytest.mark.parametrize("engine_name", ENGINES)


def tie(point=(0.0, 0.0, 0.0), force=30.0, surface: Any = "position", **changes):
    ends = {"point": list(point), "anchor": list(point)}
    return {"kind": "sliding", **ends, "K_s": [force] * 3, "surface": surface} | changes


# A tie at the contact point is the sliding controller.


def as_tie(config):
    """Return a config whose sliding controller is a tie at the contact point."""
    settings, R = config["controller"], config["body"]["contact_point"]
    keys = ("K_s", "surface", "law")
    element = {key: settings[key] for key in keys if key in settings}
    element |= {"kind": "sliding", "point": R, "anchor": R}
    stabilizers = {key: settings[key] for key in ("K_t", "L_t", "K_r", "L_r")}
    return config | {
        "schema_version": 2,
        "controller": {"variant": "free"} | stabilizers,
        "elements": {"tie": element},
    }


def example(name, **integration):
    path = ROOT / f"configs/examples/sliding/{name}.yaml"
    config = yaml.safe_load(path.read_text(encoding="utf-8"))
    config["integration"] |= {"duration": 0.5, "samples": 51} | integration
    return config


@pytest.mark.parametrize(
    ("name", "engine_name", "bound"),
    [
        ("slope_exact_2000", "scipy", 1e-10),
        ("slope_exact_20000", "scipy", 1e-10),
        pytest.param("slope_layer_2000", "scipy", 1e-10, marks=pytest.mark.heavy),
        # On s = E each switch amplifies errors.
        pytest.param("position_exact_2000", "scipy", 2e-9, marks=pytest.mark.heavy),
        ("position_layer_2000", "scipy", 1e-10),
        pytest.param("slope_exact_2000", "heyoka", 1e-10, marks=pytest.mark.heavy),
        pytest.param("position_exact_2000", "heyoka", 2e-9, marks=pytest.mark.heavy),
    ],
)
def test_a_tie_at_the_contact_point_is_the_sliding_controller(name, engine_name, bound):
    config = example(name, engine=engine_name)
    controller, named = rbstab.simulate(config), rbstab.simulate(as_tie(config))
    assert named.status == controller.status == "completed"
    for quantity in ("orientation", "angular_velocity", "contact_displacement", "contact_velocity"):
        scale = max(np.abs(controller[quantity]).max(), 1.0)
        assert np.abs(named[quantity] - controller[quantity]).max() < bound * scale, quantity
    force = np.abs(controller["contact_force"]).max()
    difference = np.abs(named["element_force"][:, 0] - controller["contact_force"])
    assert difference.max() < 1e3 * bound * force


# A mass alone, in closed form.

K, G, START, SPEED = 30.0, 4.0, 0.5, -0.3
"""The force of the tie, N; the load MASS G along x, N; E and its rate at the start, m and m/s."""


def falling(surface: Any, **integration):
    start = {"position": [START, 0.0, 0.0], "velocity": [SPEED, 0.0, 0.0]}
    settings = {"duration": 4.0, "samples": 81} | integration
    # Beside x the other axes of the tie are at rest on their surfaces.
    body = {"mass": MASS, "inertia": [1.0, 1.5, 2.0], "contact_point": [0.0, 0.0, 0.0]}
    shifted = tie(force=K, surface=surface) | {"anchor": [0.0, -1.0, 1.0]}
    anchored = shifted if surface == "position" else tie(force=K, surface=surface)
    return data({"tie": anchored}, start, settings, gravity=[G, 0.0, 0.0], body=body)


def bouncing(times):
    """Return E along x of a mass under the load and the force -K sgn E, by parabolas."""
    E, F, t = START, SPEED, 0.0
    found = []
    for time in times:
        while True:
            side = 1.0 if (E > 0 or (E == 0 and F > 0)) else -1.0
            a = G - side * K / MASS
            roots = np.roots([a / 2, F, E]) if E != 0 else np.array([-2 * F / a])
            flight = min(r.real for r in roots if abs(r.imag) < 1e-12 and r.real > 1e-12)
            if t + flight > time:
                break
            E, F, t = 0.0, F + a * flight, t + flight
        rest = time - t
        found.append(E + F * rest + a * rest * rest / 2)
    return np.array(found)


@EACH
def test_a_mass_bounces_along_parabolas(engine_name):
    """The other axes lie far from E = 0, and move along parabolas too."""
    found = solved(falling("position"), engine_name)
    assert found.status == "completed"
    np.testing.assert_allclose(found.states[:, 6], bouncing(found.times), rtol=0, atol=1e-9)


@EACH
def test_a_mass_arrives_slides_and_decays(engine_name):
    """With s = F + κE it arrives once, and then E decays as exp(-κt) under a force in the box."""
    slope = 3.0
    found = solved(falling({"slope": slope}), engine_name)
    assert found.status == "completed"
    a = G - K / MASS
    # s(t) = F + κE is quadratic in t until it is zero.
    roots = np.roots([slope * a / 2, a + slope * SPEED, SPEED + slope * START])
    arrival = min(r.real for r in roots if r.real > 0)
    E = START + SPEED * arrival + a * arrival**2 / 2
    after = found.times > arrival
    expected = E * np.exp(-slope * (found.times[after] - arrival))
    np.testing.assert_allclose(found.states[after, 6], expected, rtol=0, atol=1e-11)
    np.testing.assert_allclose(found.states[after, 9], -slope * expected, rtol=0, atol=1e-11)
    for system, y in zip(found.systems[-40:], found.states[-40:], strict=True):
        motion, pairs = system.acting(y)
        force = next(one.wrench(motion, own).force for one, own in pairs if one.slides)
        # m Ë = m κ² E = m g + Λ
        assert force[0] == pytest.approx(MASS * (slope**2 * y[6] - G), abs=1e-9)
        assert np.abs(force[1:]).max() < 1e-12
    assert modes_of(found.systems[-1]) == (1.0,) * 6
    # On y and z the mass begins on the surfaces, and stays there.
    assert np.abs(found.states[:, 7:9]).max() < 1e-12


@EACH
def test_a_mass_is_released_where_the_load_exceeds_the_force(engine_name):
    """A ligament pulls a mass off its surface: Λ reaches K_s there, and the mass leaves.

    On the surface E = -½ exp(-2t) and Λ = T + mκ²E, with the tension T = 300 (E + 0.2 - 0.05).
    """
    pull = ligament(stiffness=300.0) | {"anchor": [-1.2, 0.0, 0.0]}
    config = data(
        {"tie": tie(force=20.0, surface={"slope": 2.0}), "pull": pull},
        {"velocity": [1.0, 0.0, 0.0], "position": [-0.5, 0, 0]},
        {"duration": 1.2, "samples": 401},
    )
    found = solved(config, engine_name)
    is_held = np.array([modes_of(system)[-3] for system in found.systems])
    forces = []
    for system, y in zip(found.systems, found.states, strict=True):
        motion, pairs = system.acting(y)
        forces.append(next(e.wrench(motion, own).force[0] for e, own in pairs if e.slides))
    assert is_held[0] == 1.0
    released = int(np.argmin(is_held))
    E = (20.0 - 45.0) / (300.0 + 4.0 * MASS)
    assert found.times[released - 1] < np.log(-0.5 / E) / 2 <= found.times[released]
    assert abs(forces[released - 1]) == pytest.approx(20.0, rel=0.05)
    assert np.abs(forces).max() < 20.0 * (1 + 1e-9)
    assert np.abs(np.diff(forces[: released + 1])).max() < 1.0  # continuous at the release


@EACH
def test_a_mass_is_released_where_another_force_jumps(engine_name):
    """A second tie on s = E pulls to x = 0.2: beyond it, both of its and the load's force is 55."""
    slope = 2.0
    second = tie(force=30.0) | {"anchor": [0.2, -1.0, 1.0]}
    config = data(
        {"cross": second, "slide": tie(force=20.0, surface={"slope": slope})},
        {"position": [0.5, 0.0, 0.0], "velocity": [-1.0, 0.0, 0.0]},
        {"duration": 0.48, "samples": 241},
        gravity=[25.0 / MASS, 0.0, 0.0],
    )
    found = solved(config, engine_name)
    assert found.status == "completed"
    crossing = np.log(0.5 / 0.2) / slope
    forces = []
    for system, y in zip(found.systems, found.states, strict=True):
        motion, pairs = system.acting(y)
        forces.append(next(e.wrench(motion, own).force[0] for e, own in pairs if e.slides))
    before = found.times < crossing
    x = 0.5 * np.exp(-slope * found.times)
    expected = np.where(before, MASS * slope**2 * x + 30.0 - 25.0, -20.0)
    np.testing.assert_allclose(forces, expected, rtol=1e-9)
    # Then 30 + 25 - 20 N push it back.
    t = found.times[~before] - crossing
    thrown = 0.2 - 0.2 * slope * t + 35.0 / MASS * t**2 / 2
    np.testing.assert_allclose(found.states[~before, 6], thrown, rtol=0, atol=1e-9)


# Several ties.

TWO = {
    "a": tie([0.15, 0.1, -0.42], 3000.0, {"slope": 20.0}),
    "b": tie([-0.2, 0.1, 0.3], 2000.0, {"slope": 10.0}),
}
BODY = {"mass": 41.0, "inertia": [10.0, 8.0, 9.0], "contact_point": [0.15, 0.1, -0.42]}
CONTROLLER: dict[str, Any] = {"variant": "free", "K_t": [4100.0] * 3, "L_t": [200.0] * 3}
CONTROLLER |= {"K_r": [400.0] * 3, "L_r": [60.0] * 3}


def several(elements, controller=CONTROLLER, **integration):
    return data(
        elements,
        {"angular_velocity": [4.0, -6.0, 3.0]},
        {"duration": 0.4, "samples": 21} | integration,
        body=BODY,
        controller=controller,
        gravity=[0.0, 0.0, -9.81],
    )


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
    wrenches = [element.wrench(motion, own) for element, own in pairs]
    force = sum(w.force for w in wrenches)
    couple = sum(w.couple for w in wrenches) - np.cross(Omega, J * Omega)
    M = np.diag([41.0] * 3 + J)
    Jacobian = whole[chosen_rows]
    n = len(chosen_rows)
    matrix = np.block([[M, -Jacobian.T], [Jacobian, np.zeros((n, n))]])
    right = np.concatenate([force, couple, demand[chosen_rows]])
    multipliers = np.linalg.solve(matrix, right)[6:]
    _, acting = system.acting(y)
    found = np.concatenate([own for element, own in acting if element.slides])
    np.testing.assert_allclose(found[rows], multipliers[:3], rtol=1e-9, atol=1e-7)
    np.testing.assert_array_equal(np.delete(found, rows), 0)


def test_filippov_has_one_consistent_choice_of_all(rng):
    """Of the 3ⁿ choices of held axes and sides, in the box, with rates to the right sides."""
    for _ in range(20):
        n = int(rng.integers(1, 5))
        root = rng.normal(size=(n, n))
        W, b = root @ root.T + 0.1 * np.eye(n), 3 * rng.normal(size=n)
        K_s = rng.uniform(0.5, 2, size=n)
        consistent = []
        for given in map(np.array, product([0.0, 1.0, -1.0], repeat=n)):
            held, force = given == 0, -K_s * given
            right = -(b + W @ force)[held]
            force[held] = np.linalg.solve(W[np.ix_(held, held)], right) if held.any() else []
            rate = W @ force + b
            if np.all(np.abs(force) <= K_s) and np.all(given[~held] * rate[~held] >= 0):
                consistent.append(given)
        assert len(consistent) == 1
        np.testing.assert_array_equal(sides(W, b, K_s), consistent[0])


@pytest.mark.parametrize("rank", [3, 5, 9])
def test_filippov_s_choice_is_the_least_in_the_box(rng, rank):
    """Nine axes, also of a mobility without full rank: another program finds the same least."""
    from scipy.optimize import lsq_linear

    found = set()
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
        found |= set(choice)
    assert found == {0.0, 1.0, -1.0}


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
    s = np.concatenate([one.surface(one.at_point(motion)) for one in ties])
    modes = np.array(modes_of(after))
    assert np.abs(s[rows]).max() < 2e-13
    held = modes[slide_modes(after)[1]] > 0
    assert set(np.flatnonzero(held)) <= set(rows)
    np.testing.assert_array_equal(moved[[0, 1, 2, 6, 7, 8]], y[[0, 1, 2, 6, 7, 8]])


def test_two_ties_slide_together_and_the_audit_closes():
    result = rbstab.simulate(several(TWO))
    assert result.status == "completed"
    v = result["lyapunov"]
    assert np.abs(result["energy_residual"]).max() < 1e-12 * v[0]
    forces = np.abs(result["element_force"])
    assert (forces[:, 0] <= 3000 * (1 + 1e-9)).all()
    assert (forces[:, 1] <= 2000 * (1 + 1e-9)).all()
    # At least three axes slide at the end: their forces are neither of the bounds.
    bounds = np.array([3000.0, 2000.0])[:, np.newaxis]
    assert (forces[-1] < 0.99 * bounds).sum() >= 3
    # v' has no sign: the certificate says so.
    assert result.attributes["verdict"] == "violated"


@pytest.mark.heavy
def test_engines_agree_on_two_ties_beside_a_ligament():
    pull = {
        "kind": "ligament",
        "point": [0, 0, -0.3],
        "anchor": [0, 0, 0.5],
        "stiffness": 5000.0,
        "slack_length": 0.75,
        "toe_strain": 0.05,
        "damping": 5.0,
    }
    runs = [rbstab.simulate(several(TWO | {"pull": pull}, engine=name)) for name in ENGINES]
    for name in ("orientation", "position", "velocity", "angular_velocity"):
        assert np.abs(runs[0][name] - runs[1][name]).max() < 1e-9, name


@pytest.mark.heavy
def test_all_laws_together_beside_each_other():
    elements = {
        "cross": tie([0.15, 0.1, -0.42], 500.0),
        "layer": tie([0.0, 0.0, 0.3], 1000.0, law={"boundary_layer": 0.01}),
        "slide": TWO["b"],
    }
    result = rbstab.simulate(several(elements, duration=0.2, samples=11))
    assert result.status == "completed"
    assert np.abs(result["energy_residual"]).max() < 1e-11 * result["lyapunov"][0]


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


# Their equations, and their configs.


@pytest.mark.parametrize("size", [1, 2, 3, 6, 9])
def test_systems_of_equations_of_any_size(size, rng):
    root = rng.normal(size=(size, size))
    matrix, right = root @ root.T + np.eye(size), rng.normal(size=size)
    np.testing.assert_allclose(solution(matrix, right), np.linalg.solve(matrix, right), rtol=1e-10)


def test_forms():
    slope = {"surface": {"slope": 2.0}}
    for kind, changes in (
        (CrossingTie, {}),
        (FilippovTie, slope),
        (LayeredTie, {"law": {"boundary_layer": 0.1}}),
        (LayeredTie, slope | {"law": {"boundary_layer": 0.1}}),
    ):
        *_, element = problem(data({"one": tie() | changes})).system.elements
        assert type(element) is kind
        assert element.rate_weight == float("surface" in changes)
        assert element.slope == (2.0 if "surface" in changes else 1.0)


def refusal(elements):
    with pytest.raises(ConfigError) as error:
        load_config(data(elements))
    return str(error.value)


def test_what_a_config_may_not_have():
    slope = {"slope": 2.0}
    said = refusal({"one": tie(law={"implicit": 1e-3})})
    assert "elements.one.law: has implicit steps, which only a sliding controller has" in said
    assert "elements.one.surface.slope: is -1" in refusal({"one": tie(surface={"slope": -1.0})})
    said = refusal({"one": tie(law={"boundary_layr": 0.1})})
    assert "elements.one.law.boundary_layr: is unknown (did you mean boundary_layer?)" in said
    said = refusal({"one": tie(surface=slope), "two": tie(surface=slope)})
    assert "elements: has the sliding ties one and two at one point" in said
    many = {f"t{k}": tie([0.1 * k, 0.0, 0.2 * k * k], surface=slope) for k in range(4)}
    assert "elements: has 4 sliding ties on slopes with the exact law" in refusal(many)
    layered = {name: one | {"law": {"boundary_layer": 0.1}} for name, one in many.items()}
    load_config(data(layered))


def test_a_tie_that_begins_at_rest_on_position_ends_with_its_name():
    """On s = E nothing holds an axis at rest: its bounces have no length."""
    found = solved(data({"one": tie()}, gravity=[0.0, 0.0, -9.81]), "scipy")
    assert found.status == "solver failure"
    assert "the motion stays where one switches" in found.detail


# How far a motion can be trusted.


def bounced(surface: Any, **integration: Any) -> Any:
    """Return the result of a turning body with a tie at its contact point."""
    elements = {"tie": tie([0.15, 0.1, -0.42], 20000.0, surface)}
    return rbstab.simulate(several(elements, **{"samples": 11, **integration}))


@pytest.mark.heavy
def test_a_tie_that_bounces_is_trusted_for_a_while():
    """After that time a start that differs in its last digit leads elsewhere."""
    config = as_tie(example("position_exact_20000", engine="heyoka", samples=101))
    run = rbstab.simulate(config)
    trusted = float(run["trusted_until"])
    assert 0.1 < trusted < 0.4
    spin = [16, 32, np.nextafter(-16, 0)]
    other = rbstab.simulate(config | {"initial": {"angular_velocity": spin}})
    difference = np.abs(run["contact_velocity"] - other["contact_velocity"]).max(axis=1)
    size = np.abs(run["contact_velocity"]).max()
    assert difference[run["time"] <= trusted / 2].max() < 1e-5 * size
    assert difference[run["time"] > trusted].max() > 1e-2 * size


def test_a_motion_that_is_not_chaotic_has_no_second_run():
    """It would only take time: a tie on a slope slides."""
    assert "trusted_until" not in bounced({"slope": 20.0}, duration=0.05).variables


def test_a_short_motion_is_trusted_to_its_end():
    assert bounced("position", duration=0.02)["trusted_until"] == 0.02
