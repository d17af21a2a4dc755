"""Boxes of bodies: what is proved holds for random bodies; what is false is never proved."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from scipy.optimize import root
from support.bodies import (
    CASES,
    STRUT,
    box_of,
    config_of,
    least_energy,
    least_over_x,
    member,
    some_bodies,
    with_element,
)
from support.config_elements import HELD, config_data, guard
from support.rest import inverted_pendulum

import rbstab
from rbstab.analysis.configuration import configurations
from rbstab.config.load import load_config
from rbstab.proof.robust import bodies
from rbstab.proof.robust.bodies import BodiesOutcome, prove_bodies
from rbstab.proof.robust.energies import energies_of
from rbstab.proof.robust.family import Family
from rbstab.proof.robust.numbers import Members, Part


@pytest.mark.parametrize(("config", "texts"), CASES)
def test_random_bodies_are_as_proved(config, texts):
    """Scipy searches the configurations of each body, without U and without this proof."""
    rng = np.random.default_rng(8)
    members, part = box_of(config, *texts)
    proof = prove_bodies(members, part)
    assert proof.outcome is BodiesOutcome.PROVED
    least = np.inf
    for numbers in some_bodies(part, rng, 4):
        system = member(members, numbers)
        at_rest = configurations(system)
        (Theta,) = rest_states_by_scipy(at_rest, rng, 4)
        assert np.linalg.eigvalsh(hessian(at_rest, Theta)).min() > 0
        points = np.vstack([Theta, border(system)])
        lowest, *others = (at_rest.energy(least_over_x(at_rest, x)) for x in points)
        least = min(least, float(np.nanmin(others)) - lowest)
    assert 0.4 * least <= proof.level <= least + 1e-8 * abs(least)


def rest_states_by_scipy(at_rest, rng, starts):
    """Return the Θ of the rest states in the range that scipy finds from random configurations."""
    orientations = list[np.ndarray]()
    for start in range(starts):
        q = np.zeros(at_rest.size)
        if start:
            q[:3] = rng.uniform(-1, 1, size=3) * [3.1, 1.5, 3.1]
        solution = root(at_rest.gradient, q, method="hybr", tol=1e-12)
        Theta = solution.x[:3]
        inside = np.all(np.abs(Theta) < [np.pi, np.pi / 2, np.pi])
        at_zero = np.abs(at_rest.gradient(solution.x)).max() < 1e-6
        new = all(np.abs(Theta - other).max() > 1e-5 for other in orientations)
        if inside and at_zero and new:
            orientations.append(Theta)
    return orientations


def border(system):
    """Return points on the border of the range; a stop is none, as it ends no motion."""
    stops = [element.angle for element in system.elements if element.holds]
    # Of a barrier the ends of θ2 have no energy in doubles.
    high = np.array([np.pi, *(stops or [(1 - 1e-9) * np.pi / 2]), np.pi])
    lines = [np.linspace(-1, 1, 5)] * 2
    face = np.stack([x.ravel() for x in np.meshgrid(*lines)])
    axes = (0, 2) if stops else (0, 1, 2)
    sides = [np.insert(face, axis, side, axis=0) for axis in axes for side in (-1, 1)]
    return np.concatenate(sides, axis=1).T * high


def hessian(at_rest, Theta):
    def slope(x):
        return at_rest.gradient(least_over_x(at_rest, x))[:3]

    H = np.array([(slope(Theta + h) - slope(Theta - h)) / 2e-6 for h in 1e-6 * np.eye(3)])
    return 0.5 * (H + H.T)


def test_the_level_of_many_bodies_and_of_one():
    """Another program proved 641 J for gains ±30 %; without a width it is that of one body."""
    config = config_of("permanent")
    proof = prove_bodies(*box_of(config, "controller=±30%", "body.contact_point=±0.01"))
    assert proof.outcome is BodiesOutcome.PROVED
    assert 641 <= proof.level < 1.1 * 641
    members, part = box_of(config, "controller=±0.000001%")
    at_rest, rng = configurations(member(members, part.middle)), np.random.default_rng(1)
    end = np.array([np.pi, np.pi / 2, np.pi])
    faces = [(axis, sign * end[axis]) for axis in range(3) for sign in (-1, 1)]
    lowest = min(least_energy(at_rest, axis, angle, rng, 3, end=end) for axis, angle in faces)
    assert 0.995 * lowest < prove_bodies(members, part).level <= lowest


def pendulum(low, high, second=False):
    """Return the box of pendulums that stand if k > 100, with k from low to high.

    The spring about the second angle has 250 N m/rad, or the same range.
    """

    def exact(numbers, convert):
        system = inverted_pendulum([100.0, 250, 70], 100.0)
        gravity, _, rotational = system.elements
        k2 = numbers[-1] if second else 250
        K_r = np.array([[numbers[0], 0, 0], [0, k2, 0], [0, 0, 70]], dtype=object)
        body = replace(
            system.body,
            mass=convert(np.array(1.0))[()],
            inertia=convert(system.body.inertia),
            contact_point=convert(system.body.contact_point),
        )
        weight = replace(gravity, weight=convert(gravity.weight))
        return replace(system, body=body, elements=(weight, replace(rotational, K_r=convert(K_r))))

    def from_doubles(numbers):
        return exact(numbers, lambda a: np.asarray(a, dtype=float))

    low, high = Fraction(low), Fraction(high)
    count = 2 if second else 1
    return Members(exact, from_doubles), Part(
        ((low + high) / 2,) * count, ((high - low) / 2,) * count
    )


@pytest.mark.parametrize(
    ("low", "high", "second", "outcome"),
    [
        ("102", "130", False, BodiesOutcome.PROVED),
        ("70", "95", False, BodiesOutcome.SEVERAL),
        # Below 100 about either angle, upright is a saddle between two that lean.
        ("99", "130", False, BodiesOutcome.SEVERAL),
        ("92", "230", True, BodiesOutcome.SEVERAL),
        ("99.9999999999", "100", False, BodiesOutcome.PART_LIMIT),
    ],
)
def test_pendulum_is_proved_where_its_equation_says(low, high, second, outcome):
    """K θ1 = 100 sin θ1 has one root if k >= 100, a threefold one at 100, else three."""
    members, part = pendulum(low, high, second)
    limit = 4 if outcome is BodiesOutcome.PART_LIMIT else 12
    proof = prove_bodies(members, part, limit)
    assert proof.outcome is outcome
    if outcome is BodiesOutcome.SEVERAL:
        assert proof.false is not None
        at_rest = configurations(member(members, proof.false.numbers))
        assert len(proof.false.rest_states) >= 2
        assert max(np.abs(at_rest.gradient(x)).max() for x in proof.false.rest_states) < 1e-9
        assert min(proof.false.numbers) < 100
        assert all(Fraction(low) <= number <= Fraction(high) for number in proof.false.numbers)


def sliding():
    data = config_of("permanent").plain()
    data["controller"] |= {"variant": "sliding", "K_s": [60, 60, 40], "surface": "position"}
    return rbstab.load_config(data | {"integration": {"duration": 1.0}})


STOPPED = with_element(guard("stop", restitution=0.5, angle=1.2))
SHORT = with_element(STRUT | {"point": [0.15, 0.1, 0.08], "anchor": [0.15, 0.608, -0.42]})
"""Its ends are 0.5 m and 0.508 m from the contact point: a factor of 1.016."""


@pytest.mark.parametrize(
    ("config", "text", "why"),
    [
        (sliding(), "controller.K_r=±1%", "no gradient"),
        (STOPPED, "elements.one.angle=±1%", "the angle of a stop"),
        (SHORT, "elements.one.point[2]=±0.01", "no length"),
        (SHORT, "elements.one.point[2]=±0.005", ""),
    ],
)
def test_energies_that_cannot_be_bounded(config, text, why):
    if not why:
        energies_of(*box_of(config, text))
        return
    proof = prove_bodies(*box_of(config, text), part_limit=1)
    assert proof.outcome is BodiesOutcome.NO_ENERGY
    assert why in proof.reason


def pressed_to_a_stop(load=3.0):
    """Return a body whose load presses θ2 to a stop at 0.2 rad."""
    arm = HELD | {"K_r": [40.0, 4.0, 40.0], "K_t": [1.0, 1.0, 1.0]}
    data = config_data({"one": guard("stop", restitution=0.5, angle=0.2)}, arm)
    data["gravity"] = [load, 0.0, -9.81]
    return box_of(load_config(data), "controller.K_r=±1%")


def test_no_direction_excludes_a_state_that_a_stop_holds():
    """No ∇U is zero there, and yet the body rests: only directions of the other sign say so.

    So nothing is proved of it.
    """
    rng = np.random.default_rng(4)
    members, part = pressed_to_a_stop()
    assert prove_bodies(members, part, 2).outcome is not BodiesOutcome.PROVED
    at_rest = configurations(member(members, part.middle))

    def on_face(x):
        return at_rest.gradient(np.array([x[0], side * 0.2, x[1]]))[[0, 2]]

    side = -int(np.sign(at_rest.gradient(np.zeros(3))[1]))
    x = root(on_face, np.zeros(2), tol=1e-12).x
    point = np.array([[x[0]], [side * 0.2], [x[1]]])
    assert side * at_rest.gradient(point[:, 0])[1] < 0
    local = Family(energies_of(members, part)).over(point - 1e-9, point + 1e-9)
    upwards = np.array([[0.0], [1.0], [0.0]])
    assert local.excluded(upwards)[0][0]
    assert local.excluded(upwards, -side)[0][0]
    assert local.rises()[0]
    assert local.rises(-side)[0]
    assert not local.rises(side)[0]
    for y in (upwards, -upwards, *rng.normal(size=(200, 3, 1))):
        assert not local.excluded(y, side)[0][0]


def test_what_is_proved_by_a_limit_of_time_is_told(monkeypatch):
    """Of the box from 61 to 143, the half with k > 100 is proved, and is examined second."""
    monkeypatch.setattr(bodies, "counterexample", lambda *_: None)
    members, part = pendulum("61", "143")
    late = prove_bodies(members, part, is_late=lambda: True)
    assert (late.outcome, late.parts) == (BodiesOutcome.TIME_LIMIT, 0)
    limited = prove_bodies(members, part, part_limit=2)
    assert (limited.outcome, limited.level) == (BodiesOutcome.PART_LIMIT, 0.0)
    assert "the claim is proved for 50 % of the tolerances" in limited.reason
