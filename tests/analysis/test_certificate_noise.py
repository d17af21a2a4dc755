"""Round-off never makes a check `violated` or `consistent`, and real faults stay `violated`."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from support.problems import bare_system
from support.rest import DAMPING, HEAVY, K_C, K_R, K_T, paper_system, system_of
from support.systems import random_Z

from rbstab.analysis import certificate
from rbstab.analysis.certificate import Evidence, Verdict, audit_bound, checks_of, overall
from rbstab.analysis.exact import ball, exact_rest_energy
from rbstab.analysis.lyapunov import audit_scale
from rbstab.analysis.rest_state import nearest_rest_state
from rbstab.elements.rotational_stabilizer import RotationalStabilizer
from rbstab.elements.sliding import SlidingConnector
from rbstab.elements.visco_elastic import ViscoElasticConnector
from rbstab.mechanics.body import Body
from rbstab.mechanics.derivatives import derivative_along
from rbstab.mechanics.motion import motion_from_centre

CONSISTENT, UNKNOWN, VIOLATED = Verdict.CONSISTENT, Verdict.UNKNOWN, Verdict.VIOLATED


def evidence(system, states, **changes):
    """Return the evidence of some states, as if they were a run without integration errors.

    v falls from state to state, so `decrease` and `audit` hold.
    """
    rest = nearest_rest_state(system)
    observed = [system.observe(y) for y in states]
    energy = np.array([o.energy for o in observed])
    value = energy.sum(axis=1) - rest.energy
    order = np.argsort(-value)
    dissipation = np.array([o.dissipation for o in observed])[order]
    given = {
        "times": np.arange(len(states), dtype=float),
        "states": np.array(states)[order],
        "systems": (system,) * len(states),
        "value": value[order],
        "rate": -dissipation.sum(axis=1),
        "dissipation": dissipation,
        "residual": np.zeros(len(states)),
        "energy": energy[order],
        "rest": rest,
        "approached": True,
        "exact_rest_energy": lambda: exact_rest_energy(system, rest),
        "scale": audit_scale(value[order], energy),
        "has_potential": True,
        "audit_bound": 1e-8,
    }
    return Evidence(**(given | changes))


def check(run, name):
    (found,) = [line for line in checks_of(run) if line.name == name]
    return found


def state_of(system, Z):
    motion = motion_from_centre(system.body, system.anchor, Z)
    return system.start(motion, np.zeros(system.size - system.coordinates.size))


def states_of(system, count=5, scale=1.0, seed=3):
    rng = np.random.default_rng(seed)
    return [state_of(system, scale * random_Z(rng)) for _ in range(count)]


def error_in_doubles(system, y):
    """Return |∇v·f - v'| over the sum of the powers, in double precision."""
    parts = derivative_along(lambda z: system.observe(z).energy, y, system.rates(y))
    rate = -system.observe(y).dissipation.sum()
    return abs(parts.sum() - rate) / (np.abs(parts).sum() + abs(rate))


def stretched(variant):
    """Return a paper system whose inertia is (1e12, 1, 1)."""
    system = paper_system(variant)
    return replace(system, body=Body(41.0, np.diag([1e12, 1.0, 1.0]), system.body.contact_point))


@pytest.mark.parametrize("variant", ["free", "permanent", "visco-elastic", "embedded"])
def test_terms_that_cancel_do_not_violate_the_derivative(variant):
    system = stretched(variant)
    states = states_of(system)
    assert max(error_in_doubles(system, y) for y in states) > 1e-9
    found = check(evidence(system, states), "derivative")
    assert found.verdict is CONSISTENT
    assert found.value <= found.bound == 1e-9


@dataclass(frozen=True, eq=False)
class SlightlyWrong(RotationalStabilizer):
    """A stabilizer that reports a little more than it dissipates."""

    excess: float

    def dissipated(self, motion, own):
        return (1.0 + self.excess) * super().dissipated(motion, own)


def with_wrong_stabilizer(system, excess=1e-6):
    gravity, holding, turning, *rest = system.elements
    wrong = SlightlyWrong(turning.K_r, turning.L_r, excess)
    return replace(system, elements=(gravity, holding, wrong, *rest))


def test_a_millionth_is_violated_among_terms_that_cancel():
    system = with_wrong_stabilizer(stretched("free"))
    found = check(evidence(system, states_of(system)), "derivative")
    assert found.verdict is VIOLATED
    assert found.bound < found.value < 1e-6


@pytest.mark.parametrize("excess", [1e-6, -1e-6])
def test_a_millionth_is_violated_where_nothing_cancels(excess):
    system = with_wrong_stabilizer(system_of("embedded"), excess)
    assert check(evidence(system, states_of(system)), "derivative").verdict is VIOLATED


def test_the_worst_violated_sample_is_named():
    system = with_wrong_stabilizer(system_of("free"))
    run = evidence(system, states_of(system))
    errors = [error_in_doubles(system, y) for y in run.states]
    found = check(run, "derivative")
    assert found.time == run.times[int(np.argmax(errors))]
    assert found.value == pytest.approx(max(errors), rel=1e-6)


def test_a_body_that_nothing_damps_is_consistent():
    """∇v·f is zero, and in double precision it is round-off of the couple -Ω × JΩ."""
    system = bare_system(Body(2.0, np.diag([1.0, 2.0, 2.5]), np.array([0.3, 0.1, 0.2])))
    states = states_of(system)
    assert max(error_in_doubles(system, y) for y in states) > 0.1
    found = check(evidence(system, states), "derivative")
    assert found.verdict is CONSISTENT
    # The damping matrices of this system are zero, so v need not converge.
    assert check(evidence(system, states), "damping").verdict is VIOLATED


def test_a_body_at_rest_is_consistent(monkeypatch):
    monkeypatch.setattr(certificate, "in_balls", refuse)
    system = system_of("free")
    y = system.start(nearest_rest_state(system).motion, np.zeros(0))
    run = evidence(system, [y, y])
    assert {line.verdict for line in checks_of(run)} == {CONSISTENT}
    assert check(run, "derivative").value == 0.0


@pytest.mark.parametrize(("size", "verdict"), [(1e-11, CONSISTENT), (1e-3, VIOLATED)])
def test_the_powers_of_a_motion_that_has_come_to_rest_are_not_judged(size, verdict):
    """Its displacements and velocities are round-off, and its powers are squares of these."""
    system = paper_system("free")
    states = states_of(system)
    run = evidence(system, [*states, size * states[0]])
    rate = np.append(run.rate[:-1], 2.0 * run.rate[-1])
    assert abs(rate[-1]) > 0.0
    assert check(replace(run, rate=rate), "derivative").verdict is verdict


@pytest.mark.parametrize(("size", "verdict"), [(1e-15, CONSISTENT), (1e-12, VIOLATED)])
def test_a_run_that_is_at_rest_from_its_start_is_not_judged(size, verdict):
    system = paper_system("free")
    states = [size * y for y in states_of(system)]
    run = replace(evidence(system, states), scale=1e3)
    assert check(replace(run, rate=2.0 * run.rate), "derivative").verdict is verdict


def refuse(_):
    raise AssertionError("exact arithmetic was used")


def test_a_consistent_derivative_names_its_worst_sample():
    """The stabilizer reports 5e-10 more than it dissipates, which is less than the tolerance."""
    system = with_wrong_stabilizer(system_of("free"), 5e-10)
    run = evidence(system, states_of(system))
    errors = [error_in_doubles(system, y) for y in run.states]
    assert 1e-11 < min(errors) < 0.9 * max(errors) < 1e-9
    found = check(run, "derivative")
    assert found.verdict is CONSISTENT
    # The round-off of the largest power, 2e-7 of it at this tolerance, is added to each power.
    assert found.value == pytest.approx(max(errors), rel=1e-5)
    assert found.time == run.times[int(np.argmax(errors))]


@pytest.mark.parametrize("has_potential", [True, False])
def test_a_positive_v_is_named_where_it_is_least(has_potential):
    system = system_of("free")
    run = replace(evidence(system, states_of(system)), scale=4.0, has_potential=has_potential)
    found = check(run, "positive")
    assert found.verdict is CONSISTENT
    assert found.value == run.value.min() / 4.0
    assert found.time == run.times[int(run.value.argmin())]
    assert found.bound == (pytest.approx(-1e-12, rel=0.9) if has_potential else -np.inf)


def turned(values):
    Q, _ = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))
    matrix = Q @ np.diag(values) @ Q.T
    return 0.5 * (matrix + matrix.T), Q


def lost_digits():
    """Return a system and states whose v' is a small difference of large terms."""
    L_r, Q = turned([1e13, 1e6, 1.0])
    body = Body(41.0, np.diag([10.0, 8.0, 4.0]), np.array([0.15, 0.1, -0.42]))
    system = bare_system(body, K_t=K_T, L_t=DAMPING, K_r=K_R, L_r=L_r)
    soft = [np.concatenate([np.zeros(3), k * Q[:, 2], np.zeros(6)]) for k in (1.0, 0.7, 0.3)]
    return system, [state_of(system, Z) for Z in soft]


def test_a_rate_that_has_lost_its_digits_is_unknown():
    found = check(evidence(*lost_digits()), "derivative")
    assert found.verdict is UNKNOWN
    assert found.value > found.bound


@pytest.mark.parametrize(("error", "verdict"), [(1e-10, UNKNOWN), (1e-8, VIOLATED)])
def test_lost_digits_do_not_excuse_a_stored_rate_of_another_state(error, verdict):
    system, states = lost_digits()
    run = evidence(system, [1e3 * y for y in states])
    dissipated = np.abs(run.dissipation).sum(axis=1)
    wrong = replace(run, rate=run.rate + error * dissipated)
    assert check(wrong, "derivative").verdict is verdict


def test_a_stored_rate_of_another_state_is_violated():
    system = system_of("free")
    run = evidence(system, states_of(system))
    assert check(run, "derivative").verdict is CONSISTENT
    wrong = replace(run, rate=run.rate * (1.0 + 1e-6))
    assert check(wrong, "derivative").verdict is VIOLATED


def test_states_that_are_no_numbers_are_unknown():
    system = system_of("free")
    run = evidence(system, states_of(system))
    states = run.states.copy()
    states[2, 0] = np.nan
    with np.errstate(all="ignore"):
        assert check(replace(run, states=states), "derivative").verdict is UNKNOWN


class NoBalls(ViscoElasticConnector):
    """A connector that works only with numbers of numpy.

    `np.real` alone does not tell: since numpy 2.5 it takes the real parts of balls too.
    """

    def dissipated(self, motion, own):
        if motion.F.dtype == object:
            raise TypeError("only numbers of numpy")
        return float(np.real(motion.F) @ self.L_c @ np.real(motion.F)) * (1.0 + 1e-6)


def test_an_element_that_accepts_only_floats_is_not_decided():
    system = paper_system("visco-elastic")
    elements = (*system.elements[:-1], NoBalls(K_C, DAMPING))
    system = replace(system, elements=elements)
    assert check(evidence(system, states_of(system)), "derivative").verdict is UNKNOWN


def settled(**changes):
    """Return the evidence of a heavy body close to its rest state."""
    system = paper_system("free", weight=HEAVY)
    rest = nearest_rest_state(system)
    y = system.start(rest.motion, np.zeros(0))
    start = y + 1e-3 * np.eye(12)[9]
    return evidence(system, [start, y], **changes)


def test_round_off_of_the_energies_is_allowed_below_rest():
    run = settled()
    terms = np.abs(run.energy[1]).sum()
    value = np.array([run.value[0], -8 * np.finfo(float).eps * terms])
    assert value[1] < -1e-12 * run.scale
    assert check(replace(run, value=value), "positive").verdict is CONSISTENT


def test_a_value_below_rest_that_the_state_does_not_have_is_unknown():
    run = settled()
    value = np.array([run.value[0], -1e-6 * run.scale])
    found = check(replace(run, value=value), "positive")
    assert found.verdict is UNKNOWN
    assert found.value == pytest.approx(-1e-6)
    assert found.time == run.times[1]


@pytest.mark.parametrize("scale", [1e-4, 1.0, 1e4])
@pytest.mark.parametrize(("depth", "verdict"), [(2e-12, VIOLATED), (0.5e-12, UNKNOWN)])
def test_a_state_below_rest_is_violated(depth, verdict, scale):
    """The energy at rest is too high by a part of the scale; the stored v shows 1e-6 of it."""
    run = settled(scale=scale)
    value = np.array([run.value[0], -1e-6 * run.scale])
    exact = run.exact_rest_energy()
    wrong = replace(run, value=value, exact_rest_energy=lambda: exact + ball(depth * run.scale))
    assert check(wrong, "positive").verdict is verdict


@pytest.mark.parametrize("deepest", [0, 1])
def test_the_deepest_sample_is_named(deepest):
    run = settled()
    value = np.full(2, -1e-6 * run.scale)
    value[deepest] *= 2.0
    found = check(replace(run, value=value), "positive")
    assert found.time == run.times[deepest]
    assert found.value == pytest.approx(-2e-6)


def test_without_a_rest_state_the_sign_of_v_is_unknown():
    run = settled()
    unfound = replace(run, rest=replace(run.rest, gradient=1.0))
    assert check(run, "positive").verdict is CONSISTENT
    assert check(unfound, "positive").verdict is UNKNOWN
    assert check(replace(unfound, has_potential=False), "positive").verdict is CONSISTENT


def test_a_rest_state_that_is_not_accurate_violates_nothing():
    run = settled()
    value = np.array([run.value[0], -1e-6 * run.scale])
    exact = run.exact_rest_energy()
    below = replace(run, value=value, exact_rest_energy=lambda: exact + ball(1e-3 * run.scale))
    rough = replace(run.rest, gradient=1e-8, load=1e-3)
    assert rough.found
    assert check(below, "positive").verdict is VIOLATED
    assert check(replace(below, rest=rough), "positive").verdict is UNKNOWN


def test_the_audit_allows_the_round_off_of_the_energies():
    run = settled(audit_bound=1e-16)
    rounding = 16 * np.finfo(float).eps * 2 * np.abs(run.energy).sum(axis=1).max()
    for share, verdict in ((0.3, CONSISTENT), (2.0, VIOLATED)):
        residual = np.array([0.0, share * rounding])
        assert check(replace(run, residual=residual), "audit").verdict is verdict


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_round_off_of_v_is_that_of_its_parts_and_of_the_energy_at_rest(sign):
    energy = sign * np.array([[3e6, -1e6], [3.0, -1.0]])
    run = settled(audit_bound=1e-16, energy=energy, value=np.array([0.5, 0.5]), scale=2.0)
    expected = 16 * np.finfo(float).eps * (4e6 + abs(sign * 2e6 - 0.5)) / 2.0
    assert check(run, "audit").bound == pytest.approx(expected, rel=1e-12)
    assert check(run, "positive").bound == pytest.approx(-expected, rel=1e-12)


def test_the_audit_bound_is_that_of_the_tolerance():
    run = settled()
    for share, verdict in ((0.99, CONSISTENT), (1.01, VIOLATED)):
        residual = np.array([0.0, -share * 1e-8 * run.scale])
        found = check(replace(run, residual=residual), "audit")
        assert found.verdict is verdict
        assert found.value == pytest.approx(share * 1e-8, rel=1e-12)
        assert (found.bound, found.time) == (1e-8, 1.0)


def test_no_run_is_more_accurate_than_its_numbers():
    assert audit_bound(1e-16) == audit_bound(2.0**-52) == 1e4 * 2.0**-52


RISES = {
    "within the residual": (0.9e-8, 0.5e-8, CONSISTENT),
    "above the residual": (1.1e-8, 0.5e-8, VIOLATED),
    "within a residual that is too large": (1e-3, 1e-3, UNKNOWN),
    "above a residual that is too large": (3e-3, 1e-3, VIOLATED),
    "allowed by the tolerance, and a residual that is too large": (1.9e-8, 1e-3, CONSISTENT),
    "not allowed by the tolerance": (2.1e-8, 1e-3, UNKNOWN),
    "none, and a residual that is too large": (-1e-3, 1e-3, CONSISTENT),
}


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("case", RISES)
def test_a_rise_is_compared_with_the_residual(case, sign):
    rise, residual, verdict = RISES[case]
    run = settled()
    value = run.value[0] + np.array([0.0, rise * run.scale])
    changed = replace(run, value=value, residual=np.array([0.0, sign * residual * run.scale]))
    found = check(changed, "decrease")
    assert found.verdict is verdict
    assert found.value == pytest.approx(max(rise, 0.0), rel=1e-6)
    assert np.isnan(found.time) if rise < 0 else found.time == 0.0


@pytest.mark.parametrize("values", [[0.0, 3e5, 1e6], [2e6, 1.5e6, 1e6]])
def test_the_bound_of_a_rise_grows_with_v(values):
    """v far from its start is rounded more coarsely than 1e-12 of the scale."""
    run = settled()
    value = np.array(values) * run.scale
    nothing = {"residual": np.zeros(3), "energy": np.zeros((3, 2)), "times": np.arange(3.0)}
    bound = certificate._monotone(replace(run, value=value, **nothing)).bound
    assert bound == pytest.approx(16 * np.finfo(float).eps * 1e6, rel=1e-6)


def adding(*, exact, stored):
    """Return evidence whose first element dissipates `stored` at one sample, as its run stored it.

    The state gives `exact`.
    """
    system = paper_system("visco-elastic")
    y = state_of(system, np.concatenate([np.zeros(9), [exact, 0.0, 0.0]]))
    run = evidence(system, [2.0 * y, y])
    dissipation = run.dissipation.copy()
    dissipation[1, system.parts.index("connector")] = stored
    return replace(run, dissipation=dissipation)


def test_a_dissipation_that_only_round_off_makes_negative_is_unknown():
    found = check(adding(exact=1e-2, stored=-1.0), "damping")
    assert found.verdict is UNKNOWN
    assert (found.value, found.bound, found.time) == (-1.0, 0.0, 1.0)
    assert "connector" in found.quantity


class Pump(ViscoElasticConnector):
    """A connector that adds energy and declares no damping."""

    gains = ()


class PumpWithoutBalls(Pump):
    """A pump that works only with numbers of numpy."""

    def dissipated(self, motion, own):
        if motion.F.dtype == object:
            raise TypeError("not a number of numpy")
        return super().dissipated(motion, own)


@pytest.mark.parametrize(("kind", "verdict"), [(Pump, VIOLATED), (PumpWithoutBalls, UNKNOWN)])
def test_a_part_that_adds_a_little_energy_is_violated(kind, verdict):
    system = paper_system("visco-elastic")
    system = replace(system, elements=(*system.elements[:-1], kind(K_C, -1e-3 * np.eye(3))))
    fast, slow = ([*np.zeros(9), speed, 0.0, 0.0] for speed in (1.0, 0.5))
    run = evidence(system, [state_of(system, np.array(Z)) for Z in (fast, slow)])
    found = check(run, "damping")
    assert found.verdict is verdict
    assert found.value == pytest.approx(-1e-3, rel=1e-5)
    assert found.time == run.times[int(run.dissipation[:, -1].argmin())]


def test_dissipations_that_are_no_numbers_count_as_none():
    run = adding(exact=1.0, stored=1.0)
    dissipation = 1e-6 * run.dissipation
    dissipation[0] = np.nan
    assert check(replace(run, dissipation=dissipation), "damping").verdict is CONSISTENT
    # The bound is relative to the largest number that is left: 42e-6 W by the stabilizer.
    dissipation[1, -1] = -1e-15
    assert check(replace(run, dissipation=dissipation), "damping").verdict is UNKNOWN


def test_a_negative_dissipation_within_round_off_is_allowed():
    assert check(adding(exact=1.0, stored=-1e-11), "damping").verdict is CONSISTENT


def test_a_small_damping_is_damping():
    system = paper_system("free")
    gravity, holding, turning = system.elements
    weak = replace(turning, L_r=1e-9 * np.eye(3))
    run = evidence(replace(system, elements=(gravity, holding, weak)), states_of(system))
    assert check(run, "damping").verdict is CONSISTENT
    assert check(run, "damping").value == pytest.approx(1e-9)


@pytest.mark.parametrize(("defect", "verdict"), [(0.0, VIOLATED), (2.0**-50, UNKNOWN)])
def test_the_sign_of_an_eigenvalue_is_decided_exactly(monkeypatch, defect, verdict):
    L = np.array([[1.0, 1.0, 0.0], [1.0, 1.0 + defect, 0.0], [0.0, 0.0, 1.0]])
    system = paper_system("free")
    gravity, holding, turning = system.elements
    system = replace(system, elements=(gravity, holding, replace(turning, L_r=L)))
    run = evidence(system, states_of(system))
    monkeypatch.setattr(np.linalg, "eigvalsh", lambda _: np.array([-1e-20, 1.0, 2.0]))
    found = check(run, "damping")
    assert found.verdict is verdict
    assert (found.value, found.bound) == (-1e-20, 0.0)


def test_a_run_is_no_better_than_its_worst_check():
    line = check(settled(), "audit")
    of = {verdict: line._replace(verdict=verdict) for verdict in (CONSISTENT, UNKNOWN, VIOLATED)}
    assert overall([of[CONSISTENT], of[UNKNOWN]]) is UNKNOWN
    assert overall([of[UNKNOWN], of[VIOLATED], of[CONSISTENT]]) is VIOLATED
    assert overall([of[CONSISTENT], of[CONSISTENT]]) is CONSISTENT


@pytest.mark.parametrize(("samples", "expected"), [(5, 5), (51, 51), (52, 51), (120, 51)])
def test_the_derivative_is_evaluated_at_51_samples(monkeypatch, samples, expected):
    """They are spread evenly from the first to the last one."""
    rows = []

    def record(_, row):
        rows.append(int(row))
        return 0.0, 1.0

    monkeypatch.setattr(certificate, "_rate_error", record)
    run = replace(settled(), times=np.arange(float(samples)))
    certificate._rate(run)
    assert (len(rows), rows[0], rows[-1]) == (expected, 0, samples - 1)
    assert set(np.diff(rows)) <= {samples // expected, -(-samples // expected)}


def on_a_slope(system):
    """Return a system with a sliding connector on s = F + 20E, whose force has no potential."""
    mode = np.array([1.0, -1.0, 1.0])
    connector = SlidingConnector(np.full(3, 500.0), 1.0, 20.0, mode, np.zeros(3), 1.0)
    return replace(system, elements=(*system.elements, connector))


@pytest.mark.parametrize("variant", ["free", "permanent", "visco-elastic", "embedded", "slope"])
def test_an_ordinary_run_needs_no_exact_arithmetic(monkeypatch, variant):
    monkeypatch.setattr(certificate, "in_balls", refuse)
    slope = variant == "slope"
    system = on_a_slope(system_of("free")) if slope else system_of(variant)
    run = evidence(system, states_of(system), has_potential=not slope)
    assert {line.verdict for line in checks_of(run)} == {CONSISTENT}


@pytest.mark.parametrize("slope", [False, True])
def test_the_power_of_the_contact_force_counts_only_without_a_potential(slope):
    """The exact comparison, too, adds F'Λ to ∇v·f if and only if v - ε replaces v."""
    system = stretched("free")
    if slope:
        system = on_a_slope(system)
    states = states_of(system)
    assert check(evidence(system, states, has_potential=not slope), "derivative").verdict is (
        CONSISTENT
    )
    if slope:
        assert check(evidence(system, states), "derivative").verdict is VIOLATED
