"""Bounds of the checker over boxes contain what balls of 300 bits say, with switches and with z."""

from fractions import Fraction

import pytest
from flint import arb, ctx
from hypothesis import assume, given, settings
from support.balls import BITS, reduced
from support.expressions import boxes

from rbstab.proof.check.bounds import Bounds
from rbstab.proof.check.energy import read_energy
from rbstab.proof.exact.expr import variable
from rbstab.proof.record import operations_of

X, Y, Z, W = (variable(k) for k in range(4))
H = Y + X / 2 - Fraction(1, 5)

ENERGIES = {
    "sines": X.sin() * Y.cos() ** 3 * 5 - X * Y * Z + Z**4 * X.cos(),
    "roots": (3 + X.sin() * Z.cos()).sqrt() * (X + Y) + (2 + Y.cos()) ** -3,
    "others": (X * Y - Z).exp() + (6 + X + Y * Z).log() + (2 * X - Z * Y).atan(),
    "a force that jumps": X**2 * Y + 3 * H * Z.cos() * H.step(1),
    "a kink": X.sin() * Z + H**2 * (X + 2) * H.step(2),
    "a kink in a root": X * Z + (2 + H.step(2) * (H**2 + H**4)).sqrt() * (1 + X),
    "a ligament": X * Z + H**3 * (Y.sin() + 2) * H.step(3),
    "a quartic": 3 * W**2 + W**4 + X.sin() * Y * W + Z * X,
    "an exponential": W**2 + (W + X.sin() - Z).exp() + Y.cos() * X,
}


def bounds(name, box):
    free = (3,) if name in {"a quartic", "an exponential"} else ()
    return free, Bounds(read_energy(operations_of(ENERGIES[name]), free), box)


@pytest.mark.parametrize("name", ENERGIES)
@settings(max_examples=25, deadline=None)
@given(box=boxes(reach=1.0))
def test_bounds_contain_the_least_energy_and_its_slopes(name, box):
    lo, hi, point = (x.tolist() for x in box)
    with ctx.workprec(BITS):
        free, b = bounds(name, tuple(zip(lo, hi, strict=True)))
        try:
            V, g, H = reduced(ENERGIES[name], dict(enumerate(point)), range(3), free)
        except ValueError:  # a step whose side is not known
            assume(False)
            raise
        slack = arb(0, 1e-20)
        assert not b.at_least(V.upper() + 1e-9)
        assert not b.below(V.lower() - 1e-9)
        away = [arb(p) - b.middle[i] for i, p in enumerate(point)]
        away += [b.steps[k] for k in b.jumps]  # λ is any number from 0 to 1
        for i in range(3):
            assert (b.slopes[i] + slack).overlaps(g[i])
            # ∇U = ∇U(m) + H (Θ - m)
            by_mean = b.gradient[i, 0] + sum((b.H[i, j] * d for j, d in enumerate(away)), arb(0))
            assert not by_mean.is_finite() or (by_mean + slack).overlaps(g[i])
            assert all((b.H[i, j] + slack).overlaps(H[i][j]) for j in range(3))


def test_both_sides_of_a_kink_count():
    """Of h² (θ1 + 2) with h = θ2 + ½ θ1 - 0.2, ∂²U/∂θ2² is 2 (θ1 + 2) on one side, else 0."""
    _, b = bounds("a kink", ((-0.01, 0.01), (0.15, 0.25), (0.0, 0.1)))
    assert b.H[1, 1].contains(0)
    assert b.H[1, 1].contains(4)
