"""A batch integrates each member as a single run does, independently of its other members."""

import numpy as np
import pytest
from support.problems import problem, solve
from support.rest import system_of
from support.systems import VARIANTS, random_Z

from rbstab.integrate.heyoka.compiled_map import CompiledMap
from rbstab.integrate.heyoka.ensemble.ensemble import Ensemble
from rbstab.integrate.heyoka.symbols import parameter_values
from rbstab.mechanics.motion import motion_from_centre

TIMES = np.linspace(0, 0.5, 11)
MEMBERS = 21


def members_of(variant, count=MEMBERS):
    """Return systems of one structure, their parameters and their starts, all different."""
    systems = [system_of(variant, seed) for seed in range(count)]
    starts = []
    for seed, system in enumerate(systems):
        Z = 0.3 * random_Z(np.random.default_rng(1000 + seed))
        own = np.zeros(system.size - system.coordinates.size)
        starts.append(system.start(motion_from_centre(system.body, system.anchor, Z), own))
    parameters = np.array([parameter_values(system) for system in systems]).T
    return systems, parameters, np.array(starts).T


@pytest.fixture(scope="module", params=VARIANTS)
def made(request):
    systems, parameters, starts = members_of(request.param)
    ensemble = Ensemble(systems[0], 1e-10, TIMES)
    motions = ensemble.run(parameters, starts)
    # The next run reuses the memory of the states.
    kept = motions._replace(lanes=motions.lanes.copy())
    return systems, parameters, starts, ensemble, kept


def test_every_member_is_a_single_run(made):
    systems, _, starts, _, motions = made
    assert motions.done.all()
    for k in range(0, MEMBERS, 5):
        run = solve("heyoka", problem(systems[k], starts[:, k], TIMES, rtol=1e-10))
        scale = np.abs(run.states).max()
        assert np.abs(motions.states[:, k].T - run.states).max() < 1e-9 * scale
        assert motions.lyapunov_change[k] == pytest.approx(run.lyapunov_change, rel=1e-8)


def test_what_is_observed_is_what_the_system_says(made):
    systems, parameters, _, ensemble, motions = made
    observed = ensemble.observer.observe(parameters, motions)
    positions = ensemble.observer.positions(parameters, motions, only_last=False)
    for k in (0, MEMBERS - 1):
        for n in (0, 7):
            seen = systems[k].observe(motions.states[:, k, n])
            motion = seen.motion
            expected = [motion.E, motion.Theta, motion.F, motion.B @ motion.Omega]
            expected += [motion.X, motion.V]
            found = (observed.values, observed.rates, positions.X, positions.V)
            vectors = np.concatenate([rows[:, k, n] for rows in found]).reshape(-1, 3)
            assert vectors == pytest.approx(np.array(expected), rel=1e-10, abs=1e-12)
            assert observed.energy[k, n] == pytest.approx(seen.energy.sum(), rel=1e-10, abs=1e-9)


def test_the_last_positions_are_those_of_all(made):
    _, parameters, _, ensemble, motions = made
    every = ensemble.observer.positions(parameters, motions, only_last=False)
    last = ensemble.observer.positions(parameters, motions, only_last=True)
    for rows, expected in zip(last, every, strict=True):
        assert rows.tobytes() == expected[..., -1:].tobytes()


def bits(motions, chosen):
    return (
        motions.states[:, chosen].tobytes(),
        motions.lyapunov_change[chosen].tobytes(),
        motions.steps[chosen].tobytes(),
    )


def test_the_place_in_a_batch_changes_no_bit(made):
    _, parameters, starts, ensemble, motions = made
    order = np.random.default_rng(0).permutation(MEMBERS)
    again = ensemble.run(parameters[:, order], starts[:, order])
    assert bits(again, np.argsort(order)) == bits(motions, np.arange(MEMBERS))


@pytest.mark.parametrize("cut", [1, 3, 8, 13])
def test_how_members_are_cut_changes_no_bit(made, cut):
    _, parameters, starts, ensemble, motions = made
    for first in range(0, MEMBERS, cut):
        part = np.arange(first, min(first + cut, MEMBERS))
        again = ensemble.run(parameters[:, part], starts[:, part])
        assert bits(again, np.arange(len(part))) == bits(motions, part)


@pytest.mark.parametrize("bad", [np.nan, np.inf, 1e200])
def test_a_member_that_fails_changes_no_bit_of_its_neighbours(made, bad):
    _, parameters, starts, ensemble, motions = made
    broken = starts.copy()
    broken[4, 3] = bad
    again = ensemble.run(parameters, broken)
    others = np.delete(np.arange(MEMBERS), 3)
    assert not again.done[3]
    assert again.done[others].all()
    assert bits(again, others) == bits(motions, others)


def test_a_member_at_the_end_of_the_range_ends_in_time(made):
    """At the end of the range the equations are singular, and steps shrink to round-off."""
    _, parameters, starts, ensemble, motions = made
    broken = starts.copy()
    broken[1, 5] = np.pi / 2
    again = ensemble.run(parameters, broken)
    others = np.delete(np.arange(MEMBERS), 5)
    assert bits(again, others) == bits(motions, others)


def test_the_scale_of_the_audit_is_the_energy_at_the_start(made):
    systems, parameters, starts, ensemble, _ = made
    found = ensemble.scales.at_start(parameters, starts)
    for k in (0, 10):
        assert found[k] == pytest.approx(np.abs(systems[k].observe(starts[:, k]).energy).sum())
    nothing = ensemble.scales.at_start(0 * parameters, 0 * starts)
    assert nothing.tolist() == [1.0] * MEMBERS


def test_a_scale_is_replaced_where_the_energies_of_a_run_do_not_fit_it(made):
    """A scale fits up to a factor of 100: energies at the start, and what was supplied."""
    _, parameters, starts, ensemble, _ = made
    initial = ensemble.scales.at_start(parameters, starts)
    audits = np.zeros(MEMBERS)
    audits[:4] = 50.0, 1e3, np.nan, np.inf
    found = ensemble.scales.fitting(parameters, starts, initial, audits)
    assert found[1] == pytest.approx(1001 * initial[1])
    kept = np.arange(MEMBERS) != 1
    np.testing.assert_array_equal(found[kept], initial[kept])
    # A scale that is far too large for a run hides its errors.
    shrunk = ensemble.scales.fitting(parameters, starts, 1e3 * initial, np.zeros(MEMBERS))
    np.testing.assert_array_equal(shrunk, initial)


def test_without_samples_a_motion_has_the_same_steps(made):
    """The ends of its steps are those of the sampled motion, from the start to the last sample."""
    systems, parameters, starts, ensemble, motions = made
    sampled = ensemble.run(parameters, starts)
    unsampled = ensemble.run(parameters, starts, sampled=False)
    assert unsampled.lanes.shape[2] == 2
    assert unsampled.states[..., -1].tobytes() == motions.states[..., -1].tobytes()
    for k in range(MEMBERS):
        ends = unsampled.ends[k]
        assert ends.tobytes() == sampled.ends[k].tobytes()
        assert ends.shape[1] == motions.steps[k] + 1
        assert ends[0, [0, -1]].tolist() == TIMES[[0, -1]].tolist()
        assert (np.diff(ends[0]) > 0).all()
        run = solve("heyoka", problem(systems[k], starts[:, k], ends[0], rtol=1e-10))
        scale = np.abs(run.states).max()
        states = ends[1 : 1 + systems[k].size].T
        assert np.abs(states - run.states).max() < 1e-9 * scale


def test_a_compiled_map_is_its_function():
    def function(x):
        return np.array([x[0] * x[1], 3.0, x[2]])

    values = np.random.default_rng(0).normal(size=(3, 50))
    expected = np.array([function(column) for column in values.T]).T
    assert CompiledMap(function, 3)(values) == pytest.approx(expected, rel=1e-15)
    constant = CompiledMap(lambda _: np.array([1.5, 2.0]), 0)(np.zeros((0, 4)))
    assert constant.tolist() == [[1.5] * 4, [2.0] * 4]
    found = CompiledMap(function, 3).varies
    assert found.tolist() == [True, False, True]
    assert not CompiledMap(lambda _: np.array([1.5, 2.0]), 0).varies.any()


def test_what_is_the_same_for_all_may_be_compiled_in():
    systems, parameters, starts = members_of("embedded", 9)
    varies = np.zeros(len(parameters), dtype=bool)
    varies[[0, 5, 20, 40]] = True
    some = np.where(varies[:, None], parameters, parameters[:, :1])
    closed = Ensemble(systems[0], 1e-10, TIMES, varies)
    opened = Ensemble(systems[0], 1e-10, TIMES)
    motions, expected = closed.run(some, starts), opened.run(some, starts)
    assert motions.states == pytest.approx(expected.states, abs=1e-7)
    assert closed.scales.at_start(some, starts) == pytest.approx(
        opened.scales.at_start(some, starts)
    )
    observed = closed.observer.observe(some, motions)
    for rows, expected_rows in zip(observed, opened.observer.observe(some, motions), strict=True):
        assert rows == pytest.approx(expected_rows, rel=1e-9, abs=1e-9)
