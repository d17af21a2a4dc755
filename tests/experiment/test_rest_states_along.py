"""Rest states along a parameter: folds, pitchforks, and intervals that are proved.

The energy of a held body is written down here once more, and its rest states are looked for by
other means: scalar equations in a plane, and a dense scan with Newton's method.
"""

from itertools import count, pairwise
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq
from support.leg import BODY, WEIGHT_MOMENT, held_leg, leg

import rbstab
from rbstab.experiment.along.parameter import Parameter
from rbstab.experiment.along.rest_states import states_along
from rbstab.proof.along import intervals

CONFIGS = Path(__file__).parents[2] / "configs"

WEIGHT, LENGTH = 3.5 * 9.81, 0.186

SOME = 80
"""Intervals that are tried, in place of a limit of time."""


def along(config, key, low, high, number=9, *, scales=False, some=SOME):
    tried = count()
    space = np.geomspace if scales else np.linspace
    parameter = Parameter(key, space(low, high, number), scales)
    return states_along(rbstab.load_config(config), parameter, lambda: next(tried) >= some)


def roots(f, low, high, steps=4001):
    """Return the roots of a function of one number, by a dense scan."""
    x = np.linspace(low, high, steps)
    return [brentq(f, a, b) for a, b in pairwise(x) if f(a) * f(b) < 0]


def check_cover(along_states, low, high):
    """The intervals cover all values, from the lowest to the highest."""
    assert (along_states.intervals[0].low, along_states.intervals[-1].high) == (low, high)
    assert all(interval.high == other.low for interval, other in pairwise(along_states.intervals))


def test_a_held_leg_has_a_pitchfork_where_its_spring_carries_its_weight():
    """K2 > m g l, so θ2 = 0, and K θ1 = m g l sin θ1."""
    along_states = along(held_leg((10, 10, 5)), "controller.K_r[0]", 1, 20)
    assert not along_states.why
    check_cover(along_states, 1, 20)
    (turn,) = along_states.turns
    assert turn.kind == "pitchfork"
    assert turn.value == pytest.approx(WEIGHT_MOMENT, rel=1e-6)
    assert turn.orientation == pytest.approx([0, 0, 0], abs=1e-6)
    for interval in along_states.intervals:
        assert not (interval.proved and interval.low <= WEIGHT_MOMENT <= interval.high)
        K = 0.5 * (interval.low + interval.high)
        leaning = roots(lambda x, K=K: K * x - WEIGHT_MOMENT * np.sin(x), 1e-3, np.pi)
        assert (interval.states, interval.stable) == ((3, 2) if leaning else (1, 1))
    proved = sum(
        interval.high - interval.low for interval in along_states.intervals if interval.proved
    )
    assert proved > 0.99 * 19


@pytest.mark.parametrize("near", [1e-2, 1e-4, 1e-6])
def test_a_leg_near_its_critical_stiffness_has_no_impossible_number_of_rest_states(near):
    low, high = WEIGHT_MOMENT - near, WEIGHT_MOMENT + near
    found = along(held_leg((10, 10, 5)), "controller.K_r[0]", low, high)
    (turn,) = found.turns
    assert (turn.kind, turn.value) == ("pitchfork", pytest.approx(WEIGHT_MOMENT, abs=near / 100))
    check_cover(found, low, high)
    for one in found.intervals:
        leans = 0.5 * (one.low + one.high) < WEIGHT_MOMENT
        assert one.states is None or (one.states, one.stable) == ((3, 2) if leans else (1, 1))
    assert sum(one.high - one.low for one in found.intervals if one.proved) > 1.9 * near


def test_an_offset_makes_a_fold_of_the_pitchfork():
    """In the plane of θ1: U' = K θ - m g (l sin θ + d cos θ), with the centre at (0, -d, l)."""
    d = 0.01
    body = BODY | {"contact_point": [0, d, -LENGTH]}
    along_states = along(held_leg((10, 10, 5), body=body), "controller.K_r[0]", 3, 12)

    def pull(x):
        return WEIGHT * (LENGTH * np.sin(x) + d * np.cos(x))

    def stiffness(x):
        return WEIGHT * (LENGTH * np.cos(x) - d * np.sin(x))

    (fold,) = roots(lambda x: x * stiffness(x) - pull(x), -np.pi / 2, -0.01)
    (turn,) = along_states.turns
    assert turn.kind == "fold"
    assert turn.value == pytest.approx(stiffness(fold), rel=1e-8)
    assert turn.orientation == pytest.approx([fold, 0, 0], abs=1e-6)
    for interval in along_states.intervals:
        K = 0.5 * (interval.low + interval.high)
        slopes = [K - stiffness(x) for x in roots(lambda x, K=K: K * x - pull(x), -3.1, 3.1)]
        assert (interval.states, interval.stable) == (
            len(slopes),
            sum(slope > 0 for slope in slopes),
        )
        assert not (interval.proved and interval.low <= stiffness(fold) <= interval.high)


def test_a_whole_gain_is_scaled_and_two_directions_give_way_at_once():
    along_states = along(held_leg((10, 10, 5)), "controller.K_r", 0.5, 0.8, 5, scales=True)
    (turn,) = along_states.turns
    assert (turn.kind, turn.value) == ("pitchfork", pytest.approx(WEIGHT_MOMENT / 10, rel=1e-6))
    # Besides θ = 0, (±a, 0), (0, ±a), and (±b, ±b).
    counts = {
        (interval.low > turn.value, interval.states, interval.stable)
        for interval in along_states.intervals
        if interval.proved
    }
    assert counts == {(False, 9, 4), (True, 1, 1)}


def energy(Theta, K, r):
    """Return U of a held body, without m g, at points of shape (3, n)."""
    (a, b, c), (x, y, z) = Theta, r
    # The height of R_x(a) R_y(b) R_z(c) r.
    across, up = x * np.sin(c) + y * np.cos(c), -np.sin(b) * (x * np.cos(c) - y * np.sin(c))
    return np.sin(a) * across + np.cos(a) * (up + np.cos(b) * z) + K @ Theta**2 / 2


def scanned(K, r):
    """Return the rest states in the range, and how many are minima: Newton's method from a grid."""
    axes = (np.linspace(-3, 3, 11), np.linspace(-1.5, 1.5, 7), np.linspace(-3, 3, 11))
    x = np.array(np.meshgrid(*axes)).reshape(3, -1)

    def gradient(x):
        steps = 1e-30j * np.eye(3)[:, :, None]
        return np.array([energy(x + step, K, r).imag / 1e-30 for step in steps])

    def hessian(x):
        steps = 1e-5 * np.eye(3)[:, :, None]
        return np.array([(gradient(x + step) - gradient(x - step)) / 2e-5 for step in steps])

    for _ in range(40):
        H = np.moveaxis(hessian(x), 2, 0)
        step = np.linalg.solve(H + 1e-13 * np.eye(3), gradient(x).T[..., None])[..., 0].T
        x = x - step * np.minimum(1, 0.3 / np.abs(step).max(axis=0).clip(1e-300))
    inside = np.all(np.abs(x) < np.array([np.pi, np.pi / 2, np.pi])[:, None], axis=0)
    x = x[:, inside & (np.abs(gradient(x)).max(axis=0) < 1e-10)]
    x = np.unique(np.round(x, 5), axis=1)
    values = np.linalg.eigvalsh(np.moveaxis(hessian(x), 2, 0))
    return x.shape[1], int((values.min(axis=1) > 0).sum())


@pytest.mark.parametrize("seed", range(4))
def test_what_is_proved_of_random_bodies_is_what_a_dense_scan_finds(seed):
    rng = np.random.default_rng(seed)
    K, c = rng.uniform(0.2, 1.5, 3), rng.uniform(-0.4, 0.4, 3)
    config = {
        "body": {"mass": 1, "inertia": [1, 1, 1], "contact_point": c.tolist()},
        "gravity": [0, 0, -1],
        "controller": {"variant": "permanent", "K_r": K.tolist(), "L_r": [1, 1, 1]},
        "integration": {"duration": 1},
    }
    along_states = along(config, "controller.K_r", 0.05, 1, 5, scales=True)
    check_cover(along_states, 0.05, 1)
    proved = [interval for interval in along_states.intervals if interval.proved]
    assert sum(interval.high - interval.low for interval in proved) > 0.4
    for interval in proved:
        assert (interval.states, interval.stable) == scanned(
            rng.uniform(interval.low, interval.high) * K, -c
        )
    # Also what is seen is right.
    for interval in along_states.intervals:
        middle = 0.5 * (interval.low + interval.high)
        assert interval.proved or (interval.states, interval.stable) == scanned(middle * K, -c)


@pytest.mark.parametrize("key", ["controller.K_t", "controller.K_c"])
def test_a_stiffness_that_holds_the_position_is_a_parameter_too(key):
    """X is then left in the energy; the proof of one body eliminates it exactly."""
    config = rbstab.load_config(CONFIGS / "paper" / "case2_visco_elastic.yaml")
    along_states = along(config, key, 0.95, 1, 2, scales=True, some=1)
    (interval,) = along_states.intervals
    assert (interval.states, interval.stable, interval.proved) == (1, 1, True)
    middle = Parameter(key, np.ones(1)).at(config, 0.97)
    alone = rbstab.prove(middle)
    assert (alone.proved, len(alone.states), alone.stable_count) == (True, 1, 1)


def test_no_interval_of_a_tied_body_needs_many_boxes(monkeypatch):
    """Made for the middle of all values alone, the energy needs thousands near both ends."""
    monkeypatch.setattr(intervals, "MOST_BOXES", 1000)
    config = rbstab.load_config(CONFIGS / "paper" / "case2_visco_elastic.yaml")
    found = along(config, "controller.K_c", 0.5, 2, 2, scales=True)
    assert [(one.states, one.stable, one.proved) for one in found.intervals] == [(1, 1, True)]


def with_strut(config):
    strut = {"kind": "spring", "point": [0.1, 0, 0], "anchor": [0.7, 0, 0.5], "stiffness": 30}
    return config | {"elements": {"strut": strut | {"rest_length": 0.6, "damping": 1}}}


@pytest.mark.parametrize(
    ("config", "key", "why"),
    [
        (with_strut(leg()), "elements.strut.stiffness", "not a quadratic function of X and D"),
        (
            held_leg(
                elements={
                    "stop": {"kind": "guard", "method": "stop", "angle": 1.2, "restitution": 0.5}
                }
            ),
            "controller.K_r[0]",
            "a stop, or a force that jumps",
        ),
        (
            held_leg(
                elements={
                    "stop": {"kind": "guard", "method": "stop", "angle": 1.2, "restitution": 0.5}
                }
            ),
            "elements.stop.angle",
            "the angle of a stop varies",
        ),
        (
            held_leg() | {"controller": {"variant": "permanent", "K_r": [5, 5, 2.5]}},
            "controller.K_r[0]",
            "damp",
        ),
        (held_leg(), "integration.duration", "its numbers are in no proof"),
    ],
)
def test_what_is_not_followed_or_not_proved_has_its_reason(config, key, why):
    low, high = (1, 1.4) if key.endswith("angle") else (2, 4)
    along_states = along(config, key, low, high, 3)
    assert why in along_states.why
    assert not any(interval.proved for interval in along_states.intervals)
