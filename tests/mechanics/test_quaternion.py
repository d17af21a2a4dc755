"""Quaternions of any length: A, their rates, and their Euler angles near θ2 = ±90°."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rbstab.mechanics import attitude
from rbstab.mechanics.algebra import cross_matrix
from rbstab.mechanics.quaternion import (
    angles,
    beyond_ends,
    continued_angles,
    quaternion,
    rate_matrix,
    rotation,
    turning,
)
from rbstab.systems.coordinates import CentreCoordinates, QuaternionCoordinates

RNG = np.random.default_rng(43)

POLES = [
    [0.3, math.pi / 2, -0.4],
    [-2.0, -math.pi / 2, 3.0],
    [1.0, math.pi / 2 - 1e-9, 2.0],
    [1.0, -math.pi / 2 + 1e-13, -2.0],
]
ATTITUDES = np.array([*RNG.uniform(-math.pi, math.pi, (20, 3)), *POLES])


def along(rotations):
    """Return w and r of rotations, shape (n,) and (3, n), continuous as integrated ones are."""
    q = rotations.as_quat(scalar_first=True).T
    q[:, 1:] *= np.cumprod(np.where((q[:, 1:] * q[:, :-1]).sum(axis=0) < 0, -1, 1))
    return q[0], q[1:]


def continued(w, r, Omega, times):
    """Return the continued angles of a motion from its principal ones, and its turn in doubt."""
    start, _ = angles(w[:1], r[:, :1])
    Theta, (doubt,) = continued_angles(w, r, Omega, times, np.zeros(1, dtype=int), start)
    return Theta, doubt


@pytest.mark.parametrize("length", [1.0, 1e-3, 3.7])
@pytest.mark.parametrize("Theta", ATTITUDES)
def test_it_is_the_rotation_of_the_angles_at_any_length(Theta, length):
    (w,), r = (length * part for part in quaternion(Theta))
    A = attitude.rotation(Theta)
    assert rotation(w, r) == pytest.approx(A, abs=1e-15)
    principal, upright = angles(w, r)
    assert attitude.rotation(principal) == pytest.approx(A, abs=2e-15)
    assert np.abs(principal[[0, 2]]).max() <= math.pi
    assert abs(principal[1]) <= math.pi / 2
    assert upright == pytest.approx(math.hypot(A[0, 0], A[0, 1]), abs=1e-15)


@pytest.mark.parametrize("length", [1.0, 2.5])
def test_the_rotation_turns_by_the_body_rates(length):
    Theta, Omega = RNG.normal(size=3), RNG.normal(size=3)
    (w,), r = (length * part for part in quaternion(Theta))
    h = 1e-30
    r_rate, w_rate = rate_matrix(w, r) @ Omega, -0.5 * (r @ Omega)
    A_rate = rotation(w + 1j * h * w_rate, r + 1j * h * r_rate).imag / h
    assert A_rate == pytest.approx(rotation(w, r) @ cross_matrix(Omega), abs=1e-14)
    # It keeps its length.
    assert w * w_rate + r @ r_rate == pytest.approx(0.0, abs=1e-14)


@pytest.mark.parametrize(("axis", "row"), [([0, 0, 1.0], 2), ([1.0, 0, 0], 0)])
def test_angles_count_the_turns(axis, row):
    times = np.linspace(0, 10, 101)
    turning = 12.0 * times
    w, r = along(Rotation.from_rotvec(np.outer(turning, axis)))
    Omega = np.tile(12.0 * np.array(axis)[:, None], len(times))
    Theta, doubt = continued(w, r, Omega, times)
    expected = np.zeros((3, len(times)))
    expected[row] = turning
    assert Theta == pytest.approx(expected, abs=1e-12)
    assert doubt == 0.0


def test_the_way_round_the_pole_is_the_right_one():
    """Where the ways bend round the pole between two samples, the shorter one may be wrong."""
    rng, turn, parts = np.random.default_rng(1), 0.7, 400
    wrong = 0
    for _ in range(100):
        axis, begin = Rotation.random(2, random_state=rng.integers(2**31))
        Omega = turn * begin.as_matrix().T @ axis.as_matrix()[0]
        times = np.linspace(0, 20, 20 * parts + 1)
        w, r = along(Rotation.from_rotvec(np.outer(turn * times, axis.as_matrix()[0])) * begin)
        principal, upright = angles(w, r)
        if upright.min() < 1e-3:
            continue
        expected = np.unwrap(principal)[:, ::parts]
        spin = np.tile(Omega[:, None], 21)
        Theta, doubt = continued(w[::parts], r[:, ::parts], spin, times[::parts])
        if doubt == 0.0:
            assert Theta - Theta[:, :1] == pytest.approx(expected - expected[:, :1], abs=1e-9)
            wrong += bool(np.abs(np.unwrap(principal[:, ::parts]) - expected).max() > 1.0)
    assert wrong > 0


def test_ways_that_samples_do_not_tell_are_in_doubt():
    times = np.linspace(0, 6.0, 13)
    w, r = along(Rotation.from_rotvec(np.outer(8.0 * times, [0.1, 1.0, 0.1])))
    Omega = np.tile(8.0 * np.array([0.1, 1.0, 0.1])[:, None], len(times))
    _, doubt = continued(w, r, Omega, times)
    assert doubt == pytest.approx(4.0 * math.hypot(1.0, 0.1, 0.1))
    assert continued(w[:1], r[:, :1], Omega[:, :1], times[:1])[1] == 0.0


def test_no_other_motion_changes_a_bit_of_the_angles():
    """Nor the order of the samples, nor a motion that is no number."""
    rng, q = np.random.default_rng(3), QuaternionCoordinates(CentreCoordinates())
    spins = np.array([[9, 1, 0.2], [0, 0, 30], [0.1, 12, 0.01], [0, np.nan, 0], [3, -8, 5]])
    motions, starts = [], rng.uniform(-20, 20, (3, len(spins)))
    for spin, Theta in zip(spins, starts.T, strict=True):
        times = np.sort(rng.uniform(0, 4, rng.choice([9, 40])))
        begin = Rotation.from_euler("XYZ", Theta)
        turned = Rotation.from_rotvec(np.outer(times - times[0], np.nan_to_num(spin)))
        w, r = along(begin * turned)
        y = np.zeros((q.size, len(times)))
        y[:3], y[3:6], y[-1] = r, spin[:, None], w
        y[:, 3:] += 0.0 * spin.sum()
        motions.append((y, times))
    alone = [
        q.angles_along(y, times, starts[:, [k]], np.zeros(len(times), dtype=int))
        for k, (y, times) in enumerate(motions)
    ]
    assert sum(np.ptp(Theta[[0, 2]]) > 2 * math.pi for Theta, _ in alone) > 2
    for order in (np.arange(5), np.array([3, 1, 4, 0, 2])):
        y, times = (np.concatenate([motions[k][i] for k in order], axis=-1) for i in (0, 1))
        of = np.repeat(np.arange(5), [len(motions[k][1]) for k in order])
        mixed = rng.permutation(len(of))
        Theta, turns = q.angles_along(y[:, mixed], times[mixed], starts[:, order], of[mixed])
        assert turns.tobytes() == np.array([alone[k][1][0] for k in order]).tobytes()
        unmixed = np.empty_like(Theta)
        unmixed[:, mixed] = Theta
        assert unmixed.tobytes() == np.concatenate([alone[k][0] for k in order], axis=1).tobytes()


def test_steps_past_the_pole_show_how_far_the_angles_go_beyond_their_ends():
    rng, turn, parts = np.random.default_rng(2), 0.7, 400
    seen = 0
    for _ in range(300):
        axis = Rotation.random(random_state=rng.integers(2**31)).as_matrix()[0]
        pitch = math.pi / 2 - rng.uniform(-turn, turn)
        begin = Rotation.from_euler("XYZ", [rng.uniform(-3, 3), pitch, rng.uniform(-3, 3)])
        times = np.linspace(0, 1, parts + 1)
        w, r = along(Rotation.from_rotvec(np.outer(turn * times, axis)) * begin)
        principal, upright = angles(w, r)
        if upright.min() < 0.01:
            continue
        path = np.unwrap(principal)[::2]
        ends = path[:, [0, -1]]
        over = np.maximum(path.max(axis=1) - ends.max(axis=1), ends.min(axis=1) - path.min(axis=1))
        Omega = turn * begin.inv().apply(axis)
        before, after = (np.concatenate([w[[k]], r[:, k], Omega])[:, None] for k in (0, -1))
        beyond = beyond_ends(before, after, np.array([1.0]))[:, 0]
        # Sixteen points show at least half of what is to be seen.
        shown = over > 0.02
        seen += shown.sum()
        assert (beyond[shown] > 0.5 * over[shown]).all()
        assert (beyond <= over + 1e-3).all()
    assert seen > 20


@pytest.mark.parametrize("pitch", [0.3, -1.2, 1.57])
def test_the_angles_turn_with_their_rates(pitch):
    Theta, Omega, h = np.array([0.7, pitch, -2.0]), RNG.normal(size=3), 1e-7
    (w,), r = quaternion(Theta)
    values, rates = turning(w, r, Omega)
    assert values == pytest.approx([Theta[0], math.sin(pitch), Theta[2]], abs=1e-12)
    r_rate, w_rate = rate_matrix(w, r) @ Omega, -0.5 * (r @ Omega)
    after, before = (turning(w + k * w_rate, r + k * r_rate, Omega)[0] for k in (h, -h))
    # An angle turns by 1 / cos θ2 of the body's rate, and bends as much faster.
    assert rates == pytest.approx((after - before) / (2 * h), rel=1e-5, abs=1e-7)
