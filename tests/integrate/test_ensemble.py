"""A batch integrates each member as a single run does, independently of its other members."""

from typing import Any

import numpy as np
import pytest
from support.problems import problem, solve
from support.rest import system_of
from support.systems import VARIANTS, random_Z

from rbstab.integrate.heyoka.compiled_map import compiled_map
from rbstab.integrate.heyoka.ensemble import CHANGE_ROW, Ensemble
from rbstab.integrate.heyoka.observed import Observed
from rbstab.integrate.heyoka.symbols import fitting_scales, parameter_values
from rbstab.mechanics.motion import motion_from_centre
from rbstab.systems.quantities import observed_in

TIMES = np.linspace(0, 0.5, 11)
MEMBERS = 21


def members_of(variant, count=MEMBERS):
    """Return systems of one structure, their parameters and their starts, all different."""
    systems = [system_of(variant, seed) for seed in range(count)]
    starts = []
    for seed, system in enumerate(systems):
        Z = 0.3 * random_Z(np.random.default_rng(1000 + seed))
        states = np.zeros(system.size - system.coordinates.size)
        starts.append(system.start(motion_from_centre(system.body, system.anchor, Z), states))
    parameters = np.array([parameter_values(system) for system in systems]).T
    return systems, parameters, np.array(starts).T


@pytest.fixture(scope="module", params=VARIANTS)
def made(request):
    systems, parameters, starts = members_of(request.param)
    ensemble = Ensemble(systems[0], 1e-10, TIMES)
    return systems, parameters, starts, ensemble, ensemble.run(parameters, starts)


def test_every_member_is_a_single_run_at_its_samples_and_at_the_ends_of_its_steps(made):
    systems, _, starts, _, motions = made
    assert motions.done.all()
    for k in range(0, MEMBERS, 5):
        size, ends = systems[k].size, motions.ends[k].copy()
        assert ends.shape[1] == motions.steps[k] + 1
        assert ends[0, [0, -1]].tolist() == TIMES[[0, -1]].tolist()
        assert (np.diff(ends[0]) > 0).all()
        ends[1 + size :] *= motions.scales[k]
        for times, audited in ((TIMES, motions.samples[:, k]), (ends[0], ends[1:])):
            run = solve("heyoka", problem(systems[k], starts[:, k], times, rtol=1e-10))
            scale = np.abs(run.states).max()
            assert np.abs(audited[:size].T - run.states).max() < 1e-9 * scale
            assert audited[CHANGE_ROW] == pytest.approx(run.lyapunov_change, rel=1e-8)
    assert (motions.boundary == motions.samples[..., [0, -1]]).all()


def test_each_quantity_is_its_formula_at_the_states_of_a_member(made):
    """Compiled from expressions of heyoka, and evaluated with floats."""
    systems, parameters, _, ensemble, motions = made
    quantities: Any = {
        name: entry
        for name, entry in observed_in(systems[0]).items()
        if "part" not in entry.dimensions
    }
    assert len(quantities) >= 9
    observed = Observed(ensemble.compiled, ensemble.symbolic, quantities)
    values = observed.along(parameters, motions.samples, TIMES)
    for k, n in ((0, 0), (0, 7), (MEMBERS - 1, 7)):
        seen = systems[k].observe(motions.samples[:, k, n], TIMES[n])
        for name, quantity in quantities.items():
            value = np.asarray(quantity.formula(seen))
            assert values[name][k, n] == pytest.approx(value, rel=1e-10, abs=1e-9), name
    energies = ensemble.energies(parameters, motions.samples[..., 7])
    assert energies[:, 3] == pytest.approx(systems[3].observe(motions.samples[:, 3, 7]).energy)


def bits(motions, chosen):
    ends = tuple(motions.ends[k].tobytes() for k in chosen)
    return motions.samples[:, chosen].tobytes(), motions.boundary[:, chosen].tobytes(), ends


def test_no_other_member_changes_a_bit(made):
    _, parameters, starts, ensemble, motions = made
    random, everyone = np.random.default_rng(0), np.arange(MEMBERS)
    order = random.permutation(MEMBERS)
    for cut in (1, 3, 8, 13, MEMBERS):
        for first in range(0, MEMBERS, cut):
            part = order[first : first + cut]
            again = ensemble.run(parameters[:, part], starts[:, part])
            assert bits(again, np.arange(len(part))) == bits(motions, part)
    # Nor one that fails, at its start or later; at θ2 = 90° steps shrink to round-off.
    for row, bad in ((4, np.nan), (4, np.inf), (4, 1e200), (1, np.pi / 2)):
        broken = starts.copy()
        broken[row, 3] = bad
        again = ensemble.run(parameters, broken)
        others = np.delete(everyone, 3)
        assert row == 1 or not again.done[3]
        assert again.done[others].all()
        assert bits(again, others) == bits(motions, others)
    unsampled = ensemble.run(parameters, starts, sampled=False)
    assert unsampled.samples is None
    assert unsampled.boundary.tobytes() == motions.boundary.tobytes()
    assert [end.tobytes() for end in unsampled.ends] == [end.tobytes() for end in motions.ends]


def test_a_step_again_is_the_motion_within_the_step(made):
    systems, parameters, starts, ensemble, motions = made
    k, step = 5, 3
    ends, scale = motions.ends[k], motions.scales[k]
    times = np.linspace(ends[0, step], ends[0, step + 1], 7)
    audited = ensemble.step_again(parameters[:, k], scale, ends[1:, step], times)
    assert audited[:, [0, -1]] == pytest.approx(ends[1:, [step, step + 1]], rel=1e-13, abs=1e-13)
    run = solve("heyoka", problem(systems[k], starts[:, k], np.append(0.0, times), rtol=1e-12))
    error = audited[: systems[k].size].T - run.states[1:]
    assert np.abs(error).max() < 1e-9 * np.abs(run.states).max()
    assert scale * audited[CHANGE_ROW] == pytest.approx(run.lyapunov_change[1:], rel=1e-8)
    lost = np.full(len(audited), np.nan)
    assert ensemble.step_again(parameters[:, k], scale, lost, times) is None


def test_the_scale_of_the_audit_is_the_energy_at_the_start(made):
    systems, parameters, starts, ensemble, _ = made
    sizes = ensemble.energy_sizes(parameters, starts)
    for k in (0, 10):
        assert sizes[k] == pytest.approx(np.abs(systems[k].observe(starts[:, k]).energy).sum())
    nothing = ensemble.run(0 * parameters, 0 * starts)
    assert not ensemble.energy_sizes(0 * parameters, 0 * starts).any()
    assert nothing.samples.shape == (ensemble.size + 1, MEMBERS, len(TIMES))


def test_a_scale_is_replaced_where_the_energies_of_a_run_do_not_fit_it():
    """A scale fits up to a factor of 100: energies at the start, and what was supplied."""
    sizes = np.array([7.0, 7.0, 7.0, 7.0, 7.0, 0.0])
    scales = np.array([7.0, 7.0, 7.0, 7.0, 7000.0, 1.0])
    audits = np.array([50.0, 1e3, np.nan, np.inf, 0.0, 0.0])
    fitted = fitting_scales(sizes + audits * scales, scales)
    # A scale that is far too large for a run hides its errors.
    np.testing.assert_array_equal(fitted, [7.0, 7007.0, 7.0, 7.0, 7.0, 1.0])


def test_a_compiled_map_is_its_function():
    def function(x):
        return np.array([x[0] * x[1], 3.0, x[2]])

    values = np.random.default_rng(0).normal(size=(3, 50))
    expected = np.array([function(column) for column in values.T]).T
    assert compiled_map(function, 3)(values) == pytest.approx(expected, rel=1e-15)
    constant = compiled_map(lambda _: np.array([1.5, 2.0]), 0)(np.zeros((0, 4)))
    assert constant.tolist() == [[1.5] * 4, [2.0] * 4]
    varies = compiled_map(function, 3).varies
    assert varies.tolist() == [True, False, True]
    assert not compiled_map(lambda _: np.array([1.5, 2.0]), 0).varies.any()


def test_what_is_the_same_for_all_may_be_compiled_in():
    systems, parameters, starts = members_of("embedded", 9)
    varies = np.zeros(len(parameters), dtype=bool)
    varies[[0, 5, 20, 40]] = True
    some = np.where(varies[:, None], parameters, parameters[:, :1])
    closed = Ensemble(systems[0], 1e-10, TIMES, varies)
    opened = Ensemble(systems[0], 1e-10, TIMES)
    motions, expected = closed.run(some, starts), opened.run(some, starts)
    assert motions.samples == pytest.approx(expected.samples, abs=1e-7)
    energies = [ensemble.energies(some, motions.boundary[..., -1]) for ensemble in (closed, opened)]
    assert energies[0] == pytest.approx(energies[1], rel=1e-9)
