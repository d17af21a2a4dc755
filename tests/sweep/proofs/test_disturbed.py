"""Protects which members a proved bound is about, and that it is proved once for each body."""

from fractions import Fraction

import numpy as np
import pytest
from support.disturbed import COUPLE, Held, full_config, tied_config
from support.gusts import GUST, plan_of, tilts_of
from support.inputs import SINE

import rbstab
from rbstab.analysis.configuration import configurations
from rbstab.config.build import problem_of
from rbstab.experiment.disturbed import stored
from rbstab.experiment.disturbed.bound import Bound
from rbstab.experiment.disturbed.prove_bound import prove_bound
from rbstab.experiment.simulate import simulate
from rbstab.proof.disturbed.invariant import Claim
from rbstab.sweep.members.ensemble import ensemble_engine
from rbstab.sweep.plan.load import load_plan
from rbstab.sweep.proofs.bodies import values_at_start
from rbstab.sweep.proofs.disturbed import (
    ELSEWHERE,
    LARGER,
    NO_PROOF,
    NOT_DECIDED,
    OTHER,
    PROVED,
    keep_bounds,
    member_bounds,
    starts_within,
)

CROSS, LEVEL, TILT = Fraction(7, 2), Fraction(40), Fraction(1, 5)

CLAIM = Claim(TILT, (Fraction(1),), (Fraction(1),), CROSS, Fraction(1), LEVEL)
"""Made up: only its tilt, ε and level say where it holds."""

BOUND = Bound((COUPLE,), (Fraction(1),), TILT, claim=CLAIM)


def starts(config, spread, members=400):
    """Return a plan of random starts of a config, and which are within the bound."""
    vary = {
        f"initial.{name}[{k}]": {"normal": [centre[k], size]}
        for name, (size, centre) in spread.items()
        for k in range(3)
    }
    plan = load_plan(
        {"base": config.plain(), "vary": vary, "design": "random", "members": members, "seed": 3}
    )
    keys, values = values_at_start(plan, np.arange(members))
    return plan, starts_within(next(iter(plan.bases.values())), keys, values, BOUND)


def check(V, tilts, inside):
    """Compare with V and tilts; nothing lies so near a border that round-off could decide."""
    assert inside.tolist() == ((float(LEVEL) > V) & (tilts < 0.2)).tolist()
    assert 0.05 < inside.mean() < 0.9
    # Each of both conditions decides some.
    assert ((float(LEVEL) > V) & (tilts > 0.2)).any()
    assert ((float(LEVEL) < V) & (tilts < 0.2)).any()


def test_the_starts_of_a_held_body_are_those_below_the_level():
    """By the equations of the held body."""
    config = tied_config("permanent")
    spread = {"orientation": (0.2, np.zeros(3)), "angular_velocity": (1.5, np.zeros(3))}
    plan, inside = starts(config, spread)
    Theta, Omega = (
        np.array([plan.values(0, 400)[f"initial.{name}[{k}]"] for k in range(3)])
        for name in ("orientation", "angular_velocity")
    )
    check(Held(config).value(Theta, Omega, float(CROSS)), tilts_of(Theta.T), inside)


@pytest.mark.slow
def test_the_starts_of_a_tied_body_are_those_below_the_level():
    """By V = T + Π - Π* + ε (B⁻¹Θ, X - X*)'∂T/∂ν, in doubles."""
    config = full_config()
    data = config.plain() | {"initial": {"position": [0.0] * 3}}
    config = rbstab.load_config(data)
    system = problem_of(config).system
    at_rest = configurations(system)
    rest = rest_of(at_rest)
    X = rest[6:9]
    spread = {
        "orientation": (0.2, np.zeros(3)),
        "angular_velocity": (0.8, np.zeros(3)),
        "position": (0.02, X),
        "velocity": (0.2, np.zeros(3)),
    }
    plan, inside = starts(config, spread)
    V, Theta = [], []
    for member in range(400):
        state = problem_of(plan.config_of(member)).start
        motion = system.motion(state)
        body = system.body
        momentum = [*(body.inertia @ motion.Omega), *(body.mass * motion.V)]
        p = [*np.linalg.solve(motion.B, motion.Theta), *(motion.X - X)]
        energy = sum(system.observe(state).energy.tolist())
        rest_energy = sum(system.observe(rest).energy.tolist())
        V.append(energy - rest_energy + float(CROSS) * (np.array(p) @ momentum))
        Theta.append(motion.Theta)
    check(np.array(V), tilts_of(Theta), inside)


def rest_of(at_rest):
    """Return the state at rest at Θ = 0, by Newton's steps with differences."""
    system, y = at_rest.system, np.zeros(at_rest.system.size)
    free = [*range(6, 9), *range(12, system.size)]

    def energy(x):
        z = y.copy()
        z[free] = x
        return sum(system.observe(z).energy.tolist())

    x, h, E = np.zeros(len(free)), 1e-3, np.eye(len(free))
    slope = np.array([(energy(x + h * e) - energy(x - h * e)) / (2 * h) for e in E])
    rows = [
        [(energy(x + h * (a + b)) - energy(x + h * (a - b)) - energy(x - h * (a - b))
          + energy(x - h * (a + b))) / (4 * h * h) for b in E]
        for a in E
    ]  # fmt: skip
    y[free] = -np.linalg.solve(rows, slope)
    return y


VARY = {
    "body.mass": {"values": [12.0, 12.5]},
    "elements.gust0.amplitude": {"values": [5.0, 19.999, 20.0, 20.001, 60.0]},
    "initial.orientation[2]": {"values": [0.0, 0.7]},
}
"""Two bodies; at their axis gusts of 0.5 Hz tilt them most."""


@pytest.fixture(scope="module")
def swept(tmp_path_factory):
    """A plan, a folder with its bounds, how many were proved, and the peaks of its members."""
    folder, plan = tmp_path_factory.mktemp("results"), plan_of(VARY)
    made = []

    def counted(*given):
        made.append(given)
        return prove_bound(*given)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(stored, "prove_bound", counted)
        keep_bounds(plan, folder, unlimited=True)
        keep_bounds(plan, folder, unlimited=True)
    peaks = ensemble_engine(plan).compute(0, plan.members).outcome["peak_tilt"]
    return plan, folder, len(made), peaks


@pytest.mark.heavy
def test_members_with_loads_and_starts_that_are_bounded_never_leave(swept):
    plan, folder, made, peaks = swept
    assert made == 2
    found = member_bounds(plan, folder)
    assert found is not None
    assert [bound is not None and bound.proved for bound, _ in found.bodies] == [True, True]
    assert sorted(members.tolist() for _, members in found.bodies) == [
        list(range(10)),
        list(range(10, 20)),
    ]
    values = plan.values(0, plan.members)
    small = values["elements.gust0.amplitude"] <= 20.0
    upright = values["initial.orientation[2]"] == 0.0
    expected = np.select([~upright, ~small], [ELSEWHERE, LARGER], PROVED)
    assert found.codes.tolist() == expected.tolist()
    assert (peaks[found.codes == PROVED] < 0.5).all()
    # The bound says something: others leave.
    assert (peaks[found.codes == LARGER] > 0.5).any()
    assert (peaks[found.codes == ELSEWHERE] > 0.5).all()


@pytest.mark.heavy
def test_a_peak_is_that_of_a_dense_single_run(swept):
    plan, _, _, peaks = swept
    for member in (8, 13):
        data = plan.config_of(member).plain()
        data["integration"] |= {"samples": 6001, "engine": "scipy"}
        run = simulate(rbstab.load_config(data))
        assert peaks[member] == pytest.approx(tilts_of(run["orientation"]).max(), abs=1e-6)


@pytest.mark.heavy
def test_without_a_proof_nothing_follows(swept, tmp_path):
    plan, folder, *_ = swept
    missing = member_bounds(plan, tmp_path)
    assert missing is not None
    assert set(missing.codes.tolist()) == {NO_PROOF}
    # A force at some point is another load, of which the bound says nothing.
    push = GUST | {"quantity": "force", "point": [0, 0, 0], "signal": SINE, "amplitude": 0.1}
    pushed = plan_of({"elements.gust1.amplitude": {"values": [0.0, 0.1]}}, GUST, push)
    keep_bounds(pushed, folder)
    found = member_bounds(pushed, folder)
    assert found is not None
    assert found.codes.tolist() == [PROVED, OTHER]
    assert member_bounds(plan_of(VARY, sections={"bound": None}), folder) is None


@pytest.mark.slow
def test_a_bound_that_is_too_large_is_not_decided(tmp_path):
    plan = plan_of(
        {"elements.gust0.amplitude": {"values": [1.0, 2.0]}},
        sections={"bound": {"couple": 60.0, "tilt": 0.5}},
    )
    keep_bounds(plan, tmp_path)
    found = member_bounds(plan, tmp_path)
    assert found is not None
    assert found.codes.tolist() == [NOT_DECIDED] * 2
    ((bound, _),) = found.bodies
    assert bound is not None
    assert bound.why


def test_members_that_differ_in_their_starts_and_inputs_are_one_body(tmp_path):
    inputs = {key: VARY[key] for key in list(VARY)[1:]}
    assert len(bodies_of(plan_of(inputs), tmp_path)) == 1
    # A force that never changes is part of the body, like its weight.
    steady = GUST | {"quantity": "force", "point": [0, 0, 0], "signal": {"kind": "constant"}}
    plan = plan_of({"elements.gust0.amplitude": {"values": [1.0, 2.0]}}, steady)
    assert len(bodies_of(plan, tmp_path)) == 2


def bodies_of(plan, folder):
    found = member_bounds(plan, folder)
    assert found is not None
    return found.bodies
