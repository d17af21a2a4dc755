"""Protects a stop beside axes that slide on s = F + κE: one joint solution at rest, and impacts.

Independent facts: closed forms of a plane motion; the equations of the body with multipliers; one
consistent choice of all combinations; ties with thin boundary layers, which no joint solution
follows; both engines.
"""

from typing import Any

import numpy as np
import pytest
from support.stops import ANGLE, couple_of, pressed, residual, solution, stop
from support.switching import ENGINES, MASS, data, problem, solved

import rbstab
from rbstab.mechanics.numbers import Array
from rbstab.systems import landing
from rbstab.systems.filippov import residuals, slide_modes
from rbstab.systems.impact import impact
from rbstab.systems.landing import after_impact
from rbstab.systems.modes import modes_of, with_contact, with_modes

EACH = pytest.mark.parametrize("engine_name", ENGINES)


def tie(point, force, slope, **changes):
    """Return a tie that slides; its anchor is where its point is at X = 0, Θ = 0."""
    ends = {"point": list(point), "anchor": list(point)}
    settings = {"K_s": [force] * 3, "surface": {"slope": slope}}
    return {"kind": "sliding"} | ends | settings | changes


# --- A plane motion: θ2 and x, a tie on an arm.

ARM, SLOPE, START = 0.3, 2.0, 0.5


def on_the_stop(engine_name, couple, load):
    """Return a body that slides while it touches its stop, under a couple on θ2 and a load on x."""
    x, z = ARM * np.sin(ANGLE), ARM * np.cos(ANGLE)
    start = {"orientation": [0, ANGLE, 0], "position": [START - x, 0, 0]}
    start |= {"velocity": [-SLOPE * START, 0, 0]}
    elements = {
        "arm": tie([0, 0, ARM], 30.0, SLOPE, anchor=[0, 0, z]),
        "end": stop(0.5),
    }
    config = data(elements, start, {"duration": 1.5, "samples": 151}, gravity=[load / MASS, 0, 0])
    return pressed(config, engine_name, couple)


@EACH
@pytest.mark.parametrize(
    ("couple", "load"),
    [
        pytest.param(1.2, 6.0, id="the load pulls the body off"),
        pytest.param(-0.3, 0.0, id="the tie alone presses the body"),
    ],
)
def test_a_rest_ends_when_the_tie_turns_its_couple(engine_name, couple, load):
    """E = ½ exp(-2t) until C + Λ ℓ cos θ_e = 0, where Λ = mκ²E - load; then the body leaves."""
    given = on_the_stop(engine_name, couple, load)
    trajectory = solution(given, engine_name)
    assert trajectory.status == "completed"
    at_release = load - couple / (ARM * np.cos(ANGLE))
    release = np.log(MASS * SLOPE**2 * START / at_release) / SLOPE
    assert 0.3 < release < 0.8
    (begin, end), *_ = trajectory.impacts.rests
    assert begin == 0.0
    assert abs(end - release) < 1e-12
    before = trajectory.times < release
    E = START * np.exp(-SLOPE * trajectory.times)
    resting = trajectory.states[before]
    assert (resting[:, 1] == ANGLE).all()
    np.testing.assert_allclose(resting[:, 6], (E - ARM * np.sin(ANGLE))[before], atol=1e-13)
    force = MASS * SLOPE**2 * E - load
    pairs = list(zip(trajectory.systems, trajectory.states, strict=True))
    couples = np.array([couple_of(system, y) for system, y in pairs])[before]
    expected = -(couple + force * ARM * np.cos(ANGLE))[before]
    np.testing.assert_allclose(couples, expected, atol=1e-12)
    # After it the axis slides on, and the body turns.
    for system, y in pairs:
        e = system.motion(y).X[0] + ARM * np.sin(y[1])
        rate = y[9] + ARM * np.cos(y[1]) * y[4]
        assert abs(rate + SLOPE * e) < 1e-12
    assert trajectory.states[-1, 1] < ANGLE - 0.01
    assert residual(trajectory) < 1e-12


# --- The joint solution.

BODY: dict[str, Any] = {"mass": 41.0, "contact_point": [0.15, 0.1, -0.42]}
BODY |= {"inertia": [[10.0, 0.4, -0.7], [0.4, 8.0, 0.5], [-0.7, 0.5, 9.0]]}
CONTROLLER: dict[str, Any] = {"variant": "free", "K_t": [4100.0] * 3, "L_t": [200.0] * 3}
CONTROLLER |= {"K_r": [400.0] * 3, "L_r": [60.0] * 3}
SINGLE = {"a": tie([0.15, 0.1, -0.42], 3000.0, 20.0)}
TWO = {"a": tie([0.15, 0.1, -0.42], 300.0, 20.0), "b": tie([-0.2, 0.1, 0.3], 200.0, 10.0)}
PUSH: dict[str, Any] = {"kind": "input", "quantity": "body_couple", "direction": [-0.1, -1, -0.2]}
PUSH |= {"amplitude": 300.0, "signal": {"kind": "constant"}}


def several(elements, **sections):
    """Return a body that turns towards its stop, with ties."""
    start = {"angular_velocity": [4.0, -6.0, 3.0]}
    given = {"controller": CONTROLLER, "gravity": [0.0, 0.0, -9.81], "body": BODY}
    return data(elements, start, {"duration": 0.5, "samples": 51}, **(given | sections))


def against_stop(rng, elements, side):
    """Return a system that rests on a side of its stop, and a random state with θ̇2 = 0."""
    system = problem(several(elements | {"end": stop(0.5, 0.15)})).system
    y = rng.normal(size=12) * ([0.3] * 3 + [1.0] * 3 + [0.1] * 3 + [1.0] * 3)
    y[1] = side * 0.15
    y[4] = -np.tan(y[2]) * y[3]
    return with_contact(system, side), y


@pytest.mark.parametrize("side", [1, -1])
def test_rest_and_axes_solve_the_equations_with_multipliers(side, rng):
    """[M -J'; J 0] [v̇; Λ, τ] = [forces; -J̇v - κF] for v = [V, Ω], with J̇v by differences."""
    rows = np.array([0, 2, 4])
    system, y = against_stop(rng, TWO, side)
    modes = np.array(modes_of(system))
    modes[slide_modes(system)[:, rows]] = 1.0
    system = with_modes(system, tuple(modes))
    motion, pairs = system.loads(y)
    points = [np.array(TWO[name]["point"]) for name in TWO]

    def jacobian(Theta: Array) -> Array:
        at = system.motion(np.concatenate([Theta, y[3:]]))
        of_points = [
            [np.concatenate([at.A.T[k] * 0 + np.eye(3)[k], np.cross(p, at.A[k])]) for k in range(3)]
            for p in points
        ]
        last = np.concatenate([np.zeros(3), [np.sin(Theta[2]), np.cos(Theta[2]), 0.0]])
        return np.array([row for block in of_points for row in block] + [last])[[*rows, 6]]

    J, v = jacobian(motion.Theta), np.concatenate([motion.V, motion.Omega])
    Theta_rate = motion.B @ motion.Omega
    step = 1e-5
    ahead, behind = (jacobian(motion.Theta + h * Theta_rate) @ v for h in (step, -step))
    demand = -(ahead - behind) / (2 * step)
    demand[:3] -= np.array([20.0, 20.0, 10.0]) * (J @ v)[:3]
    wrenches = [element.wrench(motion, states) for element, states in pairs]
    inertia = np.array(BODY["inertia"])
    force = sum(w.force for w in wrenches)
    couple = sum(w.couple for w in wrenches) - np.cross(motion.Omega, inertia @ motion.Omega)
    M = np.block([[41.0 * np.eye(3), np.zeros((3, 3))], [np.zeros((3, 3)), inertia]])
    matrix = np.block([[M, -J.T], [J, np.zeros((4, 4))]])
    solved_for = np.linalg.solve(matrix, np.concatenate([force, couple, demand]))
    _, acting = system.acting(y)
    forces = np.concatenate([states for element, states in acting if element.slides])
    np.testing.assert_allclose(forces[rows], solved_for[6:9], rtol=1e-6)
    assert couple_of(system, y) == pytest.approx(solved_for[9], rel=1e-6)
    np.testing.assert_allclose(system.rates(y)[3:6], solved_for[3:6], rtol=1e-6)


def test_an_impact_throws_axes_off_their_surfaces(rng):
    """Each s jumps by what the impulse does to its point; the side of each axis is that of s."""
    system, y = against_stop(rng, SINGLE, 1)
    modes = np.array(modes_of(system))
    modes[slide_modes(system)] = 1.0
    held = with_contact(with_modes(system, tuple(modes)), 0)
    y[4] += 0.7 / np.cos(y[2])
    motion = system.motion(y)
    y[9:12] -= motion.F + 20.0 * motion.E
    before = residuals(held, y)
    np.testing.assert_allclose(before, [0, 0, 0, 0.7], atol=1e-12)
    collision = impact(held, y)
    after, state = after_impact(held, collision.state)
    # The angular velocity alone jumps, by an impulse on θ2; A Ω × p is the velocity of the point.
    impulse = np.array([np.sin(y[2]), np.cos(y[2]), 0.0])
    turn = np.linalg.solve(np.array(BODY["inertia"]), impulse)
    turn *= -1.5 * 0.7 / (impulse @ turn)
    jump = motion.A @ np.cross(turn, BODY["contact_point"])
    s = residuals(after, state)
    np.testing.assert_allclose(s[:3] - before[:3], jump, atol=1e-12)
    sides, holds = slide_modes(after)
    now = np.array(modes_of(after))
    assert not now[holds].any()
    np.testing.assert_array_equal(now[sides], s[:3] > 0)


def settings(engine_name, **changes):
    """Return the settings of a run at small tolerances."""
    tight = {"rtol": 1e-13, "atol": 1e-14} if engine_name == "scipy" else {"rtol": 1e-15}
    return {"duration": 0.5, "samples": 51, "engine": engine_name} | tight | changes


RELEASED = PUSH | {"signal": {"kind": "pulse", "start": 0.0, "duration": 0.3}}
HEAVY = pytest.mark.heavy


@pytest.mark.parametrize(
    ("elements", "push", "restitution", "rests"),
    [
        pytest.param(SINGLE, PUSH, 0.5, True, id="one tie"),
        pytest.param(TWO, PUSH, 0.0, True, id="two ties, plastic", marks=HEAVY),
        pytest.param(TWO, PUSH, 0.9, False, id="two ties, elastic", marks=HEAVY),
        pytest.param(SINGLE, RELEASED, 0.5, True, id="the load ends", marks=HEAVY),
    ],
)
def test_engines_agree_and_the_audit_closes(elements, push, restitution, rests):
    given = elements | {"push": push, "end": stop(restitution, 0.15)}
    first, second = (
        rbstab.simulate(several(given) | {"integration": settings(engine_name)})
        for engine_name in ENGINES
    )
    for run in (first, second):
        assert run.status == "completed"
        scale = run["lyapunov"][0] + np.abs(run["supplied_energy"]).max()
        assert np.abs(run["energy_residual"]).max() < 1e-12 * scale
        assert np.abs(run["orientation"][:, 1]).max() <= 0.15
        bounds = np.array([given[name]["K_s"] for name in elements])
        assert (np.abs(run["element_force"])[:, : len(bounds)] <= bounds * (1 + 1e-9)).all()
        assert bool(run["stop_contact"].any()) == rests
        # The work by which axes arrive at the end of the hops is a tiny part.
        assert np.diff(run["impact_loss"]).min() > -1e-7 * scale
    assert 0 < first["impact_count"][-1] == second["impact_count"][-1] < 100
    np.testing.assert_allclose(first["impact_time"], second["impact_time"], rtol=0, atol=1e-9)
    for name in ("orientation", "angular_velocity", "position", "velocity", "stop_contact"):
        np.testing.assert_allclose(first[name], second[name], rtol=0, atol=1e-9, err_msg=name)


def test_no_hop_is_higher_than_its_bound(monkeypatch):
    """The bound of `landed`, with all axes that may be held, at each impact of a body that hops."""
    elements = {"a": SINGLE["a"] | {"K_s": [600.0] * 3}, "push": PUSH, "end": stop(0.95, 0.15)}
    start = {"orientation": [0.0, -0.15, 0.0], "angular_velocity": [0.0, 0.1, 0.0]}
    config = several(elements) | {"initial": start | {"attached": True}}
    config |= {"integration": settings("scipy", duration=0.012, samples=601)}
    bounds: dict[float, float] = {}
    original = landing._hop_height

    def recorded(decision: Any, y: Array, time: float) -> float:
        bound = original(decision, y, time)
        bounds.setdefault(time, bound)
        return bound if bound <= 1e-12 else np.inf

    monkeypatch.setattr(landing, "_hop_height", recorded)
    monkeypatch.setattr(landing, "HOP_HEIGHT", 1e-3)
    trajectory = solved(config, "scipy", rtol=1e-13)
    assert trajectory.impacts.resting[-1] == -1
    heights = 0.15 - np.abs(trajectory.states[:, 1])
    pairs = [(bound, heights[trajectory.times > time].max()) for time, bound in bounds.items()]
    seen = [(bound, height) for bound, height in pairs if height > 1e-8]
    assert len(seen) > 4
    for bound, height in seen:
        assert height < bound < 20.0 * height
