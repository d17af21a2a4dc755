"""The exact energy of a config is the stored energy of its system, least over X and own states."""

from fractions import Fraction
from functools import cache, partial
from pathlib import Path

import numpy as np
import pytest

from rbstab.analysis.configuration import configurations
from rbstab.analysis.rest_system import smooth_rest_system
from rbstab.config.build import problem_of, system_of
from rbstab.config.load import load_config
from rbstab.config.user_code.permission import without_code
from rbstab.proof.enclosures.bounds import BoundedEnergy
from rbstab.proof.enclosures.taylor import value_at
from rbstab.proof.exact.atoms import COS
from rbstab.proof.exact.expr import atom, variable
from rbstab.proof.model import (
    NoMinimumError,
    _poles,
    eliminated,
    energy_of,
)
from rbstab.proof.pieces import jumps
from rbstab.proof.reasons import NoReducedEnergy
from rbstab.proof.rest_states import Body

CONFIGS = Path(__file__).parents[2] / "configs"
SHIPPED = sorted(
    str(path.relative_to(CONFIGS))
    for folder in ("examples", "paper")
    for path in (CONFIGS / folder).rglob("*.yaml")
)
V = [variable(k) for k in range(6)]
HALF = Fraction(1, 2)


@cache
def built(name):
    """Return a system, and the function that builds it in other numbers."""
    config = load_config(CONFIGS / name, allow_python=True)
    system = smooth_rest_system(problem_of(config))
    return system, partial(system_of, without_code(config))


@pytest.mark.parametrize("name", SHIPPED)
def test_the_energy_is_that_of_the_system(name):
    """At random angles and z, with all else where it is least; and nothing else is lower."""
    system, exact = built(name)
    # A sliding force has no potential, and an activation no least energy.
    if any(word in name for word in ("layer", "sliding_ties", "coactivation")):
        with pytest.raises(NoReducedEnergy):
            Body(system, exact)
        return
    energy = energy_of(system, exact)
    at_rest = configurations(system)
    rng = np.random.default_rng(1)
    for _ in range(5):
        q = rng.uniform(-1, 1, at_rest.size)
        if energy.stop is not None:
            q[1] *= float(energy.stop)
        U = value_at(energy.U, q)
        moved = energy.completed(q)
        expected = float(at_rest.energy(moved))
        assert pytest.approx(expected, abs=1e-12 * (1 + abs(expected)), rel=1e-11) == U
        slope = np.asarray(at_rest.gradient(moved))
        for k in energy.minimiser:
            aside = moved.copy()
            aside[k] += 0.05
            assert abs(slope[k]) < 1e-9 * (1 + np.abs(slope).max())
            assert float(at_rest.energy(aside)) > expected


@pytest.mark.parametrize("name", ["examples/rubber_cord.yaml", "examples/ligament_proved.yaml"])
def test_the_configuration_with_the_least_energy_has_no_slope(name):
    """Where positions stay in the energy: at Θ they are those at which the system is in balance."""
    body = Body(*built(name))
    assert body.energy.free
    Theta = np.array([0.2, -0.1, 0.15])
    q = body.configuration(Theta)
    np.testing.assert_array_equal(q[:3], Theta)
    slope = np.asarray(body.at_rest.gradient(q))
    assert np.abs(slope[3:]).max() < 1e-9 * (1 + np.abs(slope).max())
    least = BoundedEnergy(body.energy.U, free=body.energy.free).at(Theta[:, None])[0]
    assert float(body.at_rest.energy(q)) == pytest.approx(least[0], rel=1e-11)


def test_only_forces_that_jump_are_told_to_jump():
    """The latch lets go where cos² θ2 = 91/100; the force of a strut begins without a jump."""
    (latch,) = jumps(energy_of(*built("examples/latch.yaml")))
    assert latch.inner == Fraction(91, 100) - V[1].cos() ** 2
    for name in ("examples/strut_proved.yaml", "examples/rubber_cord.yaml"):
        assert jumps(energy_of(*built(name))) == []


def test_a_barrier_closes_the_range_only_where_the_energy_rises_to_infinity():
    x, y = V[0], V[1]
    c, half = y.cos(), (x * Fraction(1, 2)).cos()
    assert _poles(x * x + 5 * c**-2 - 3 * c**-1) == {1}
    assert _poles(half**-2 + y * y) == {0}
    for U in (
        -5 * c**-2 + 3 * c**-1,
        5 * c**-2 - c**-3,
        x * c**-2,
        5 * c**-2 - (c**-1).exp(),
    ):
        assert _poles(U) == set()
    assert energy_of(*built("paper/case1_guarded.yaml")).closed == {1}
    stopped = energy_of(*built("examples/stop.yaml"))
    assert stopped.stop == Fraction(9, 10)
    assert stopped.closed == {1}
    assert stopped.least[atom(COS, y)] == 0.0


def test_what_is_not_quadratic_stays():
    """Y has a fourth power, Z a stiffness that depends on θ1; counted from their centre."""
    s, X, Y, Z = V[0].sin(), V[3], V[4], V[5]
    total = HALF * (X * X + Y * Y + Z * Z) - X * s - Y * s + Y**4 + (2 + s) * Z * Z
    reduced = eliminated(total, range(3, 6))
    assert reduced.free == (4, 5)
    assert reduced.minimiser == {3: s}
    q = np.array([0.3, 0, 0, np.nan, 0.2, -0.1])
    sine = np.sin(0.3)
    y, z = q[4] + value_at(reduced.shift[4], q), q[5] + value_at(reduced.shift[5], q)
    exact = -0.5 * sine**2 + 0.5 * (y * y + z * z) - y * sine + y**4 + (2 + sine) * z * z
    assert value_at(reduced.U, q) == pytest.approx(exact, rel=1e-13)


@pytest.mark.parametrize("c", [0, -1])
def test_what_nothing_holds_has_no_minimum(c):
    with pytest.raises(NoMinimumError):
        eliminated(c * V[3] ** 2 + V[0] ** 2 + V[3] * V[0].sin(), range(3, 4))
