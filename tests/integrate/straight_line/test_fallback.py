"""Where no code can be made, or a value is not finite, numpy's bits stand."""

from dataclasses import replace

import numpy as np
import pytest
from support.problems import problem, solve
from support.springs import with_spring
from support.systems import random_state, random_system

from rbstab.integrate.straight_line.equations import audited_rates_of


def branch(E):
    return E if E[0] > 0 else 2.0 * E


def truth(E):
    return E if E[0] else 2.0 * E


def equality(E):
    return E if E[0] == 0.5 else 2.0 * E


def in_place(E):
    stretched = np.zeros(3)
    stretched[:] = E
    return stretched


def converted(E):
    return np.array([float(entry) for entry in E])


UNTRACEABLE = {
    "branch": branch,
    "truth": truth,
    "equality": equality,
    "in place": in_place,
    "converted": converted,
    "abs": np.abs,
    "arcsinh": np.arcsinh,
    "fractional power": lambda E: (E * E) ** 1.5,
    "sign": np.sign,
    "maximum": lambda E: np.maximum(E, 0.0),
    "where": lambda E: np.where(E > 0, E, 2 * E),
    "clip": lambda E: np.clip(E, -1, 1),
    "solve": lambda E: np.linalg.solve(np.eye(3), E),
    "infinite constant": lambda E: E + 0.0 * (E * np.inf),
    "complex constant": lambda E: ((E + 1j) * (E - 1j)).real,
}

TRACEABLE = {
    "exp": np.exp,
    "power": lambda E: E**3,
    "norm": lambda E: np.linalg.norm(E) * E,
    "sqrt": lambda E: np.sqrt(1.0 + E @ E) * E,
    "sum": lambda E: np.full(3, 1.0) * E.sum(),
    "mean": lambda E: E - E.mean(),
    "outer": lambda E: np.outer(E, E) @ E,
    "einsum": lambda E: np.einsum("i,ij->j", E, np.arange(9.0).reshape(3, 3)),
    "cross": lambda E: np.cross(E, np.array([1, 2, 3])),
    "stack": lambda E: np.vstack([E, E])[1][::-1],
    "division": lambda E: E / (1.0 + E @ E),
    "integers": lambda E: 2 * E + np.arange(3),
    "constant": lambda _: np.array([1.0, -0.0, -2.5]),
}


def state_of(rng, system):
    return np.concatenate([random_state(rng, system), np.zeros(2)])


@pytest.mark.parametrize("name", UNTRACEABLE)
def test_what_no_trace_can_record_is_evaluated_by_numpy(rng, name):
    system = with_spring(rng, UNTRACEABLE[name])
    y = state_of(rng, system)
    line = audited_rates_of(system)
    assert line.finite_value(y) is None
    with np.errstate(all="ignore"):
        np.testing.assert_array_equal(line(y), system.audited_rates(y))


@pytest.mark.parametrize("name", TRACEABLE)
def test_what_is_plain_algebra_is_traced(rng, name):
    system = with_spring(rng, TRACEABLE[name])
    y = state_of(rng, system)
    rates = audited_rates_of(system).finite_value(y)
    assert rates is not None
    np.testing.assert_allclose(rates, system.audited_rates(y), rtol=1e-11, atol=1e-11)


def test_an_error_of_the_equations_is_not_hidden(rng):
    def broken(E):
        raise RuntimeError("a fault of the element")

    system = with_spring(rng, broken)
    with pytest.raises(RuntimeError, match="a fault of the element"):
        audited_rates_of(system)(state_of(rng, system))


def test_the_engine_runs_with_a_branch_in_an_element():
    """A spring that pulls twice as hard on one side, against the bounces of two half periods."""
    rng = np.random.default_rng(0)
    system = with_spring(rng, branch)
    start = random_state(rng, system)
    start[:6] *= 0.1
    run = solve("scipy", problem(system, start, np.linspace(0, 0.2, 5), rtol=1e-9))
    assert run.status == "completed"
    linear = with_spring(np.random.default_rng(0), lambda E: E)
    other = solve("scipy", problem(linear, start, np.linspace(0, 0.2, 5), rtol=1e-9))
    assert np.abs(run.states - other.states).max() > 1e-6


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e200, -1e308])
def test_numbers_that_are_not_finite_are_those_of_numpy(rng, value):
    system = random_system(rng, "embedded")
    for k in range(system.size):
        y = state_of(rng, system)
        y[k] = value
        line = audited_rates_of(system)
        with np.errstate(all="ignore"):
            expected = system.audited_rates(y)
            rates = line(y)
        if np.isfinite(expected).all():
            np.testing.assert_allclose(rates, expected, rtol=1e-9)
        else:
            np.testing.assert_array_equal(rates, expected)


def test_a_division_by_zero_is_that_of_numpy(rng):
    def by_distance(E):
        return np.array([0.0, 0.0, 1.0]) / (E @ E)

    def zero_by_distance(E):
        return np.zeros(3) / (E @ E)

    for g in (by_distance, zero_by_distance):
        system = with_spring(rng, g)
        system = replace(system, anchor=np.zeros(3))
        y = np.zeros(14)
        with np.errstate(all="ignore"):
            assert audited_rates_of(system).finite_value(y) is None
            expected = system.audited_rates(y)
            np.testing.assert_array_equal(audited_rates_of(system)(y), expected)
        assert not np.isfinite(expected).all()
        away = state_of(rng, system)
        assert audited_rates_of(system).finite_value(away) is not None
