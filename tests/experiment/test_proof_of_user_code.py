"""Protects proofs of held bodies with elements of users, against elements of ours and searches.

Minima are looked for by scipy with the energy that the code of the element computes in doubles.
"""

import json
from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize
from support.user_code import SPRING, TIE, element_text, mine

from rbstab.analysis.configuration import configurations
from rbstab.config.build import problem_of
from rbstab.config.load import config_to_read, load_config, plain_data
from rbstab.experiment.convergence.exact_motion import convergence_at_start, prove_convergence
from rbstab.experiment.proof import CODE_NOT_RUN, prove
from rbstab.experiment.simulate import simulate
from rbstab.experiment.stored_proof.identity import proof_id
from rbstab.experiment.stored_proof.proof import SUPPLIES, Proof
from rbstab.experiment.stored_proof.starts import start_state
from rbstab.experiment.verification.verify import verify
from rbstab.proof.reasons import NoEnergyReason

TIED = {
    "point": [0.1, 0.2, -0.1],
    "anchor": [0.0, 0.3, 0.1],
    "K_c": [[30, 2, 0], [2, 20, 1], [0, 1, 10]],
    "L_c": [1, 2, 3],
}

WELL = element_text(
    """
    def wrench(self, motion, own):
        e = position(motion, self.point) - self.anchor
        pull = 2 * self.depth / (self.width * self.width) * self._near(e)
        return force_at(motion, self.point, -pull * e)

    def stored(self, motion, own):
        e = position(motion, self.point) - self.anchor
        return -self.depth * self._near(e)

    def _near(self, e):
        return exp(-(e @ e) / (self.width * self.width))
    """,
    'POINT, ANCHOR, Gain("depth", "J", "d", shape="number"), '
    'Gain("width", "m", "w", shape="number")',
)
"""A magnet that pulls a point into a well of the form of a bell."""

SIDE = {"point": [0.0, 0.0, 0.5], "anchor": [0.35, 0.0, 0.3], "depth": 4.0, "width": 0.15}
"""A deep and narrow one aside: the body has rest states in it and outside of it."""

TIP = element_text(
    """
    def wrench(self, motion, own):
        up = motion.A[2]
        push = self.k * self.b * exp(self.b * up[2])
        return couple_on_body(push * np.array([up[1], -up[0], 0.0 * up[2]]))

    def stored(self, motion, own):
        return self.k * exp(self.b * motion.A[2][2])
    """,
    'Gain("k", "J", "energy", shape="number"), Gain("b", "1", "sharpness", shape="number")',
)
"""It pushes the body away from upright: k exp(b cos θ1 cos θ2). So upright is a saddle or worse."""

SPEED = [0.4, -0.3, 0.2]


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "tie.py").write_text(TIE)
    (tmp_path / "well.py").write_text(WELL)
    (tmp_path / "tip.py").write_text(TIP)
    return tmp_path


def held(elements, **changes):
    """Return plain data of a held body."""
    return {
        "schema_version": 2,
        "body": {"mass": 2, "inertia": [1, 1.5, 2], "contact_point": [0.1, -0.1, -0.3]},
        "controller": {
            "variant": "permanent",
            "K_t": [40, 40, 30],
            "L_t": [2, 2, 1],
            "K_r": [4, 4, 3],
            "L_r": [0.6, 0.6, 0.4],
        },
        "elements": elements,
        "initial": {"angular_velocity": SPEED},
        "integration": {"duration": 5.0, "samples": 51},
    } | changes


def from_file(name, parameters):
    return mine(**parameters) | {"file": f"{name}.py"}


def load(elements, **changes):
    return load_config(held(elements, **changes), allow_python=True)


def minima(config):
    """Return the minima that scipy finds from many starts, lowest energy first."""
    at_rest = configurations(problem_of(config).system)
    found: list[Any] = []
    for start in np.random.default_rng(4).uniform(-1.4, 1.4, (60, 3)):
        one = minimize(at_rest.energy, start, jac=at_rest.gradient, tol=1e-12)
        inside = np.all(np.abs(one.x) < [np.pi, np.pi / 2, np.pi])
        if inside and not any(np.abs(one.x - other.x).max() < 1e-4 for other in found):
            found.append(one)
    return sorted(found, key=lambda one: one.fun)


@cache
def _proved(name):
    return prove(_config(name))


def _config(name, **changes):
    return load({"one": from_file(*KINDS[name])}, **changes)


KINDS = {
    "aside": ("well", SIDE),
    "wide": ("well", SIDE | {"width": 0.5}),
    "shallow": ("well", SIDE | {"depth": 0.5}),
    "one valley": ("tip", {"k": 0.1, "b": 1.0}),
    "two valleys": ("tip", {"k": 0.5, "b": 2.0}),
    "three valleys": ("tip", {"k": 1.5, "b": 2.0}),
}

VALLEYS = {
    "aside": 2,
    "wide": 1,
    "shallow": 1,
    "one valley": 1,
    "two valleys": 2,
    "three valleys": 3,
}


def test_a_polynomial_energy_has_the_proof_of_our_own_element():
    theirs = prove(load({"one": from_file("tie", TIED)}))
    ours = prove(load({"one": {"kind": "visco-elastic"} | TIED}))
    assert theirs.proved
    assert theirs.id != ours.id
    same = {"id", "seconds"}
    assert theirs.model_dump(exclude=same) == ours.model_dump(exclude=same)


@pytest.mark.parametrize("name", KINDS)
def test_all_minima_are_those_that_a_search_finds(name):
    config, proof = _config(name), _proved(name)
    assert proof.proved
    assert "exp" in {kind for kind, *_ in proof.reduced_energy.operations}
    listed = [state for state in proof.states if state.index == 0]
    expected = minima(config)
    assert len(listed) == len(expected) == VALLEYS[name]
    for state, one in zip(listed, expected, strict=True):
        np.testing.assert_allclose(state.orientation, one.x, atol=2e-6)
        assert state.energy == pytest.approx(one.fun, abs=1e-9)
        low, high = np.array(state.enclosure)
        assert np.all(low <= state.orientation)
        assert np.all(state.orientation <= high)


def test_a_region_ends_at_its_pass():
    """Each valley ends at a saddle, which is nowhere higher than a straight way between minima."""
    config, proof = _config("two valleys"), _proved("two valleys")
    at_rest = configurations(problem_of(config).system)
    (saddle,) = [state for state in proof.states if state.index == 1]
    assert np.abs(at_rest.gradient(np.array(saddle.orientation))).max() < 1e-9
    first, second = (state for state in proof.states if state.index == 0)
    shares = np.linspace(0, 1, 401)[:, np.newaxis]
    straight = np.array(first.orientation) * (1 - shares) + shares * np.array(second.orientation)
    top = max(at_rest.energy(q) for q in straight)
    assert second.energy < saddle.energy <= top + 1e-12
    assert len(proof.regions) == 2
    for region in proof.regions:
        assert region.energy_bound == pytest.approx(saddle.energy, abs=1e-8)
        assert region.energy_bound <= saddle.energy


def test_starts_in_regions_converge_to_the_state_that_runs_reach():
    proof = _proved("two valleys")
    for sign, expected in ((1, 1), (-1, 2)):
        start = (sign * np.array([0.2, -0.2, -0.12])).tolist()
        config = _config("two valleys", initial={"orientation": start}, **LONG)
        problem = problem_of(config)
        assert start_state(problem, proof) == expected
        found = convergence_at_start(config, problem, proof)
        assert (found.proved, found.rest_state) == (True, expected)
        end = np.asarray(simulate(config)["orientation"])[-1]
        rest = np.array(proof.states[expected - 1].orientation)
        assert np.abs(end - rest).max() < 0.02
    outside = _config("two valleys", initial={"angular_velocity": [3.0, 0.0, 0.0]})
    assert start_state(problem_of(outside), proof) is None
    assert convergence_at_start(outside, problem_of(outside), proof).proved is None


LONG = {"integration": {"duration": 20.0, "samples": 51}}


def test_a_proof_says_what_it_is_of(folder):
    config, proof = _config("one valley"), _proved("one valley")
    assert proof.id == proof_id(config)
    stored = Proof.model_validate_json(proof.model_dump_json())
    assert stored == proof
    found = verify(stored, config)
    assert found.verified, [one.text for one in found.findings if not one.verified]
    other = load({"one": from_file("tip", {"k": 0.101, "b": 1.0})})
    assert [one.claim for one in verify(stored, other).findings if not one.verified] == [
        "id",
        "energy",
    ]
    # Another formula has another id, although its parameters are the same.
    (folder / "tip.py").write_text(TIP.replace("self.k * exp", "self.k + self.k * exp"))
    assert proof_id(_config("one valley")) != proof.id


def test_seven_rest_states_and_their_valleys_are_verified():
    proof = _proved("three valleys")
    assert len(proof.states) == 7
    found = verify(proof, _config("three valleys"))
    assert found.verified, [one.text for one in found.findings if not one.verified]


def test_a_formula_that_is_not_periodic_is_in_no_wider_range():
    """Not by the checker either: a bound on θ1 and θ3 needs a periodic energy."""
    data = json.loads(_proved("one valley").model_dump_json())
    operations = data["reduced_energy"]["operations"]
    last, n = operations.pop(), len(operations)
    # A term in θ1⁴, which is too small to move a rest state.
    operations += [["pow", 4, operations.index(["var", 0])], [*last, f"1/{10**30}", n]]
    found = verify(Proof.model_validate(data))
    assert [one.claim for one in found.findings if not one.verified] == ["ends"]


def test_without_permission_no_code_runs():
    config = _config("one valley")
    read = config_to_read(plain_data(config))
    proof = prove(read)
    assert (proof.states, proof.outcome) == ((), CODE_NOT_RUN)
    found = verify(_proved("one valley"), read)
    assert found.verified
    assert any(CODE_NOT_RUN in text for text in found.unchecked)


def test_what_is_not_in_proofs(folder):
    (folder / "mine.py").write_text(SPRING.replace("0.5 * self.k", "0.6 * self.k"))
    wrong = prove(load({"one": mine(k=3.0)}))
    assert wrong.outcome.startswith(NoEnergyReason.NOT_IN_PROOFS.value)
    assert "one: it is not shown that `wrench`" in wrong.outcome
    assert not any(state.proved for state in wrong.states)
    assert wrong.claims_nothing
    (folder / "mine.py").write_text(SPRING)
    pushed = {"kind": "input", "quantity": "couple", "direction": [1, 0, 0], "amplitude": 1}
    pushed["signal"] = {"kind": "constant"}
    assert prove(load({"one": mine(k=3.0), "push": pushed})).outcome == SUPPLIES


def test_elements_that_cannot_be_built_of_other_numbers(folder):
    """Nothing is raised: that no proof is made is an outcome with a reason."""
    for check in ("if not self.k > 0: raise ValueError('k')", "float(self.k)", "sqrt(self.k)"):
        text = f"{SPRING}\n    def __post_init__(self):\n        {check}\n"
        (folder / "mine.py").write_text(text.replace("import power", "import power, sqrt"))
        proof = prove(load({"one": mine(k=3.0)}))
        recorded = check.startswith("sqrt")
        assert proof.proved is recorded
        if not recorded:
            assert "one: its code cannot be recorded" in proof.outcome


def test_large_exponents_are_in_proofs(folder):
    text = TIP.replace("exp(self.b * motion.A[2][2])", "motion.A[2][2] ** 17")
    push = "17 * self.k * up[2] ** 16"
    (folder / "tip.py").write_text(text.replace("self.k * self.b * exp(self.b * up[2])", push))
    proof = prove(load({"one": from_file("tip", {"k": 0.1, "b": 1.0})}))
    assert proof.proved
    assert [state.index for state in proof.states] == [0]


def test_a_motion_outside_of_the_regions_is_enclosed_until_it_is_in_one():
    fast = {"orientation": [0.2, -0.2, -0.12], "angular_velocity": [3.5, -1.5, 1.0]}
    config = _config("one valley", initial=fast)
    proof, problem = _proved("one valley"), problem_of(config)
    assert convergence_at_start(config, problem, proof).proved is None
    found = prove_convergence(config, problem, proof).convergence
    assert (found.proved, found.rest_state) == (True, 1)
    assert found.time is not None
    assert found.time > 0


POLE = element_text(
    """
    def wrench(self, motion, own):
        p = 30.0 * (motion.Theta[1] - self.s)
        return couple_on_body(30.0 * self.k / (1 + p * p) * motion.B[1])

    def stored(self, motion, own):
        return self.k * atan(1 / (30.0 * (motion.Theta[1] - self.s)))
    """,
    'Gain("k", "J", "k", shape="number"), Gain("s", "rad", "s", shape="number")',
).replace("import power", "import atan, power")
"""Its wrench is smooth, but its energy jumps by kπ at θ2 = s."""


def test_an_energy_that_jumps_where_it_has_no_value(folder):
    """The start is beyond the jump, and goes to another rest state than the nearest."""
    (folder / "mine.py").write_text(POLE)
    start = {"orientation": [-0.94, 0.49, -0.257]}
    config = load({"one": mine(k=3.0, s=0.5)}, initial=start, gravity=[1.0, 3.0, -9.81])
    proof = prove(config)
    assert proof.claims_nothing
    assert "`stored`, `wrench` and `dissipated` have values" in proof.outcome
    assert convergence_at_start(config, problem_of(config), proof).proved is None


def test_elements_of_users_beside_ours():
    """A push, a guard of the range and a strut."""
    ends = {"point": [0.2, 0, 0.1], "anchor": [0.6, 0.2, 0.1]}
    strut = {"kind": "spring", "stiffness": 5.0, "rest_length": 0.2, "damping": 0.1} | ends
    elements = {
        "one": from_file(*KINDS["one valley"]),
        "strut": strut,
        "range": {"kind": "guard", "method": "barrier", "stiffness": 0.5},
    }
    config = load(elements)
    proof = prove(config)
    assert proof.proved
    expected = minima(config)
    listed = [state for state in proof.states if state.index == 0]
    assert len(listed) == len(expected)
    np.testing.assert_allclose(listed[0].orientation, expected[0].x, atol=2e-6)
    found = verify(proof, config)
    assert found.verified, [one.text for one in found.findings if not one.verified]


def test_a_formula_of_an_angle_itself_has_no_wider_range(folder):
    """It is not periodic, so its values at other turns are others."""
    text = element_text("""
        def wrench(self, motion, own):
            return couple_on_body(-self.k * np.array([tanh(motion.Theta[0]), 0.0, 0.0]) @ motion.B)

        def stored(self, motion, own):
            return self.k * log(cosh(motion.Theta[0]))
        """).replace("import power", "import cosh, log, power")
    (folder / "mine.py").write_text(text)
    proof = prove(load({"one": mine(k=3.0)}))
    assert proof.proved
    assert proof.unwrapped is None
    assert _proved("one valley").unwrapped is not None
