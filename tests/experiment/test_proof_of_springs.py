"""Protects proofs with springs of held bodies: no rest state is missed, and known ones are found.

Rest states are looked for by scipy from many starts, with an energy written for these tests.
"""

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, root
from support.config_elements import CONTROLLER, TIE, config_data
from support.held_springs import energy_of, held_system, random_springs
from support.proofs import rest_states, unwrapped_rest_states

from rbstab.config.build import problem_of
from rbstab.config.load import load_config
from rbstab.config.tolerances import tolerances_of
from rbstab.experiment.convergence.convergence import Enclose
from rbstab.experiment.convergence.exact_motion import prove_convergence
from rbstab.experiment.proof import prove
from rbstab.experiment.robust.bodies import prove_within
from rbstab.experiment.start_sets.prove_starts import prove_starts
from rbstab.experiment.stored_proof.starts import start_state
from rbstab.experiment.verification.verify import verify
from rbstab.proof.robust.numbers import NoFamilyReason

RANGE_END = np.array([np.pi, np.pi / 2, np.pi])
HELD = CONTROLLER | {"variant": "permanent"}
SPRING: dict[str, Any] = {"point": [0.02, 0.0, 0.3], "anchor": [0.3, 0.01, 1.0], "stiffness": 900.0}
SPRING |= {"kind": "spring", "rest_length": 0.5}
BARRIER = {"kind": "guard", "method": "barrier", "stiffness": 30.0}


def slope_of(function):
    """Return the gradient by central differences."""

    def slope(q):
        steps = 1e-5 * np.eye(len(q))
        return np.array([(function(q + h) - function(q - h)) / 2e-5 for h in steps])

    return slope


@pytest.mark.heavy
@pytest.mark.parametrize("seed", range(4))
def test_no_rest_state_that_scipy_finds_is_missed(seed):
    rng = np.random.default_rng(seed)
    springs = random_springs(rng, 1 + seed % 3)
    with np.errstate(all="ignore"):
        found = rest_states(held_system(springs, 0.3))
    assert found.proved
    assert len(found.states) > 1
    slope = slope_of(lambda Theta: energy_of(springs, Theta, 0.3))
    for point in found.states:
        np.testing.assert_allclose(slope(point.Theta), 0.0, atol=1e-4)
    reached = set()
    for _ in range(30):
        Theta = root(slope, rng.uniform(-1, 1, 3) * RANGE_END, tol=1e-10).x
        if np.abs(slope(Theta)).max() < 1e-4 and np.all(np.abs(Theta) < RANGE_END):
            distances = [np.abs(point.Theta - Theta).max() for point in found.states]
            assert min(distances) < 1e-5
            reached.add(int(np.argmin(distances)))
    assert len(reached) > 1


def pendulum(rest_length):
    """Return a config of a body in a plane: one spring, on the axis x of the contact point.

    With p = R + [0, 0, 1] and an anchor at R + [0, 0, 3], the length is √(10 - 6 cos θ1 cos θ2).
    """
    ends = {"point": [0.0, 0.0, 0.5], "anchor": [0.0, 0.0, 2.5]}
    spring = SPRING | ends | {"stiffness": 100.0, "rest_length": rest_length}
    body = {"inertia": [1.0, 1.0, 1.0], "contact_point": [0.0, 0.0, -0.5]}
    data = config_data({"line": spring}, HELD | {"K_r": [5.0, 500.0, 400.0]}, body=body)
    data["controller"]["K_t"] = [1e-9, 1e-9, 1e-9]
    data["gravity"] = [0.0, 0.0, 0.0]
    return load_config(data)


@pytest.mark.parametrize("rest_length", [1.0, 3.5])
def test_rest_states_of_a_spring_in_a_plane_are_those_of_its_closed_form(rest_length):
    """5 θ + 300 (1 - ℓ₀/ℓ) sin θ = 0 with ℓ² = 10 - 6 cos θ, where θ2 = θ3 = 0."""

    def slope(angle):
        length = np.sqrt(10 - 6 * np.cos(angle))
        return 5 * angle + 300 * (1 - rest_length / length) * np.sin(angle)

    cells = pairwise(np.linspace(-np.pi, np.pi, 1002))
    roots = [brentq(slope, a, b, xtol=1e-14) for a, b in cells if slope(a) * slope(b) < 0]
    proof = prove(pendulum(rest_length))
    assert proof.proved
    in_plane = [one.orientation for one in proof.states if abs(one.orientation[1]) < 1e-6]
    np.testing.assert_allclose(sorted(angles[0] for angles in in_plane), roots, atol=1e-6)
    assert len(roots) == (1 if rest_length == 1.0 else 3)


@pytest.mark.heavy
def test_a_spring_of_nearly_no_rest_length_is_a_tie():
    """½ k ℓ² is the energy of a tie with K_c = k I: the same rest states, c* and region."""
    ends = {"point": [0.1, 0.2, -0.1], "anchor": [0.5, 0.1, 0.3]}
    spring = SPRING | ends | {"rest_length": 1e-9, "stiffness": 700.0}
    tie = TIE | ends | {"K_c": [700.0, 700.0, 700.0]}
    weak = HELD | {"K_r": [40.0, 40.0, 32.0]}
    one, other = (prove(load_config(config_data({"x": x}, weak))) for x in (spring, tie))
    assert one.proved
    assert other.proved
    assert len(one.states) == len(other.states) > 1
    for first, second in zip(one.states, other.states, strict=True):
        np.testing.assert_allclose(first.orientation, second.orientation, atol=1e-6)
        assert first.index == second.index
        assert first.energy == pytest.approx(second.energy)
    assert one.region is not None
    assert other.region is not None
    assert one.region.lower_bound == pytest.approx(other.region.lower_bound, rel=1e-6)
    assert one.region.lower_bound > 0
    assert [one.rest_state for one in one.regions] == [one.rest_state for one in other.regions]


@pytest.mark.heavy
def test_a_config_with_a_spring_is_proved_and_verified():
    config = load_config(config_data({"strut": SPRING, "tie": TIE}, HELD))
    proof = prove(config)
    assert proof.proved
    assert proof.unique
    assert proof.region is not None
    assert proof.region.proved
    assert start_state(problem_of(config), proof) == 1
    # The test of every start has the range of all real θ1 and θ3, which takes long to check.
    proof = proof.model_copy(update={"unwrapped": None})
    found = verify(proof, config)
    assert found.verified
    assert {"energy", "certified region"} <= {one.claim for one in found.findings}
    # The same proof for a spring that is a little stiffer.
    other = load_config(config_data({"strut": SPRING | {"stiffness": 900.1}, "tie": TIE}, HELD))
    wrong = {one.claim for one in verify(proof, other).findings if not one.verified}
    assert wrong == {"id", "energy"}


@pytest.mark.heavy
def test_with_a_barrier_every_start_converges():
    """Theorem 10 with a spring: on all of |θ2| < π/2, for all real θ1 and θ3."""
    elements = {"strut": SPRING | {"stiffness": 100.0}, "range": BARRIER}
    config = load_config(config_data(elements, HELD))
    proof = prove(config)
    assert proof.every_start
    assert proof.region is None
    found = verify(proof, config)
    assert found.verified
    assert "every start" in {one.claim for one in found.findings}


def test_all_real_angles_have_the_rest_states_of_the_range():
    with np.errstate(all="ignore"):
        rest = rest_states(held_system(random_springs(np.random.default_rng(1), 1), 2.0))
        wide = unwrapped_rest_states(rest)
    assert wide is not None
    assert wide.proved
    inside = [point for point in wide.states if np.all(np.abs(point.Theta) < RANGE_END)]
    assert len(inside) == len(rest.states)


def test_a_spring_that_may_have_no_length_is_not_decided():
    """Its ends are at the same distance from the contact point."""
    near = SPRING | {"point": [0.15, 0.1, 0.58], "anchor": [1.15, 0.1, -0.42]}
    proof = prove(load_config(config_data({"strut": near}, HELD)))
    assert not proof.proved
    assert "no length" in proof.outcome


@pytest.mark.heavy
def test_a_motion_from_outside_of_the_region_is_enclosed():
    """The exact motion is followed into the region; a computed motion stays close to it."""
    start = {"orientation": [0.1, 0.2, 0.3], "angular_velocity": [12.0, 9.0, -8.0]}
    config = load_config(config_data({"strut": SPRING}, HELD, initial=start))
    proof, problem = prove(config), problem_of(config)
    assert start_state(problem, proof) is None
    found = prove_convergence(config, problem, proof, Enclose.TO_END)
    assert found.convergence.proved
    assert found.samples is not None
    times, accuracy = found.samples.times, {"rtol": 1e-12, "atol": 1e-12}
    assert len(times) == len(problem.times)

    def rates(_, y):
        return problem.system.rates(y)

    computed = solve_ivp(rates, (0, times[-1]), problem.start, "DOP853", times, **accuracy).y.T
    for name, place in {"orientation": slice(3), "angular_velocity": slice(3, 6)}.items():
        low, high = found.samples.low[name], found.samples.high[name]
        assert np.all(high - low < 1e-9)
        np.testing.assert_allclose(low, computed[:, place], atol=1e-7)


def test_sets_of_starts_are_decided_with_a_spring():
    """All start in the region of the only rest state: their energies are below its bound."""
    config = load_config(config_data({"strut": SPRING}, HELD))
    texts = ["initial.angular_velocity=±0.1"]
    found = prove_starts(config, tolerances_of(config, texts), prove(config))
    (part,) = found.parts
    assert part.rest_state == 1
    assert part.bound is not None
    assert part.energy[1] < part.bound


def test_bodies_within_tolerances_are_proved_with_a_spring_of_a_held_body():
    config = load_config(config_data({"strut": SPRING}, HELD))
    within = prove_within(config, tolerances_of(config, ["elements.strut.stiffness=±5%"]))
    assert within.proved
    tied = load_config(config_data({"strut": SPRING}))
    within = prove_within(tied, tolerances_of(tied, ["elements.strut.stiffness=±5%"]))
    assert within.proved is None
    assert within.why == NoFamilyReason.NOT_QUADRATIC.value


@pytest.mark.heavy
@pytest.mark.parametrize("variant", ["free", "visco-elastic"])
def test_a_tied_spring_of_nearly_no_rest_length_is_a_tie(variant):
    """The same rest states, indices and c* are proved as of a quadratic energy."""
    spring, tie, controller = spring_and_tie(variant)
    one, other = (prove(load_config(config_data({"x": x}, controller))) for x in (spring, tie))
    assert one.needs_lengths
    assert one.proved
    assert len(one.states) == len(other.states) > 2
    for first, second in zip(one.states, other.states, strict=True):
        np.testing.assert_allclose(first.orientation, second.orientation, atol=1e-6)
        np.testing.assert_allclose(first.position, second.position, atol=1e-6)
        assert (first.index, first.index_proved) == (second.index, True)
    assert other.region is not None
    assert one.region is not None
    # The bound may be lower by a thousandth.
    assert 0.998 * other.region.level < one.region.lower_bound < other.region.level
    assert one.region.face == other.region.face


def spring_and_tie(variant):
    """Return a spring with nearly no rest length, a tie of the same force, and a controller."""
    connector = {"K_c": [500.0, 500.0, 500.0], "L_c": [30.0, 30.0, 30.0]}
    controller = HELD | {"variant": variant, "K_r": [10.0, 10.0, 8.0]}
    controller |= connector if variant == "visco-elastic" else {}
    ends = {"point": [0.1, 0.2, -0.1], "anchor": [0.5, 0.1, 0.3]}
    spring = SPRING | ends | {"rest_length": 1e-9, "stiffness": 700.0}
    return spring, TIE | ends | {"K_c": [700.0, 700.0, 700.0]}, controller


@pytest.mark.heavy
@pytest.mark.parametrize("variant", ["free", "visco-elastic"])
def test_a_search_of_a_body_that_is_not_held_finds_rest_states_of_a_tie(variant):
    """With nearly no rest length a spring is a tie, of which all rest states are proved."""
    spring, tie, controller = spring_and_tie(variant)
    config = load_config(config_data({"x": spring}, controller))
    found = prove(config, search_only=True)
    proved = prove(load_config(config_data({"x": tie}, controller)))
    assert proved.proved
    assert (found.proved, found.unique, found.region) == (False, None, None)
    assert not any(state.proved or state.index_proved for state in found.states)
    # It may miss some, as it does here; but it finds the minima, and nothing that is not there.
    same = set()
    for one in found.states:
        place = [np.abs(np.subtract(one.orientation, x.orientation)).max() for x in proved.states]
        other = proved.states[int(np.argmin(place))]
        assert min(place) < 1e-6
        np.testing.assert_allclose(one.position, other.position, atol=1e-6)
        assert one.index == other.index
        same.add(int(np.argmin(place)))
    assert len(same) == len(found.states) > 1
    assert same >= {k for k, other in enumerate(proved.states) if other.index == 0}
    assert start_state(problem_of(config), found) is None
    assert not verify(found, config).verified
