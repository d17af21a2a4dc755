"""Protects what is said and stored of bodies with elements: sentences, ids, motions, coverage."""

from typing import Any

import numpy as np
import pytest
from support.config_elements import BAND, CONTROLLER, HELD, config_data
from support.user_code import element_text, loaded_with, python_section

from rbstab.config.build import problem_of
from rbstab.config.load import load_config
from rbstab.experiment.convergence.convergence import Enclose
from rbstab.experiment.convergence.decisions import convergence_at_start
from rbstab.experiment.convergence.exact_motion import prove_convergence
from rbstab.experiment.proof import prove
from rbstab.experiment.simulate import simulate
from rbstab.experiment.stability import stability_of
from rbstab.experiment.stored_proof.starts import reached_state, start_state
from rbstab.experiment.tuning.guard import guard as guarded
from rbstab.experiment.tuning.soft_guard import NotDecidedError, unguarded

TIED = CONTROLLER | {"variant": "visco-elastic", "K_c": [9000.0] * 3, "L_c": [90.0] * 3}
SPRING: dict[str, Any] = {"kind": "spring", "point": [0.02, 0.0, 0.3], "anchor": [0.6, 0.01, 0.9]}
SPRING |= {"stiffness": 300.0, "rest_length": 0.5}
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
    distance = "keeps a distance from θ2 = ±π/2 and from springs without length"
    assert f"and {distance}, converges to the only rest state in the range" in text
    fast = of({"strut": SPRING}, initial={"angular_velocity": [14.0, 12.0, -9.0]})
    assert start_state(problem_of(fast), proof) is None
    assert prove_convergence(fast, problem_of(fast), proof).convergence.proved
    for outer in (0.0, 10.0):
        config = of({"strut": SPRING, "range": BARRIER | {"outer_stiffness": outer}})
        closed = prove(config)
        assert (closed.globally_stable, closed.kept_by) == (True, "a barrier")
        assert not closed.every_start
        assert start_state(problem_of(config), closed) == 1
        assert "and keeps a distance from springs without length, converges" in said(config, closed)


def test_no_barrier_is_enough_for_every_start_with_a_spring(monkeypatch):
    """One stiffness is tried, briefly."""
    monkeypatch.setattr("rbstab.proof.limits.BRIEF_WITH_SPRINGS", 100)
    attempt = guarded(of({"strut": SPRING}, integration={"duration": 0.02, "samples": 3}))
    assert attempt.config is None
    ((_, why),) = attempt.tried
    assert "may lose its length" in why


def test_with_a_stop_every_start_converges():
    config = of({"range": STOP}, HELD)
    proof = prove(config)
    assert proof.every_start
    assert proof.kept_by == "a stop"
    text = said(config, proof)
    assert "Every start in the range converges: proved. A stop keeps every motion away" in text
    far = np.array([40.0, 1.1, -300.0])
    assert reached_state(proof, 1e9, far, far) == 1
    # No enclosure follows a motion against a stop.
    assert convergence_at_start(problem_of(config), proof).bound == np.inf


def test_a_start_in_the_region_of_a_ligament_converges():
    config = of({"band": BAND}, HELD)
    proof, problem = prove(config), problem_of(config)
    assert start_state(problem, proof) == 1
    for enclose in (Enclose.BRIEFLY, Enclose.TO_END):
        convergence = prove_convergence(config, problem, proof, enclose).convergence
        assert (convergence.proved, convergence.rest_state) == (True, 1)
    assert ", inside;" in said(config, proof)
    with pytest.raises(NotDecidedError, match="ligaments"):
        unguarded(config)


SATURATING = element_text(
    """
    def wrench(self, motion, states):
        f = velocity(motion, self.point)
        return force_at(motion, self.point, -self.c * f / sqrt(0.2 + f @ f) - self.k * tanh(f))

    def dissipated(self, motion, states):
        f = velocity(motion, self.point)
        return self.c * (f @ f) / sqrt(0.2 + f @ f) + self.k * (f @ tanh(f))
    """,
    'POINT, Gain("c", "N", "c", shape="number"), Gain("k", "N", "k", shape="number")',
)


def moving(element):
    """Return the config of a held body that turns fast, and its exact motion."""
    fast = {"orientation": [0.5, -0.4, 0.3], "angular_velocity": [3.0, -1.5, 2.0]}
    short = {"duration": 1.0, "samples": 21}
    config = loaded_with({"one": element}, initial=fast, integration=short)
    return config, prove_convergence(config, problem_of(config), prove(config), Enclose.TO_END)


@pytest.mark.heavy
def test_runs_stay_in_the_enclosures_of_other_functions(tmp_path, monkeypatch):
    """A run with a tenth of a percent more damping leaves them."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.py").write_text(SATURATING)
    values = {"point": [0.1, 0.2, 0.3], "c": 1.0}
    config, enclosed = moving(python_section(k=0.3, **values))
    element = config.elements["one"]
    more = element.model_copy(update={"parameters": element.parameters | {"k": 0.3003}})
    other = simulate(config.model_copy(update={"elements": {"one": more}}))
    run, outside = simulate(config), 0.0
    for name, low in enclosed.samples.low.items():
        high, count = enclosed.samples.high[name], len(low)
        seen, wrong = (np.asarray(result[name])[:count] for result in (run, other))
        assert np.maximum(low - seen, seen - high).max() < 1e-10
        outside = max(outside, np.maximum(low - wrong, wrong - high).max())
    assert outside > 1e-5
