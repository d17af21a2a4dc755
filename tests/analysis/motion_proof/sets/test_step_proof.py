"""The proof of a step of sets: its bounds satisfy their inequality, or nothing is proved."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from support.set_steps import LONGEST, assert_equal, equations, stepped, tried
from support.start_sets import random_config, random_set, together

from rbstab.analysis.motion_proof.linear_flow import LinearBounds, linear_bounds
from rbstab.analysis.motion_proof.motion import proof_precision
from rbstab.analysis.motion_proof.sets import set_step as step_module
from rbstab.analysis.motion_proof.sets.motion_set import MotionSet
from rbstab.analysis.motion_proof.sets.set_step import (
    _error_bounds,
)


def bounds_to_find(rng, sizes, n=4):
    """Return the arguments of `_error_bounds` for several steps; a larger size needs more."""
    shape, size = (len(sizes), n, n), np.array(sizes)[:, np.newaxis, np.newaxis]
    linear = LinearBounds(
        residual=1e-2 * size * rng.uniform(0, 1, shape),
        backward=np.eye(n) + size * rng.uniform(0, 1, shape),
        forward=np.eye(n) + size * rng.uniform(0, 1, shape),
        mismatch=0.2 * size * rng.uniform(0, 1, shape),
    )
    radius, d = rng.uniform(0, 1e-9, (2, len(sizes), n))
    G, margin = rng.uniform(0, 0.01, shape), rng.uniform(1e-7, 1e-6, (len(sizes), n))
    return linear, radius, d, G, margin


def test_the_bounds_of_a_step_satisfy_their_inequality():
    """In many steps at once, whose bounds are found by different attempts, or by none."""
    rng = np.random.default_rng(11)
    linear, radius, d, G, margin = bounds_to_find(rng, [0.1, 0.3, 9.0, 0.5, 0.2, 0.9, 0.05, 0.7])
    linear.mismatch[4] = 2 * np.eye(4)  # hopeless
    b, W, found = _error_bounds(linear, radius, d, G, margin)
    assert 3 < found.sum() < 7
    assert not found[[2, 4]].any()

    def at_once(guess):
        """Whether the first guess is enough, for each step."""
        inner = np.einsum("sij,sj->si", G, guess) + d
        first = radius + np.einsum("sij,sj->si", linear.residual, guess)
        first = first + np.einsum("sij,sj->si", linear.backward, inner)
        reached = np.einsum("sij,sj->si", linear.forward, first)
        return np.all(reached + np.einsum("sij,sj->si", linear.mismatch, guess) < guess, axis=-1)

    start = radius + np.einsum("sij,sj->si", linear.backward, d)
    early = at_once(1.1 * np.einsum("sij,sj->si", linear.forward, start))
    assert (found & early).any()
    assert (found & ~early).any()
    for k in np.flatnonzero(found):
        assert np.all(b[k] <= margin[k])
        inner = G[k] @ b[k] + d[k]
        assert np.all(radius[k] + linear.residual[k] @ b[k] + linear.backward[k] @ inner <= W[k])
        assert np.all(linear.forward[k] @ W[k] + linear.mismatch[k] @ b[k] < b[k])
    # The margin is a condition: slopes are bounded within it only. Each step has its own.
    narrow = np.where(np.arange(len(b))[:, np.newaxis] % 2, margin, np.minimum(margin, 0.9 * b))
    *_, again = _error_bounds(linear, radius, d, G, narrow)
    assert again.tolist() == (found & (np.arange(len(b)) % 2 == 1)).tolist()


@pytest.mark.parametrize("bad", [np.nan, np.inf])
@pytest.mark.parametrize("name", ["radius", "d", "G", "margin", "linear"])
def test_bounds_that_are_not_numbers_prove_nothing(name, bad):
    """They do not change what is found of the steps beside them."""
    n = 3
    one = np.stack([np.eye(n)] * 3)
    good: dict[str, Any] = {
        "linear": LinearBounds(*(x * one for x in (0.0, 1.0, 1.0, 0.0))),
        "radius": np.full((3, n), 1e-9),
        "d": np.full((3, n), 1e-9),
        "G": np.zeros((3, n, n)),
        "margin": np.full((3, n), 1e-6),
    }
    b, W, found = _error_bounds(**good)
    assert found.all()
    names = ["residual", "backward", "forward", "mismatch"] if name == "linear" else [name]
    for part in names:
        array = (getattr(good["linear"], part) if name == "linear" else good[name]).copy()
        array[1].flat[1] = bad
        broken = replace(good["linear"], **{part: array}) if name == "linear" else array
        with np.errstate(all="ignore"):
            other_b, other_W, proved = _error_bounds(**good | {name: broken})
        # An infinite margin is a condition that always holds: `disc` has no bounds then.
        assert proved.tolist() == [True, part == "margin" and bad == np.inf, True]
        assert np.array_equal(b[::2], other_b[::2])
        assert np.array_equal(W[::2], other_W[::2])


def test_what_is_beside_the_linear_flow_is_in_the_set_at_the_end(monkeypatch):
    """The mismatch of Φ and Ψ, and the rounding of the sums of p at the end."""
    config = random_config("permanent", "reduced", 5)
    states, scale = random_set(config, 7, width=1e-3, error=1e-9)
    given = stepped(config, states, scale)
    seen = {}

    def moved(flow, frame, W, beside, size):
        seen["beside"], seen["W"] = beside, W
        return given.end.frame, given.end.radius

    monkeypatch.setattr(step_module, "moved_frames", moved)
    missed = 1e-3 * np.ones((6, 6))
    original = linear_bounds

    def with_mismatch(flow, frame):
        found = original(flow, frame)
        return replace(found, mismatch=found.mismatch + missed)

    stepped(config, states, scale)
    without = seen["beside"]
    size = np.abs(states.polynomial).sum(axis=-1)
    assert np.all(without >= 10 * 2.0**-53 * size)
    assert np.all(without < 1e-12)
    monkeypatch.setattr(step_module, "linear_bounds", with_mismatch)
    stepped(config, states, scale)
    least = missed @ states.error[0] * 0.9
    assert np.all(seen["beside"] >= least)
    assert np.all(seen["W"] >= states.radius)


def test_the_set_at_the_end_has_all_powers_of_tau():
    """The last one counts, where the coefficient of a monomial in z is small."""
    config = random_config("visco-elastic", "Z", 5)
    states, scale = random_set(config, 7, width=1e-3, error=0.0)
    with proof_precision():
        longest = np.array([LONGEST])
        _, (p,) = step_module._polynomial(equations(config), states, scale, longest, 12)
    (end,) = stepped(config, states, scale).end.polynomial
    exact = np.array([[math.fsum(x) for x in row] for row in p.tolist()])
    rounding = 14 * 2.0**-53 * np.abs(p).sum(axis=2)
    assert np.any(np.abs(p[:, :, -1]) > 2 * rounding)
    assert np.all(np.abs(end - exact) <= rounding)


def test_numbers_beyond_those_of_the_bounds_on_underflow_are_refused():
    """The same parallelepiped, with long edges and small radii."""
    config = random_config("free", "Z", 5)
    states, scale = random_set(config, 7, width=1e-3, error=1e-9)
    sets = [
        replace(states, frame=np.diag(scale)[np.newaxis] * factor, radius=states.radius / factor)
        for factor in (1e17, 1e10, 1e17)
    ]
    assert tried(config, together(*sets), scale).proved.tolist() == [False, True, False]


def test_no_step_is_proved_of_sets_without_bounds():
    """By themselves, and beside good ones, which do not notice."""
    config = random_config("permanent", "reduced", 5)
    states, scale = random_set(config, 7)
    broken = []
    for bad in (np.nan, np.inf, -np.inf, 1e200, 1e300):
        p = states.polynomial.copy()
        p[0, 3, 1] = bad
        broken.append(replace(states, polynomial=p))
        p = states.polynomial.copy()
        p[0, 0, 0] = bad
        broken.append(replace(states, polynomial=p))
        broken.append(replace(states, radius=np.full((1, 6), abs(bad))))
        frame = states.frame.copy()
        frame[0, 2, 2] = bad
        broken.append(replace(states, frame=frame))
    broken.append(replace(states, frame=np.zeros((1, 6, 6))))
    for one in broken[::4]:
        assert not tried(config, one, scale).proved.any()
    good = stepped(config, states, scale)
    mixed = tried(config, together(*(x for one in broken for x in (states, one))), scale)
    assert mixed.proved.tolist() == [True, False] * len(broken)
    for k in range(0, len(mixed.h), 2):
        assert_equal(mixed, k, good, 0)
    for bad in (np.nan, np.inf, 0.0):
        sizes = scale.copy()
        sizes[4] = bad
        assert not tried(config, states, sizes).proved.any()
        assert tried(config, states, scale, [LONGEST]).proved.all()
        assert not tried(config, states, scale, [bad]).proved.any()
    two = tried(config, together(states, states), scale, [np.nan, LONGEST])
    assert two.proved.tolist() == [False, True]


@pytest.mark.parametrize("middle", [1.5, np.pi / 2])
def test_no_step_is_proved_where_cos_theta2_may_be_zero(middle):
    """The Euler angles are singular there."""
    config = random_config("free", "Z", 5)
    states, scale = random_set(config, 7, width=0.0)
    p = states.polynomial.copy()
    p[0, 1, 0], p[0, 1, 1] = middle, 0.1
    near = p.copy()
    near[0, 1, 0], near[0, 1, 1] = 1.2, 1e-4
    bad, good = (replace(states, polynomial=one) for one in (p, near))
    several = together(bad, good, bad, bad, bad, bad)
    longest = LONGEST * 2.0 ** -np.array([0, 2, 8, 16, 24, 32])
    assert tried(config, several, scale, longest).proved.tolist() == [False, True, *[False] * 4]


def test_the_polynomial_begins_at_the_set():
    """p at τ = 0 is P itself, without any rounding: nothing else accounts for a difference."""
    config = random_config("embedded", "W", 5)
    states, scale = random_set(config, 7)
    with proof_precision():
        for longest in (LONGEST, 0.3 * LONGEST):
            (h,), (p,) = step_module._polynomial(
                equations(config), states, scale, np.array([longest]), 12
            )
            assert 0 < h <= longest
            assert np.array_equal(p[:, :, 0], states.polynomial[0])
            last = np.abs(p[:, :, -2:]).sum(axis=1) / scale[:, np.newaxis]
            assert last.max() <= step_module.TOLERANCE * (1 + 1e-9)


def test_a_held_body_and_a_free_one_have_sets_of_their_size():
    for variant, coordinates, n in (
        ("permanent", "reduced", 6),
        ("embedded", "Z", len(random_set(random_config("embedded", "Z"))[1])),
    ):
        config = random_config(variant, coordinates, 1)
        states, scale = random_set(config, 2)
        assert isinstance(states, MotionSet)
        assert stepped(config, states, scale).end.radius.shape == (1, n) == (1, len(scale))
