"""Protects what is said and stored of bodies with elements: sentences, ids, motions, coverage."""

from typing import Any

import numpy as np
import pytest
from support.config_elements import CONTROLLER, ONE_OF_EACH, STRUT, TIE, UPRIGHT, config_data
from support.robust import robust_levels
from support.user_code import CREEPING_TIE, element_text, loaded_with, mine

import rbstab
from rbstab.analysis.linearisation import NoDerivativesError, linearise
from rbstab.config.build import problem_of
from rbstab.config.load import load_config
from rbstab.config.tolerances import tolerances_of
from rbstab.experiment.convergence.convergence import Enclose
from rbstab.experiment.convergence.exact_motion import prove_convergence
from rbstab.experiment.proof import prove
from rbstab.experiment.robust.cache import bodies_for
from rbstab.experiment.simulate import simulate
from rbstab.experiment.stability import stability_of
from rbstab.experiment.stored_proof.identity import proof_id
from rbstab.experiment.stored_proof.starts import reached_state, start_state
from rbstab.experiment.tuning.guard import guard as guarded
from rbstab.experiment.tuning.kept_range import NotDecidedError, unguarded
from rbstab.mechanics.motion import motion_from_centre

HELD = CONTROLLER | {"variant": "permanent"}
TIED = CONTROLLER | {"variant": "visco-elastic", "K_c": [9000.0] * 3, "L_c": [90.0] * 3}
SPRING: dict[str, Any] = {"kind": "spring", "point": [0.02, 0.0, 0.3], "anchor": [0.6, 0.01, 0.9]}
SPRING |= {"stiffness": 300.0, "rest_length": 0.5}
BAND: dict[str, Any] = {"kind": "ligament", "point": [0.1, 0.2, 0.3], "anchor": [0.5, 0.1, 0.5]}
BAND |= {"stiffness": 100.0, "slack_length": 0.3, "toe_strain": 0.2, "damping": 8.0}
BARRIER = {"kind": "guard", "method": "barrier", "stiffness": 30.0}
STOP = {"kind": "guard", "method": "stop", "angle": 1.2, "restitution": 0.5}


def of(elements, controller=TIED, **changes):
    return load_config(config_data(elements, controller, **changes))


def said(config, proof):
    return " ".join(stability_of(problem_of(config), proof).statements)


@pytest.mark.heavy
def test_of_a_tied_body_each_spring_has_a_length():
    """Theorem 12: a spring may lose its length on the way, also beside a barrier."""
    config = of({"strut": SPRING})
    proof = prove(config)
    assert proof.globally_stable
    assert proof.needs_lengths
    assert start_state(problem_of(config), proof) == 1
    text = said(config, proof)
    assert "at which each spring has a length: 1 stable; proved to be all" in text
    assert "and each spring from a length of 0, converges" in text
    fast = of({"strut": SPRING}, initial={"angular_velocity": [14.0, 12.0, -9.0]})
    assert start_state(problem_of(fast), proof) is None
    assert prove_convergence(fast, problem_of(fast), proof).convergence.proved
    for outer in (0.0, 10.0):
        config = of({"strut": SPRING, "range": BARRIER | {"outer_stiffness": outer}})
        found = prove(config)
        assert (found.globally_stable, found.kept_by) == (True, "a barrier")
        assert not found.every_start
        assert start_state(problem_of(config), found) == 1
        assert "keeps each spring from a length of 0" in said(config, found)


def test_no_barrier_is_enough_for_every_start_with_a_spring(monkeypatch):
    """One stiffness is tried, briefly."""
    monkeypatch.setattr("rbstab.proof.limits.BRIEF_WITH_SPRINGS", 100)
    found = guarded(of({"strut": SPRING}, integration={"duration": 0.02, "samples": 3}))
    assert found.config is None
    ((_, why),) = found.tried
    assert "may lose its length" in why


def test_where_a_spring_has_no_length_there_is_no_linearisation():
    ends = {"point": [0.0, 0.0, 0.1], "anchor": [0.0, 0.0, 0.1]}
    body = {"mass": 12.0, "inertia": [0.29, 0.34, 0.13], "contact_point": [0, 0, 0]}
    spring = SPRING | ends | {"rest_length": 0.0, "damping": 30.0}
    start = {"position": [0.1, 0, 0]}
    problem = problem_of(of({"strut": spring}, body=body, gravity=[0, 0, 0], initial=start))
    rest = motion_from_centre(problem.system.body, problem.system.anchor, np.zeros(12))
    with np.errstate(all="ignore"), pytest.raises(NoDerivativesError):
        linearise(problem.system, rest, np.zeros(0))


def test_with_a_stop_every_start_converges():
    config = of({"range": STOP}, HELD)
    proof = prove(config)
    assert proof.every_start
    assert proof.kept_by == "a stop"
    text = said(config, proof)
    assert "Every start in the range converges: proved. A stop keeps every motion away" in text
    far = np.array([40.0, 1.1, -300.0])
    assert reached_state(proof, 1e9, far, far) == 1


def test_a_start_in_the_region_of_a_ligament_converges():
    config = of({"band": BAND}, HELD)
    proof, problem = prove(config), problem_of(config)
    assert start_state(problem, proof) == 1
    for enclose in (Enclose.BRIEFLY, Enclose.TO_END):
        found = prove_convergence(config, problem, proof, enclose).convergence
        assert (found.proved, found.rest_state) == (True, 1)
    assert ", inside;" in said(config, proof)
    with pytest.raises(NotDecidedError, match="ligaments"):
        unguarded(config)


@pytest.mark.heavy
def test_an_attitude_spring_and_a_tie_damp_every_motion():
    """They take the place of the stabilizers; the rest state is where a motion ends."""
    data = config_data({"tie": TIE, "upright": UPRIGHT}, None)
    proof = prove(data)
    lowest = proof.states[0]
    assert (lowest.proved, lowest.index) == (True, 0)
    # After half a turn the spring is at rest too.
    assert proof.unique is not True
    assert proof.region is not None
    assert proof.region.lower_bound > 100
    result = rbstab.simulate(data | {"integration": {"duration": 120.0, "samples": 4}})
    assert result["orientation"][-1] == pytest.approx(lowest.orientation, abs=1e-4)


def test_proof_ids_differ_with_the_elements():
    """In each number, in the kinds, and in how many there are; but not with the order."""
    guards = [
        {"kind": "guard", "method": "stiff", "stiffness": 1.0, "soft_angle": 1.0},
        {"kind": "guard", "method": "repelling", "couple": 1.0, "soft_angle": 1.0},
        STOP,
        BARRIER,
    ]
    different = [
        {},
        {"tie": TIE},
        {"tie": TIE | {"point": [0.0, 0.2, 1e-9]}},
        {"tie": TIE, "other": TIE},
        {"tie": TIE, "upright": UPRIGHT},
        {"tie": TIE, "strut": STRUT},
        {"tie": TIE, "strut": STRUT | {"rest_length": 0.81}},
        {"band": BAND},
        {"band": BAND | {"damping": 9.0}},
        *({"range": one} for one in guards),
    ]
    ids = [proof_id(of(elements, CONTROLLER)) for elements in different]
    ids += [proof_id(of({"band": BAND}, HELD)), proof_id(of(different[4], None))]
    assert len(set(ids)) == len(ids)
    assert proof_id(of({"upright": UPRIGHT, "tie": TIE}, CONTROLLER)) == ids[4]
    first = {key: value for key, value in config_data({}).items() if key != "elements"}
    assert proof_id(load_config(first | {"schema_version": 1})) == ids[0]


def test_a_stored_proof_covers_its_elements_alone(tmp_path):
    plain, config = of({}, CONTROLLER), of({"tie": TIE}, CONTROLLER)
    assert bodies_for(tmp_path, plain, tolerances_of(plain, ["body.mass=±1%"])).proved
    mass = {("body", "mass"): np.array([41.0, 41.1])}
    assert (robust_levels(tmp_path, plain, mass, 2) > 0).all()
    others = [*({name: one} for name, one in ONE_OF_EACH.items()), {"tie": TIE, "other": TIE}]
    assert not any(
        robust_levels(tmp_path, of(elements, CONTROLLER), mass, 2).any() for elements in others
    )
    assert not robust_levels(tmp_path, of({}, None), mass, 2).any()
    texts = ["body.mass=±1%", "elements.tie.point[1]=±0.01"]
    record = bodies_for(tmp_path, config, tolerances_of(config, texts))
    place = {("elements", "tie", "point", 1): np.array([0.2, 0.205, 0.2101, 0.19])}
    levels = robust_levels(tmp_path, config, place, 4)
    assert levels.tolist() == [record.level, record.level, 0.0, record.level]
    stiffer = {"tie": TIE | {"L_c": [30.0, 30.0, 12.1]}}
    for elements in (stiffer, {"tie": STRUT}, {"tie": TIE, "other": TIE}):
        assert not robust_levels(tmp_path, of(elements, CONTROLLER), {}, 1).any()


SATURATING = element_text(
    """
    def wrench(self, motion, own):
        f = velocity(motion, self.point)
        return force_at(motion, self.point, -self.c * f / sqrt(0.2 + f @ f) - self.k * tanh(f))

    def dissipated(self, motion, own):
        f = velocity(motion, self.point)
        return self.c * (f @ f) / sqrt(0.2 + f @ f) + self.k * (f @ tanh(f))
    """,
    'POINT, Gain("c", "N", "c", shape="number"), Gain("k", "N", "k", shape="number")',
).replace("import power", "import power, sqrt")


def moving(element):
    """Return the config of a held body that turns fast, and its exact motion."""
    fast = {"orientation": [0.5, -0.4, 0.3], "angular_velocity": [3.0, -1.5, 2.0]}
    short = {"duration": 1.0, "samples": 21}
    config = loaded_with({"one": element}, initial=fast, integration=short)
    return config, prove_convergence(config, problem_of(config), prove(config), Enclose.TO_END)


@pytest.mark.heavy
def test_the_exact_motion_of_code_is_that_of_our_own_element(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / CREEPING_TIE.name).write_text(CREEPING_TIE.read_text(encoding="utf-8"))
    ends = {"point": [0.1, 0.2, -0.1], "anchor": [0.0, 0.3, 0.1]}
    gains = {"K_c": [30, 20, 10], "L_c": [2, 3, 1], "K_d": [9, 8, 7], "L_d": [3, 2, 1]}
    code = {"file": CREEPING_TIE.name, "class": "CreepingTie"}
    _, theirs = moving(mine(**ends, **gains) | code)
    _, ours = moving({"kind": "embedded", **ends, **gains})
    assert list(theirs.samples.low) == list(ours.samples.low)
    for name, low in theirs.samples.low.items():
        # Each contains the exact motion, which is the same.
        assert np.all(low <= ours.samples.high[name])
        assert np.all(ours.samples.low[name] <= theirs.samples.high[name])
        assert np.all(theirs.samples.high[name] - low < 1e-9)


@pytest.mark.heavy
def test_runs_stay_in_the_enclosures_of_other_functions(tmp_path, monkeypatch):
    """A run with a tenth of a percent more damping leaves them."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.py").write_text(SATURATING)
    values = {"point": [0.1, 0.2, 0.3], "c": 1.0}
    config, found = moving(mine(k=0.3, **values))
    one = config.elements["one"]
    more = one.model_copy(update={"parameters": one.parameters | {"k": 0.3003}})
    other = simulate(config.model_copy(update={"elements": {"one": more}}))
    run, outside = simulate(config), 0.0
    for name, low in found.samples.low.items():
        high, count = found.samples.high[name], len(low)
        seen, wrong = (np.asarray(result[name])[:count] for result in (run, other))
        assert np.maximum(low - seen, seen - high).max() < 1e-10
        outside = max(outside, np.maximum(low - wrong, wrong - high).max())
    assert outside > 1e-5
